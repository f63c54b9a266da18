#include "porthole/render/cap.h"

#include <cmath>

#include "porthole/scene/texture.h"

namespace porthole {

namespace {

constexpr float kLight = 0.22f;  ///< luminance from which a cap is darker than its part
constexpr float kDarker = 0.62f; ///< by this
constexpr float kToGrey = 0.35f; ///< else it goes this far towards kGrey
constexpr float kGrey = 0.8f;
constexpr float kLift = 0.12f;     ///< ambient light that caps get on top, of their albedo
constexpr float kHatchSpacing = 9; ///< pixels of a picture 1080 high
constexpr float kHatchWidth = 1.6f;
constexpr float kOff = 0.01f;     ///< how far off a flat cut surface secondary rays start, pixel sizes
constexpr float kHatchInk = 0.3f; ///< brightness of a hatch line

float luminance(Vec3f c) { return 0.2126f * c.x + 0.7152f * c.y + 0.0722f * c.z; }

/// Share of a pixel around `at` that hatch lines cover.
float hatch_coverage(Vec2f at, PartId part, int picture_height) {
    const float scale = std::max(1.0f, float(picture_height) / 1080.0f);
    const float spacing = kHatchSpacing * scale, half_width = 0.5f * kHatchWidth * scale;
    // Drawing practice: 45 degrees, the other way for the next part, then flatter and steeper.
    constexpr float kAngles[] = {45, 135, 30, 150, 60, 120};
    const float angle = kAngles[index(part) % 6] * (kPi / 180);
    const float across = (at.x * std::sin(angle) + at.y * std::cos(angle)) / spacing;
    const float from_line = std::abs(across - std::floor(across + 0.5f)) * spacing;
    return clamp01(half_width - from_line + 0.5f);
}

} // namespace

SurfacePoint cap_point(const Cut& cut, std::size_t level, float x, float y, float depth) {
    const View& view = cut.view;
    const auto along = [](const Ray& ray, float z) { return ray.origin + ray.direction * (z / ray.depth_per_t); };
    const auto at = [&](float px, float py, float z) { return along(view.ray(px, py), z); };
    SurfacePoint point;
    const Ray seen = view.ray(x, y);
    point.position = along(seen, depth);
    const Vec3f to_eye = -seen.direction;
    const CutDepth own = cut.depth_at(x, y, level);
    // The slope along one axis of the picture: from both sides if the surface goes on there.
    float bend = 0; // how far the surface leaves its tangent plane within a pixel, metres
    const auto slope = [&](float dx, float dy, Vec3f& step) {
        const auto joined = [&](float sign, float& z) {
            const float px = x + sign * dx, py = y + sign * dy;
            if (cut.distance_at(px, py) > 0) return false;
            const CutDepth d = cut.depth_at(px, py, level);
            z = d.depth;
            return d.depth > -kInfinity && d.chamfer == own.chamfer &&
                   (own.chamfer || std::abs(d.depth - own.depth) < 16 * view.pixel_size(own.depth));
        };
        float before = depth, after = depth;
        const bool has_before = joined(-1, before), has_after = joined(1, after);
        if (!has_before && !has_after) return false;
        if (has_before && has_after)
            bend = std::max(bend, 2 * std::abs(before - 2 * depth + after) / std::max(1.0f, dx + dy));
        step = (has_after ? at(x + dx, y + dy, after) : point.position) -
               (has_before ? at(x - dx, y - dy, before) : point.position);
        return true;
    };
    Vec3f right, down;
    Vec3f normal = to_eye;
    // Floors are smoothed over many pixels, and what is left of their steps must not show.
    const float reach = own.chamfer ? 0.5f : 3.0f;
    if (slope(reach, 0, right) && slope(0, reach, down)) normal = normalize(cross(right, down), to_eye);
    if (dot(normal, to_eye) < 0) normal = -normal;
    point.flat_normal = point.normal = normal;
    const float pixel = view.pixel_size(depth);
    point.start = point.position + normal * std::min(kOff * pixel + bend, pixel);
    point.beyond = point.position - normal * (kOff * pixel);
    point.front = true;
    return point;
}

Substance cap_substance(const Scene& scene, const Placement& placement, const Hit& hit, const RenderParams& params,
                        Vec2f at, int picture_height) {
    Substance s = substance(scene, placement, hit);
    if (passes_light(*s.material)) return s;
    s.color = luminance(s.color) > kLight ? s.color * kDarker : lerp(s.color, Vec3f{kGrey, kGrey, kGrey}, kToGrey);
    if (params.cap == CapStyle::tint) s.color = params.cap_tint;
    if (params.cap == CapStyle::hatch) {
        const Vec3f paper = lerp(s.color, Vec3f{kGrey, kGrey, kGrey}, kToGrey);
        s.color = lerp(paper, paper * kHatchInk, hatch_coverage(at, hit.part, picture_height));
    }
    const auto in_range = [](float v) { return std::clamp(v, kDarkest, kLightest); };
    s.diffuse = {in_range(s.color.x), in_range(s.color.y), in_range(s.color.z)};
    s.f0 = {0, 0, 0};
    s.roughness = 1;
    s.coverage = 1;
    s.transmission = 0;
    s.occlusion = 1;
    s.emission = s.diffuse * kLift;
    return s;
}

} // namespace porthole
