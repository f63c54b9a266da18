// The physics of one surface point: Fresnel, refraction and the GGX microfacet lobe.
#pragma once

#include <optional>

#include "porthole/base/math.h"

namespace porthole {

/// Mirror direction of `d` (pointing to the surface) at unit normal `n`.
[[nodiscard]] constexpr Vec3f reflect(Vec3f d, Vec3f n) { return d - n * (2.0f * dot(d, n)); }

/// Direction of `d` (unit, pointing to the surface) past an interface with unit normal `n` on
/// the side that `d` comes from. Snell's law.
/// @param eta  index beyond / index on the side of `n`, > 0.
/// @return unit direction; empty on total internal reflection.
[[nodiscard]] std::optional<Vec3f> refract(Vec3f d, Vec3f n, float eta);

/// Unpolarised reflectance of a smooth dielectric; 1 on total internal reflection.
/// @param cosine  of the angle to the normal on the side the light comes from, [0, 1].
/// @param eta     index beyond / index on this side, > 0.
[[nodiscard]] float fresnel_dielectric(float cosine, float eta);

/// Schlick's approximation from the reflectance `f0` at normal incidence.
[[nodiscard]] Vec3f fresnel_schlick(Vec3f f0, float cosine);

/// Reflectance at normal incidence of an index of refraction against air.
[[nodiscard]] constexpr float f0_from_ior(float ior) {
    const float r = (ior - 1.0f) / (ior + 1.0f);
    return r * r;
}

/// GGX lobe: D V F, without the cosine. `alpha` = roughness squared, > 0; all vectors unit, on
/// the side of `n`. Smith's masking, height-correlated (Heitz 2014). Zero below the horizon.
/// Reciprocal: swapping wi and wo gives the same value.
[[nodiscard]] Vec3f ggx(Vec3f f0, float alpha, Vec3f n, Vec3f wi, Vec3f wo);

/// Directional albedo of the lobe as f0 * scale + bias: what a white sky would be reflected as.
/// From a table that is integrated once; within .02 of the integral.
struct LobeAlbedo {
    float scale = 0, bias = 0;
    [[nodiscard]] Vec3f of(Vec3f f0) const { return {f0.x * scale + bias, f0.y * scale + bias, f0.z * scale + bias}; }
    /// Factor that gives back the light which single scattering loses on rough surfaces.
    /// Turquin, "Practical multiple scattering compensation" (2019).
    [[nodiscard]] Vec3f compensation(Vec3f f0) const;
};
[[nodiscard]] LobeAlbedo lobe_albedo(float roughness, float cosine);

} // namespace porthole
