#include "porthole/scene/texture.h"

#include <array>

namespace porthole {

namespace {

constexpr float kByte = 1.0f / 255.0f;

const std::array<float, 256>& srgb_table() {
    static const std::array<float, 256> table = [] {
        std::array<float, 256> t{};
        for (int i = 0; i < 256; ++i) {
            const double c = i / 255.0;
            t[std::size_t(i)] = float(c <= 0.04045 ? c / 12.92 : std::pow((c + 0.055) / 1.055, 2.4));
        }
        return t;
    }();
    return table;
}

// Texel index in [0, n) of the integer texel coordinate `i`, whatever its sign.
int wrap_texel(std::int64_t i, int n, Wrap wrap) {
    if (i >= 0 && i < n) return int(i);
    switch (wrap) {
    case Wrap::clamp: return i < 0 ? 0 : n - 1;
    case Wrap::mirror: {
        const std::int64_t period = 2 * std::int64_t(n);
        const std::int64_t m = ((i % period) + period) % period;
        return int(m < n ? m : period - 1 - m);
    }
    case Wrap::repeat: break;
    }
    return int(((i % n) + n) % n);
}

Vec4f texel(const Image<Rgba8>& image, int x, int y, Encoding encoding) {
    const Rgba8 p = image(x, y);
    if (encoding == Encoding::linear) return {p.r * kByte, p.g * kByte, p.b * kByte, p.a * kByte};
    const auto& t = srgb_table();
    return {t[p.r], t[p.g], t[p.b], p.a * kByte};
}

// One axis of a bilinear footprint.
struct Tap {
    int i0, i1;
    float f;
};
Tap make_tap(float coordinate, int n, Wrap wrap, bool nearest) {
    // Beyond this a float has no fraction left, and the integers below could overflow.
    constexpr float kMost = 16777216.0f;
    const float x = std::clamp(coordinate * float(n) - (nearest ? 0.0f : 0.5f), -kMost, kMost);
    const float base = std::floor(x);
    const auto i = static_cast<std::int64_t>(base);
    if (nearest) return {wrap_texel(i, n, wrap), 0, 0.0f};
    return {wrap_texel(i, n, wrap), wrap_texel(i + 1, n, wrap), x - base};
}

template <typename T> T corners(const std::vector<T>& values, Vec3u t, float u, float v) {
    return values[t.x] * (1.0f - u - v) + values[t.y] * u + values[t.z] * v;
}

bool has_uv(const Mesh& mesh, int set) { return set >= 0 && set < 2 && !mesh.uv[set].empty(); }

} // namespace

float linear_from_srgb8(std::uint8_t value) { return srgb_table()[value]; }

Vec2f interpolate_uv(const Mesh& mesh, std::uint32_t triangle, float u, float v, int set) {
    if (!has_uv(mesh, set)) return {0, 0};
    return corners(mesh.uv[set], mesh.triangles[triangle], u, v);
}

Vec2f transform_uv(const TextureRef& ref, Vec2f uv) {
    const Vec2f s{uv.x * ref.scale.x, uv.y * ref.scale.y};
    if (ref.rotation == 0) return s + ref.offset;
    // v runs down the image, so the counter-clockwise turn has its sines swapped.
    const float c = std::cos(ref.rotation), n = std::sin(ref.rotation);
    return Vec2f{c * s.x + n * s.y, c * s.y - n * s.x} + ref.offset;
}

bool has_texture(const Scene& scene, const TextureRef& ref) {
    if (ref.texture < 0 || std::size_t(ref.texture) >= scene.textures.size()) return false;
    const std::int32_t image = scene.textures[std::size_t(ref.texture)].image;
    return image >= 0 && std::size_t(image) < scene.images.size() && !scene.images[std::size_t(image)].empty();
}

namespace {

Vec4f look_up(const Image<Rgba8>& image, const Texture& texture, Vec2f p, bool nearest, Encoding encoding) {
    const int x0 = image.window().x0, y0 = image.window().y0;
    const Tap a = make_tap(p.x, image.width(), texture.wrap_u, nearest);
    const Tap b = make_tap(p.y, image.height(), texture.wrap_v, nearest);
    if (nearest) return texel(image, x0 + a.i0, y0 + b.i0, encoding);
    const Vec4f top =
        texel(image, x0 + a.i0, y0 + b.i0, encoding) * (1 - a.f) + texel(image, x0 + a.i1, y0 + b.i0, encoding) * a.f;
    const Vec4f bottom =
        texel(image, x0 + a.i0, y0 + b.i1, encoding) * (1 - a.f) + texel(image, x0 + a.i1, y0 + b.i1, encoding) * a.f;
    return top * (1 - b.f) + bottom * b.f;
}

/// Between the levels of an image, 0 the image itself.
Vec4f look_up(const Scene& scene, const Texture& texture, Vec2f p, float level, Encoding encoding) {
    const std::size_t image = std::size_t(texture.image);
    const auto& mips = scene.mips[image];
    const float top = std::min(level, float(mips.size()));
    const auto below = static_cast<std::size_t>(top);
    const auto at = [&](std::size_t l) {
        return l == 0 ? look_up(scene.images[image], texture, p, texture.nearest, encoding)
                      : look_up(mips[l - 1], texture, p, false, encoding);
    };
    const float share = top - float(below);
    if (!(share > 0)) return at(below);
    return at(below) * (1 - share) + at(below + 1) * share;
}

} // namespace

Vec4f sample_texture(const Scene& scene, const TextureRef& ref, Vec2f uv, Encoding encoding) {
    if (!has_texture(scene, ref)) return {1, 1, 1, 1};
    const Texture& texture = scene.textures[std::size_t(ref.texture)];
    const Vec2f p = transform_uv(ref, uv);
    if (!std::isfinite(p.x) || !std::isfinite(p.y)) return {1, 1, 1, 1};
    return look_up(scene.images[std::size_t(texture.image)], texture, p, texture.nearest, encoding);
}

Vec4f sample_texture(const Scene& scene, const TextureRef& ref, const Mesh& mesh, std::uint32_t triangle, float u,
                     float v, Encoding encoding, const Footprint& footprint) {
    if (scene.mips.empty() || !has_texture(scene, ref) || !has_uv(mesh, ref.uv_set))
        return sample_texture(scene, ref, mesh, triangle, u, v, encoding);
    const Texture& texture = scene.textures[std::size_t(ref.texture)];
    const Image<Rgba8>& image = scene.images[std::size_t(texture.image)];
    const auto& uvs = mesh.uv[ref.uv_set];
    const Vec3u t = mesh.triangles[triangle];
    const Vec2f origin = transform_uv(ref, uvs[t.x]);
    const Vec2f du = transform_uv(ref, uvs[t.y]) - origin, dv = transform_uv(ref, uvs[t.z]) - origin;
    const auto axis = [&](Vec2f barycentric) { return du * barycentric.x + dv * barycentric.y; };
    const auto texels = [&](Vec2f d) { return std::hypot(d.x * float(image.width()), d.y * float(image.height())); };
    Vec2f along = axis(footprint.a);
    float longer = texels(along), shorter = texels(axis(footprint.b));
    if (shorter > longer) {
        along = axis(footprint.b);
        std::swap(longer, shorter);
    }
    if (!(longer > 1) || !std::isfinite(longer)) return sample_texture(scene, ref, mesh, triangle, u, v, encoding);
    const float width = std::max({shorter, longer / float(kMostProbes), 1.0f});
    const int probes = std::clamp(int(std::ceil(longer / width - 0.25f)), 1, kMostProbes);
    const float level = std::log2(probes == 1 ? longer : width);
    const Vec2f middle = transform_uv(ref, interpolate_uv(mesh, triangle, u, v, ref.uv_set));
    if (!std::isfinite(middle.x) || !std::isfinite(middle.y)) return {1, 1, 1, 1};
    Vec4f sum{0, 0, 0, 0};
    for (int i = 0; i < probes; ++i) {
        const float at = (float(i) + 0.5f) / float(probes) - 0.5f;
        sum = sum + look_up(scene, texture, middle + along * at, level, encoding);
    }
    return sum * (1.0f / float(probes));
}

Vec4f sample_texture(const Scene& scene, const TextureRef& ref, const Mesh& mesh, std::uint32_t triangle, float u,
                     float v, Encoding encoding) {
    if (ref.texture < 0 || !has_uv(mesh, ref.uv_set)) return {1, 1, 1, 1};
    return sample_texture(scene, ref, interpolate_uv(mesh, triangle, u, v, ref.uv_set), encoding);
}

Vec4f vertex_color(const Mesh& mesh, std::uint32_t triangle, float u, float v) {
    if (mesh.colors.empty()) return {1, 1, 1, 1};
    return corners(mesh.colors, mesh.triangles[triangle], u, v);
}

Vec4f base_color(const Scene& scene, const Mesh& mesh, std::uint32_t triangle, float u, float v,
                 const Footprint& footprint) {
    const Material& material = scene.materials[mesh.material_of(triangle)];
    const Vec4f t = sample_texture(scene, material.base_color_texture, mesh, triangle, u, v, Encoding::srgb, footprint);
    const Vec4f c = vertex_color(mesh, triangle, u, v);
    const Vec4f f = material.base_color;
    return {f.x * t.x * c.x, f.y * t.y * c.y, f.z * t.z * c.z, f.w * t.w * c.w};
}

float base_alpha(const Scene& scene, const Mesh& mesh, std::uint32_t triangle, float u, float v) {
    const Material& material = scene.materials[mesh.material_of(triangle)];
    float alpha = material.base_color.w;
    if (!mesh.colors.empty()) alpha *= vertex_color(mesh, triangle, u, v).w;
    if (material.base_color_texture.texture >= 0)
        alpha *= sample_texture(scene, material.base_color_texture, mesh, triangle, u, v, Encoding::linear).w;
    return alpha;
}

Vec3f transmission_tint(const Scene& scene, const Mesh& mesh, std::uint32_t triangle, float u, float v) {
    const Material& material = scene.materials[mesh.material_of(triangle)];
    if (!passes_light(material)) return {0, 0, 0};
    const Vec4f base = base_color(scene, mesh, triangle, u, v);
    const Vec3f color{clamp01(base.x), clamp01(base.y), clamp01(base.z)};
    const float alpha = material.alpha_mode == AlphaMode::blend ? clamp01(base.w) : 1.0f;

    Vec3f through{0, 0, 0}; // what the covered share of the surface lets pass
    if (material.transmission > 0) {
        const float share =
            clamp01(material.transmission) *
            sample_texture(scene, material.transmission_texture, mesh, triangle, u, v, Encoding::linear).x;
        if (material.thickness > 0) {
            const float crossings = 0.5f * material.thickness / material.attenuation_distance;
            const auto half = [&](float c, float attenuation) {
                return std::sqrt(c) * (crossings > 0 ? std::pow(clamp01(attenuation), crossings) : 1.0f);
            };
            through = Vec3f{half(color.x, material.attenuation_color.x), half(color.y, material.attenuation_color.y),
                            half(color.z, material.attenuation_color.z)} *
                      share;
        } else {
            through = color * share;
        }
    }
    // What the blending leaves open is tinted in proportion to how much there is to tint with.
    const Vec3f open = lerp(Vec3f{1, 1, 1}, color, alpha) * (1.0f - alpha);
    return open + through * alpha;
}

} // namespace porthole
