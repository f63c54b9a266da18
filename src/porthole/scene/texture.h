// Looking up textures and vertex colours at a point of a triangle. Shared by the ray filters
// in trace/ and the shading in render/.
#pragma once

#include <cstdint>

#include "porthole/base/parallel.h"
#include "porthole/scene/scene.h"

namespace porthole {

/// How the bytes of a texture are meant.
enum class Encoding : std::uint8_t {
    linear, ///< value / 255
    srgb    ///< RGB are sRGB-encoded, alpha is linear
};

/// sRGB byte to linear [0, 1].
[[nodiscard]] float linear_from_srgb8(std::uint8_t value);

/// Texture coordinates of `set` (0 or 1) at barycentric (u, v) of a triangle: corner 0 has
/// weight 1-u-v, corner 1 u, corner 2 v. (0, 0) if the mesh has no such set.
[[nodiscard]] Vec2f interpolate_uv(const Mesh& mesh, std::uint32_t triangle, float u, float v, int set);

/// Applies the reference's offset, rotation and scale (KHR_texture_transform).
[[nodiscard]] Vec2f transform_uv(const TextureRef& ref, Vec2f uv);

/// The texture at `uv` (before its transform), bilinear or nearest as the texture asks, with
/// its wrap modes. Texel (0,0) is the image's top-left and covers uv [0, 1/width) x [0, 1/height).
/// White if there is no texture or its image could not be read, or if `uv` is not finite.
[[nodiscard]] Vec4f sample_texture(const Scene& scene, const TextureRef& ref, Vec2f uv, Encoding encoding);

/// Whether `ref` names a texture with an image.
[[nodiscard]] bool has_texture(const Scene& scene, const TextureRef& ref);

/// The texture at a point of a triangle; white as above, or if the mesh lacks the uv set.
[[nodiscard]] Vec4f sample_texture(const Scene& scene, const TextureRef& ref, const Mesh& mesh, std::uint32_t triangle,
                                   float u, float v, Encoding encoding);

/// Fills `scene.mips`: versions of every image half as large each time, down to one texel, a third of
/// the images' memory in all. A texel is the mean of those it covers, as light where a material uses
/// the image as colour; colours under no alpha do not count where alpha hides them.
/// load_scene() calls it, so that a loaded scene never changes. Without them images are not filtered.
/// @throws Cancelled. Cost: 7 ns a texel, 9 of colours, images side by side.
void build_mips(Scene& scene, const Control& control = {});

/// The part of a surface that one sample stands for: the axes of an ellipse, in barycentric (u, v) of
/// the triangle, as long as the ellipse. Zero: a point.
struct Footprint {
    Vec2f a{0, 0}, b{0, 0};
};

/// The mean of a texture over a footprint around a point of a triangle: up to kMostProbes trilinear
/// look-ups along the longer axis, each as wide as the shorter one. The texture itself, as above, where the
/// footprint is smaller than a texel or there are no mips.
/// Source: Akenine-Moeller et al., "Improved Shader and Texture Level of Detail Using Ray Cones" (2021).
[[nodiscard]] Vec4f sample_texture(const Scene& scene, const TextureRef& ref, const Mesh& mesh, std::uint32_t triangle,
                                   float u, float v, Encoding encoding, const Footprint& footprint);
inline constexpr int kMostProbes = 8;

/// Vertex colour at a point of a triangle, linear; white without vertex colours.
[[nodiscard]] Vec4f vertex_color(const Mesh& mesh, std::uint32_t triangle, float u, float v);

/// Material's base colour x base colour texture x vertex colour, linear, straight alpha.
[[nodiscard]] Vec4f base_color(const Scene& scene, const Mesh& mesh, std::uint32_t triangle, float u, float v,
                               const Footprint& footprint = {});

/// Alpha of base_color(), cheaper. A masked texel is passed through where this is below the
/// material's alpha_cutoff. Never filtered: what is hit does not depend on how large a pixel is.
[[nodiscard]] float base_alpha(const Scene& scene, const Mesh& mesh, std::uint32_t triangle, float u, float v);

/// Share of light, per channel in [0, 1], that a shadow ray keeps when it crosses this
/// surface: 1 - alpha tinted by the colour for blended surfaces; transmission x colour for
/// transmissive ones. A body with thickness is crossed twice, so each crossing takes the
/// square root of its colour and of Beer's law over that thickness. 0: opaque.
[[nodiscard]] Vec3f transmission_tint(const Scene& scene, const Mesh& mesh, std::uint32_t triangle, float u, float v);

/// Whether light passes the material at all: blended or transmissive (masked is not).
[[nodiscard]] inline bool passes_light(const Material& material) {
    return material.alpha_mode == AlphaMode::blend || material.transmission > 0;
}

} // namespace porthole
