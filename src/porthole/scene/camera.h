// From a model and the user's words to a View: named sides, F3D's camera options, the file's
// own cameras, and framing.
#pragma once

#include <optional>
#include <span>
#include <string>
#include <vector>

#include "porthole/base/parallel.h"
#include "porthole/base/view.h"
#include "porthole/scene/scene.h"

namespace porthole {

enum class Framing : std::uint8_t {
    automatic, ///< the whole model, tightened until the targets span 15 % of the picture's height
    all        ///< the whole model
};

/// How the user places the camera. Positions are in the model's coordinates, metres, y up,
/// before Scene::origin is taken off. Meanings follow F3D's options of the same names.
struct CameraParams {
    /// auto, front, back, left, right, top, bottom, iso, the name of a camera in the file, or
    /// #N for the file's camera N. `auto` means iso here; choosing is the planner's business.
    std::string name = "auto";
    std::optional<Vec3d> position{};    ///< of the eye; switches framing off
    std::optional<Vec3d> focal_point{}; ///< kept in the picture's centre
    std::optional<Vec3d> view_up{};
    std::optional<Vec3d> direction{}; ///< the way the camera looks
    double azimuth_deg = 0;           ///< the eye goes round the focal point, to the right
    double elevation_deg = 0;         ///< and up
    double zoom = 1;                  ///< > 0; 2 shows things twice as large
    double view_angle_deg = 30;       ///< vertical, (0, 180)
    bool orthographic = false;
    Framing frame = Framing::automatic;
};

/// Whether `params` leave the direction to the planner: name "auto" and neither position,
/// focal point nor direction given.
[[nodiscard]] bool is_auto(const CameraParams& params);

/// Points that stand for the hull of the model and of the targets when a picture is framed:
/// the extreme vertices along a fixed set of directions. Plain value, a few hundred points.
struct FrameSubject {
    std::vector<Vec3f> whole;   ///< of all parts; empty for an empty scene
    std::vector<Vec3f> targets; ///< of the targets; may be empty
};

/// The subject of pictures of `scene` in which `targets` should be seen. Does not depend on
/// the order of the parts. Cost: linear in the vertices, about 15 ns each, spread over the threads.
/// @throws Cancelled.
[[nodiscard]] FrameSubject frame_subject(const Scene& scene, std::span<const PartId> targets,
                                         const Control& control = {});

/// The view that `params` ask for.
/// @param width, height  pixels, at least 1.
/// @throws Error usage E0112 (no such camera: names those there are), E0113 (a value out of
///         range, or a camera of the file that cannot be used).
/// The view is finite and orthonormal for any finite subject.
[[nodiscard]] View make_view(const Scene& scene, const FrameSubject& subject, const CameraParams& params, int width,
                             int height);

/// The view from which the eye lies in direction `toward_eye` of the model (any length but
/// zero), y up, framed as params.frame asks: the whole subject with a border of 4.5 % where
/// it touches first; then, if automatic, the eye moves sideways and the angle narrows until
/// the targets span 15 % of the picture's height in width or height. The eye never comes
/// nearer, so it does not enter the model. Of `params`, azimuth, elevation, zoom, view_up,
/// view angle, orthographic and frame count.
[[nodiscard]] View view_from_direction(const FrameSubject& subject, Vec3f toward_eye, const CameraParams& params,
                                       int width, int height);

/// The eye's direction of a named side, unit length; empty for other names.
[[nodiscard]] std::optional<Vec3f> named_direction(std::string_view name);

/// What `--camera auto` tries: 64 directions on a Fibonacci spiral with elevations from -30
/// to 75 degrees, then front, back, left, right, top, bottom, iso. Unit vectors to the eye.
[[nodiscard]] std::vector<Vec3f> candidate_directions();

} // namespace porthole
