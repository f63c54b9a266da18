// The colour of one point, given what light reaches it.
#pragma once

#include "porthole/render/lighting.h"
#include "porthole/render/surface.h"

namespace porthole {

/// How much light reaches a point, from its shadow and ambient rays.
struct Reach {
    Vec3f lamps{1, 1, 1}; ///< share of the lamps' light, per channel (coloured shadows)
    float ambient = 1;    ///< 1: nothing near; 0: closed in
};

struct Shaded {
    Vec3f light;  ///< scene-linear: may pass 1, goes through the shoulder
    Vec3f shown;  ///< already what the screen shows: unlit materials and flat shading
    Vec3f mirror; ///< reflectance for a traced reflection; what it would bring is not in `light`
};

/// Lambert and GGX under lamps, fill and sky; the multiples of albedo that Lighting states.
/// @param to_eye         unit, back along the ray.
/// @param trace_mirrors  leave sharp, strong reflections to the caller (Shaded::mirror).
[[nodiscard]] Shaded shade(const Lighting& lighting, const SurfacePoint& point, Vec3f normal, Vec3f to_eye,
                           const Substance& substance, const Reach& reach, bool trace_mirrors);

/// Base colour times facing, without any light: the paper's "full mode".
[[nodiscard]] Vec3f shade_flat(const Substance& substance, Vec3f normal, Vec3f to_eye);

/// Scene-linear light to display-linear [0, 1): the identity up to .7, then a soft shoulder.
/// Per channel, increasing, smooth in the first derivative.
[[nodiscard]] Vec3f shoulder(Vec3f light);

/// A lamp's unshadowed light on a matte surface; weight of its shadow rays.
[[nodiscard]] inline float lamp_weight(const Incident& in, Vec3f normal) {
    return (0.2126f * in.strength.x + 0.7152f * in.strength.y + 0.0722f * in.strength.z) *
           std::max(0.0f, dot(normal, in.direction));
}

} // namespace porthole
