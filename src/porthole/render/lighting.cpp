#include "porthole/render/lighting.h"

namespace porthole {

namespace {

constexpr float kKeyStrength = 0.6f;
constexpr float kKeySize = 0.1f; // tangent of the key's angular radius

float luminance(Vec3f c) { return 0.2126f * c.x + 0.7152f * c.y + 0.0722f * c.z; }

/// Box around a part's box: no look at every vertex, and the same for every view.
Bounds3d loose_bounds(const Scene& scene, const Part& part) {
    Bounds3d bounds;
    const Bounds3f& box = scene.meshes[part.mesh].bounds;
    for (int i = 0; i < 8 && !box.empty(); ++i) bounds.extend(part.world_from_mesh.point(Vec3d(box.corner(i))));
    return bounds;
}

Lamp default_key(const View& view) {
    const Affine3f& c = view.world_from_camera;
    Lamp key;
    key.strength = {kKeyStrength, kKeyStrength, kKeyStrength};
    key.direction = -normalize(c.x * -0.35f + c.y * 0.5f + c.z);
    key.size = kKeySize;
    return key;
}

Lamp lamp_from(const Light& light, float scene_radius) {
    Lamp lamp;
    lamp.kind = light.kind;
    lamp.strength = light.color * light.intensity;
    lamp.position = light.position;
    lamp.direction = normalize(light.direction, Vec3f{0, -1, 0});
    // Real lamps have a size; a hard edge would be the only hard edge in the picture.
    lamp.size = light.kind == Light::Kind::directional ? 0.02f : 0.01f * scene_radius;
    lamp.range = light.range > 0 ? light.range : kInfinity;
    lamp.cos_outer = std::cos(std::clamp(light.outer_cone, 0.0f, kPi));
    lamp.cos_inner = std::max(std::cos(std::clamp(light.inner_cone, 0.0f, kPi)), lamp.cos_outer + 1e-4f);
    return lamp;
}

/// A file can bring thousands of lamps; each costs shadow rays in every pixel.
void keep_strongest(std::vector<Lamp>& lamps, Vec3f middle, float radius) {
    constexpr std::size_t kMost = 16;
    if (lamps.size() <= kMost) return;
    const auto power = [&](const Lamp& lamp) {
        if (lamp.kind == Light::Kind::directional) return luminance(lamp.strength);
        const Vec3f to = lamp.position - middle;
        return luminance(lamp.strength) / (dot(to, to) + radius * radius);
    };
    std::stable_sort(lamps.begin(), lamps.end(), [&](const Lamp& a, const Lamp& b) { return power(a) > power(b); });
    lamps.resize(kMost);
}

float smooth_ramp(float a, float b, float x) {
    const float t = clamp01((x - a) / (b - a));
    return t * t * (3.0f - 2.0f * t);
}

} // namespace

Incident incident(const Lamp& lamp, Vec3f point) {
    if (lamp.kind == Light::Kind::directional) return {-lamp.direction, lamp.strength, kInfinity};
    const Vec3f to = lamp.position - point;
    const float d2 = std::max(dot(to, to), 1e-12f), distance = std::sqrt(d2);
    Incident in{to / distance, {0, 0, 0}, distance};
    if (distance >= lamp.range) return in;
    float fade = 1.0f / d2;
    if (lamp.range < kInfinity) { // KHR_lights_punctual's recommended window
        const float q = d2 / (lamp.range * lamp.range);
        fade *= clamp01(1.0f - q * q);
    }
    if (lamp.kind == Light::Kind::spot) {
        const float c = -dot(in.direction, lamp.direction);
        const float t = clamp01((c - lamp.cos_outer) / (lamp.cos_inner - lamp.cos_outer));
        fade *= t * t;
    }
    in.strength = lamp.strength * fade;
    return in;
}

Lighting make_lighting(const Scene& scene, const View& view, std::span<const PartId> targets) {
    Lighting lighting;
    Bounds3d box;
    for (const Part& part : scene.parts) box.extend(loose_bounds(scene, part));
    const float radius = std::max(float(0.5 * box.diagonal()), 1e-12f);
    lighting.eye = view.eye();
    lighting.to_eye = -view.forward();
    lighting.orthographic = view.orthographic;
    float target_radius = 0;
    for (const PartId id : targets)
        target_radius = std::max(target_radius, float(0.5 * loose_bounds(scene, scene.parts[index(id)]).diagonal()));
    lighting.plain_radius = 0.12f * radius;
    lighting.hole_radius =
        target_radius > 0 ? std::clamp(0.25f * target_radius, 0.02f * radius, 0.25f * radius) : lighting.plain_radius;

    for (const Light& light : scene.lights) {
        const Lamp lamp = lamp_from(light, radius);
        if (is_finite(lamp.strength) && is_finite(lamp.position) && luminance(lamp.strength) > 0)
            lighting.lamps.push_back(lamp);
    }
    keep_strongest(lighting.lamps, Vec3f(box.center()), radius);
    // What the lamps give the middle of each part, larger parts counting more. A lamp right
    // beside a part must not darken all others: near distances count as a tenth of the scene.
    double sum = 0, weights = 0;
    for (std::size_t i = 0; i < scene.parts.size() && !lighting.lamps.empty(); ++i) {
        const Bounds3d b = loose_bounds(scene, scene.parts[i]);
        if (b.empty()) continue;
        const double weight = b.diagonal() * b.diagonal();
        const Vec3f middle(b.center());
        for (const Lamp& lamp : lighting.lamps) {
            const Incident in = incident(lamp, middle);
            float given = luminance(in.strength);
            if (in.distance < 0.1f * radius) given *= in.distance * in.distance / (0.01f * radius * radius);
            sum += weight * double(given);
        }
        weights += weight;
    }
    const double mean = weights > 0 ? sum / weights : 0;
    if (mean > 0 && std::isfinite(mean)) {
        // Half of a surface's orientations turn away from a lamp, as they do from the key.
        for (Lamp& lamp : lighting.lamps) lamp.strength = lamp.strength * float(double(kKeyStrength) / mean);
    } else {
        lighting.lamps.assign(1, default_key(view));
    }
    return lighting;
}

Vec3f sky_irradiance(Vec3f n) {
    constexpr Vec3f kGround{0.60f, 0.58f, 0.56f}, kSky{0.97f, 0.99f, 1.03f};
    return lerp(kGround, kSky, 0.5f + 0.5f * std::clamp(n.y, -1.0f, 1.0f));
}

Vec3f sky_radiance(Vec3f d, float roughness) {
    constexpr Vec3f kNadir{0.42f, 0.40f, 0.38f}, kGround{0.50f, 0.48f, 0.46f};
    constexpr Vec3f kHorizon{1.25f, 1.25f, 1.24f}, kZenith{0.80f, 0.86f, 0.94f};
    const float h = std::clamp(d.y, -1.0f, 1.0f);
    const float r = clamp01(roughness);
    const Vec3f above = lerp(kHorizon, kZenith, smooth_ramp(-0.2f * r, 0.7f + 0.3f * r, h));
    const Vec3f below = lerp(kGround, kNadir, clamp01(-h));
    const float width = 0.05f + 0.85f * r;
    return lerp(below, above, smooth_ramp(-width, width, h));
}

} // namespace porthole
