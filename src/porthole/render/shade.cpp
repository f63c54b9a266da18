#include "porthole/render/shade.h"

#include "porthole/render/bxdf.h"

namespace porthole {

namespace {

float largest(Vec3f v) { return std::max({v.x, v.y, v.z}); }

float ramp(float a, float b, float x) {
    const float t = clamp01((x - a) / (b - a));
    return t * t * (3.0f - 2.0f * t);
}

} // namespace

Shaded shade(const Lighting& lighting, const SurfacePoint& point, Vec3f normal, Vec3f to_eye, const Substance& s,
             const Reach& reach, bool trace_mirrors) {
    Shaded out{};
    if (s.material->unlit) {
        out.shown = s.color;
        return out;
    }
    const float cos_eye = std::max(dot(normal, to_eye), 1e-3f);
    const LobeAlbedo lobe = lobe_albedo(s.roughness, cos_eye);
    const Vec3f glossy = lobe.of(s.f0);
    const Vec3f boost = lobe.compensation(s.f0);
    // What the surface reflects as a mirror cannot reach the matte layer below.
    const Vec3f matte = s.diffuse * (1.0f - largest(glossy));
    const float alpha = s.roughness * s.roughness;

    Vec3f light = s.emission;
    for (const Lamp& lamp : lighting.lamps) {
        const Incident in = incident(lamp, point.position);
        const float cosine = dot(normal, in.direction);
        if (!(cosine > 0)) continue;
        // The lamp's own size blurs the highlight (Karis 2013).
        const float size = lamp.kind == Light::Kind::directional ? lamp.size : lamp.size / in.distance;
        const float widened = clamp01(alpha + 0.5f * size);
        const Vec3f lobe_value = ggx(s.f0, widened, normal, in.direction, to_eye) * boost * kPi;
        light += in.strength * reach.lamps * (matte + lobe_value) * cosine;
    }

    const float closed_in = 1.0f - reach.ambient * s.occlusion;
    const float ambient = 1.0f - lighting.ambient_shadow * closed_in;
    const float fill =
        (1.0f - lighting.fill_shadow * closed_in) * std::max(0.0f, dot(normal, lighting.to_fill(point.position)));
    light += matte * (sky_irradiance(normal) * (lighting.ambient * ambient) + lighting.fill * fill);

    // Mirror image of the surroundings. The sky stands for the fill as well, or metals would
    // be darker than paint.
    const Vec3f mirrored = reflect(-to_eye, normal);
    const float sky_strength = lighting.ambient + lighting.fill.y;
    float traced = 0;
    if (trace_mirrors) {
        traced = ramp(0.3f, 0.15f, s.roughness) * ramp(0.05f, 0.15f, largest(glossy));
        out.mirror = glossy * traced;
    }
    // Lagarde and de Rousiers, "Moving Frostbite to PBR" (2014): how much of the lobe is closed.
    const float open = clamp01(std::pow(cos_eye + ambient, std::exp2(-16.0f * s.roughness - 1.0f)) - 1.0f + ambient);
    light += sky_radiance(mirrored, s.roughness) * glossy * boost * (sky_strength * open * (1.0f - traced));
    out.light = light;
    return out;
}

Vec3f shade_flat(const Substance& s, Vec3f normal, Vec3f to_eye) {
    const Vec3f color{std::clamp(s.color.x, 0.0f, 1.0f), std::clamp(s.color.y, 0.0f, 1.0f),
                      std::clamp(s.color.z, 0.0f, 1.0f)};
    return color * clamp01(dot(normal, to_eye));
}

Vec3f shoulder(Vec3f light) {
    const auto bend = [](float x) {
        constexpr float kStraight = 0.7f, kRest = 1.0f - kStraight;
        if (!(x > kStraight)) return std::max(x, 0.0f);
        const float y = (std::min(x, 1e6f) - kStraight) / kRest;
        return kStraight + kRest * y / (1.0f + y);
    };
    return {bend(light.x), bend(light.y), bend(light.z)};
}

} // namespace porthole
