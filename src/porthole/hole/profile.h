// How the hole's rim is cut: a chamfer that shows how thick the first wall is, then straight
// walls; one step after the other where layers enclose one another.
#pragma once

#include <optional>
#include <span>
#include <vector>

#include "porthole/base/cut.h"
#include "porthole/hole/hole.h"

namespace porthole {

struct RimParams {
    int blur_px = 32;              ///< radius in which fronts, thicknesses and widths are smoothed, [0, 4096]
    float least_px = 11.9f;        ///< a chamfer's least width, of what half its step has room for
    std::optional<float> bevel_px; ///< fixed width of the chamfer; 0: straight walls
    std::optional<float> angle;    ///< between wall and ray, radians: the chamfer fills the step
};

/// hole.distance with its inside made even: in the band and the core it is minus the distance to
/// the rim itself rather than to the circle of one disc, so that steps along the rim are as
/// smooth as the rim where the band's width changes. Within a pixel of the rim, and outside, it
/// is hole.distance.
/// Cost: a distance transform of the hole's box.
[[nodiscard]] Image<float> rim_distance(const Hole& hole);

/// First wall of one level at the pixels of the hole.
struct Wall {
    Image<float> front; ///< depth of its first surface, metres; +infinity where there is none before the floor
    Image<float> next;  ///< depth of the next surface behind, or of the floor
};

/// The cut over `hole`: floor depth hole.floor_depth, and around it one step a wall, outermost
/// first. With n walls and a band of local width b, step k starts k b / n inside the rim, as
/// hole.distance measures it (rim_distance). Its
/// chamfer begins at the wall's front and is
///     w = clamp(1.1 h / pixel size, min(least_px, s / 2), 0.6 s) pixels wide,  s = b / n,
/// over which it sinks by 1.1 h, the wall's thickness and a little more, but never below the
/// floor. Front, h and b are smoothed over the hole (smooth_over). A band narrower than asked
/// for has narrow steps. Targets' and the core's pixels are always cut to the floor.
///
/// @param core   ids of the core's pixels; the cut is at the floor there.
/// @param walls  windows as the hole's; at least one.
/// @return one level a wall; floor -infinity outside the hole.
/// Cost: some passes over the box of the hole.
[[nodiscard]] std::vector<CutLevel> rim_levels(const Hole& hole, const Image<PartId>& core, const View& view,
                                               std::span<const Wall> walls, const RimParams& params = {});

} // namespace porthole
