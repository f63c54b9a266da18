// A model in memory: meshes, parts that place them, materials, lights, cameras. Elements
// refer to each other by index; a Scene is a plain value, constant once loaded.
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "porthole/base/error.h"
#include "porthole/base/ids.h"
#include "porthole/base/math.h"
#include "porthole/scene/primitive.h"

namespace porthole {

inline constexpr std::int32_t kNone = -1;

enum class Wrap : std::uint8_t { repeat, clamp, mirror };

struct Texture {
    std::int32_t image = kNone; ///< index into Scene::images
    Wrap wrap_u = Wrap::repeat, wrap_v = Wrap::repeat;
    bool nearest = false;
};

/// A texture as a material uses it: uv' = offset + rotate(rotation) * (scale * uv), as
/// KHR_texture_transform says.
struct TextureRef {
    std::int32_t texture = kNone; ///< index into Scene::textures
    std::uint8_t uv_set = 0;      ///< 0 or 1
    Vec2f offset{0, 0}, scale{1, 1};
    float rotation = 0; ///< radians, counter-clockwise in uv space as glTF defines it
};

enum class AlphaMode : std::uint8_t { opaque, mask, blend };

/// glTF 2 metallic-roughness; the older specular-glossiness fills the same fields with
/// `specular_workflow` set. Colours are linear.
struct Material {
    std::string name;
    Vec4f base_color{1, 1, 1, 1}; ///< diffuse colour when specular_workflow
    float metallic = 1, roughness = 1;
    bool specular_workflow = false;
    Vec3f specular_color{1, 1, 1};         ///< reflectance at normal incidence; specular_workflow only
    Vec3f emissive{0, 0, 0};               ///< includes KHR_materials_emissive_strength
    TextureRef base_color_texture;         ///< sRGB, alpha linear
    TextureRef metallic_roughness_texture; ///< G roughness, B metallic; or RGB specular (sRGB) + A glossiness
    TextureRef normal_texture, emissive_texture, occlusion_texture;
    float normal_scale = 1, occlusion_strength = 1;
    AlphaMode alpha_mode = AlphaMode::opaque;
    float alpha_cutoff = 0.5f;
    bool double_sided = false;
    bool unlit = false;
    float transmission = 0;          ///< share of light that passes, KHR_materials_transmission
    TextureRef transmission_texture; ///< R
    float ior = 1.5f;
    float thickness = 0; ///< metres; 0: a thin sheet that does not bend light
    Vec3f attenuation_color{1, 1, 1};
    float attenuation_distance = kInfinity; ///< metres
};

/// A run of triangles, or of primitives' surfaces, with one material.
struct Submesh {
    std::uint32_t first_triangle = 0, triangle_count = 0;
    std::uint32_t material = 0; ///< index into Scene::materials
};

/// Triangles counter-clockwise in front, in the mesh's own coordinates. Attribute arrays
/// are empty or as long as `positions`. A mesh of primitives has no triangles and no
/// attributes: their surfaces take the place of triangles wherever they are numbered, and a hit's
/// u and v are surface_coordinates().
struct Mesh {
    std::string name;
    PrimitiveTree primitives;     ///< empty: triangles
    std::vector<Vec3f> positions; ///< finite; with capacity for one more, Embree shares them, else it copies
    std::vector<Vec3u> triangles; ///< indices below positions.size()
    std::vector<Vec3f> normals;   ///< unit length; empty: shaded flat
    std::vector<Vec4f> tangents;  ///< xyz unit length, w = handedness
    std::array<std::vector<Vec2f>, 2> uv;
    std::vector<Vec4f> colors;      ///< linear, multiplies base_color
    std::vector<Submesh> submeshes; ///< in order, covering every triangle once
    Bounds3f bounds;

