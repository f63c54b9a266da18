// Where the light comes from: the file's lights or the default rig, sky and camera fill, and
// how far ambient occlusion looks.
#pragma once

#include <span>
#include <vector>

#include "porthole/base/view.h"
#include "porthole/scene/scene.h"

namespace porthole {

/// A lamp. Strengths are multiples of albedo: a white matte surface that faces a lamp of
/// strength 1 has brightness 1.
struct Lamp {
    Light::Kind kind = Light::Kind::directional;
    Vec3f strength{0, 0, 0}; ///< directional: of albedo; others: at 1 m
    Vec3f position;          ///< world; point and spot
    Vec3f direction;         ///< unit, the way the light travels; directional and spot
    float size = 0;          ///< radius of the disc that casts the shadow: at 1 m (directional) or metres
    float range = kInfinity;
    float cos_inner = 1, cos_outer = -1;
};

/// Light of one lamp at one point.
struct Incident {
    Vec3f direction; ///< unit, towards the lamp
    Vec3f strength{0, 0, 0};
    float distance = kInfinity;
};
[[nodiscard]] Incident incident(const Lamp& lamp, Vec3f point);

/// All light of a picture. Depends on the scene and, in the default rig, on the view.
struct Lighting {
    std::vector<Lamp> lamps;
    Vec3f fill{0.35f, 0.35f, 0.35f}; ///< from the eye, casts no shadow
    Vec3f eye;                       ///< where the fill comes from
    Vec3f to_eye{0, 0, 1};           ///< orthographic views: its direction
    bool orthographic = false;
    float ambient = 0.42f;       ///< strength of the hemisphere and of its mirror image
    float ambient_shadow = 0.7f; ///< how much full occlusion takes off the ambient light
    float fill_shadow = 0.42f;   ///< and off the fill
    float plain_radius = 1;      ///< reach of ambient occlusion, metres
    float hole_radius = 1;       ///< the same inside the hole

    [[nodiscard]] Vec3f to_fill(Vec3f point) const { return orthographic ? to_eye : normalize(eye - point, to_eye); }
};

/// The light for `view` of `scene`.
///
/// Without lights in the file: a key from the upper left of the camera, soft. With lights:
/// those replace the key, scaled together so that the parts get as much of them on average as
/// the key would give; ambient light and fill stay, so that every model is legible. Of more
/// than 16 lights the strongest are taken.
/// Ambient occlusion reaches a quarter of the largest target's radius inside the hole, within
/// 2 to 25 % of the scene's; 12 % elsewhere.
/// @param targets  parts that are opened; may be empty.
[[nodiscard]] Lighting make_lighting(const Scene& scene, const View& view, std::span<const PartId> targets);

/// Irradiance from the sky on a surface with normal `n` (unit), as a multiple of albedo at
/// ambient strength 1. World y is up.
[[nodiscard]] Vec3f sky_irradiance(Vec3f n);

/// The sky as a mirror of this roughness sees it in direction `d` (unit): light above, a
/// horizon, darker ground, smoother with roughness. Never black.
[[nodiscard]] Vec3f sky_radiance(Vec3f d, float roughness);

} // namespace porthole
