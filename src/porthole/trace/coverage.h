// Which pixels the targets cover, all together: most of them decided without a ray.
#pragma once

#include <cstdint>
#include <span>

#include "porthole/base/bits.h"
#include "porthole/trace/bvh.h"
#include "porthole/trace/clusters.h"

namespace porthole {

/// What is to become of pixels that scan conversion cannot decide.
enum class Doubt : std::uint8_t {
    trace, ///< a ray decides
    guess  ///< the triangles' edges decide, whatever rounding does; a ray only where no triangle can tell
};

/// The pixels that the targets cover.
struct Coverage {
    Bits hit;
    Rect window; ///< around the parts' boxes, one pixel more, within the window asked for: beyond it nothing is hit,
                 ///< and `hit` says nothing
};

/// The pixels of `window` where a ray hits one of the parts of `bvh`. With Doubt::trace they are those of
/// trace_ids(bvh, view, window).id != kNoPart, every one.
///
/// The parts' triangles are projected. A pixel's ray hits a triangle, and whatever the tracer rounds it
/// will find so, where the pixel's centre lies inside the projected triangle by more than a margin that
/// bounds all rounding, the tracer's and ours: a few thousandths of a pixel. It misses one from which
/// the centre is as far. What is left is traced, in the packets of trace_ids(): centres on an edge
/// where nothing else covers them, triangles seen edge-on, what reaches the eye's plane, primitives, materials
/// with holes, and parts of more triangles than their pixels are worth.
///
/// @param parts  those of `bvh`.
/// @param boxes  theirs, from cluster_boxes().
/// The same bits for any number of threads. Adds the rays traced to `rays`, if given.
/// Cost: 40 to 50 ns a triangle of clusters that larger parts do not cover whole, and one to ten rays a pixel of the
/// contour.
[[nodiscard]] Coverage cover(const Bvh& bvh, std::span<const PartId> parts, const ClusterBoxes& boxes, const View& view,
                             Rect window, Doubt doubt, const Control& control = {}, std::int64_t* rays = nullptr);

/// The blocks of `window` in which something is hit.
[[nodiscard]] BlockMask blocks_of(const Coverage& coverage, Rect window);

} // namespace porthole