    [[nodiscard]] std::uint32_t material_of(std::uint32_t triangle) const;
    /// Nothing to be hit.
    [[nodiscard]] bool empty() const { return triangles.empty() && primitives.bounds().empty(); }
};

struct Part {
    std::string name;         ///< as in the file, raw bytes made valid UTF-8; may be empty or repeat
    std::string path;         ///< unique: names from the root joined by '/', "[n]" where unnamed or repeated
    std::uint32_t mesh = 0;   ///< index into Scene::meshes
    Affine3d world_from_mesh; ///< relative to Scene::origin; invertible
};

struct Light {
    enum class Kind : std::uint8_t { directional, point, spot } kind = Kind::directional;
    std::string name;
    Vec3f color{1, 1, 1};
    float intensity = 1;                        ///< lux (directional) or candela
    Vec3f position;                             ///< world
    Vec3f direction{0, 0, -1};                  ///< world, unit; the way the light travels
    float range = kInfinity;                    ///< metres
    float inner_cone = 0, outer_cone = kPi / 4; ///< radians from the axis
};

/// A camera that the file brings.
struct FileCamera {
    std::string name;
    Affine3d world_from_camera; ///< orthonormal, relative to Scene::origin
    bool orthographic = false;
    float fov_y = 0.8f;    ///< radians
    float half_height = 1; ///< metres, orthographic
};

struct Scene {
    std::vector<Mesh> meshes;
    std::vector<Part> parts;         ///< PartId i is parts[i], in the order of the file's tree
    std::vector<Material> materials; ///< at least one when there is a mesh
    std::vector<Texture> textures;
    std::vector<Image<Rgba8>> images;            ///< an empty image: could not be read (a warning says so)
    std::vector<std::vector<Image<Rgba8>>> mips; ///< of each image its halves, quarters..., from build_mips(); or empty
    std::vector<Light> lights;
    std::vector<FileCamera> cameras;
    Vec3d origin{0, 0, 0}; ///< file coordinates = stored world coordinates + origin, metres
    std::string source;    ///< path as given
    std::string format;    ///< "glTF", "OBJ", "PLY", "STL"
    Warnings warnings;

    [[nodiscard]] const Mesh& mesh_of(PartId part) const { return meshes[parts[index(part)].mesh]; }
};

/// World-space box of a part (exact over its vertices; of primitives as bounds() says) and of all parts.
[[nodiscard]] Bounds3d part_bounds(const Scene& scene, PartId part);
[[nodiscard]] Bounds3d scene_bounds(const Scene& scene);

/// All part ids, 0..n-1.
[[nodiscard]] std::vector<PartId> all_parts(const Scene& scene);
[[nodiscard]] std::uint64_t triangle_count(
    const Scene& scene); ///< over parts: a shared mesh counts each time; primitives have none

/// Coordinates beyond this, in metres or a mesh's own units, are not usable: from there, and
/// from a camera that sees all of it, products of coordinates still fit into float.
inline constexpr float kLargestCoordinate = 1e12f;

/// Puts a freshly read mesh in order: drops triangles with a non-finite, out-of-range or
/// repeated corner, and all triangles when none has any area, computes bounds, reserves Embree's padding, fixes the
/// submeshes. Every reader calls it.
/// Of primitives it makes the submeshes and the bounds.
/// @return how many triangles were dropped for (a) non-finite vertices, (b) no area.
struct MeshRepair {
    std::uint64_t non_finite = 0, degenerate = 0;
};
MeshRepair finish_mesh(Mesh& mesh);

/// Moves the scene near the origin of world coordinates when it lies so far off that float
/// coordinates would lose it (distance over 16 diagonals); Scene::origin remembers.
void recentre(Scene& scene);

/// Gives every part a unique `path`, from the names of its ancestors and itself. `chains[i]`
/// lists them from the root (unnamed groups already numbered "[n]" by the reader); parts whose
/// whole path is empty or repeated get "[n]" appended,
/// n counting from 0 in file order among equals.
void assign_paths(Scene& scene, const std::vector<std::vector<std::string>>& chains);

} // namespace porthole
