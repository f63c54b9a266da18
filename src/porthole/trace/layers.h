// What lies one behind the other along the rays of pixels: the walls of the cut set, who
// encloses whom, what a cut takes away and leaves. The same bits for any number of threads
// and any window.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "porthole/base/cut.h"
#include "porthole/trace/bvh.h"

namespace porthole {

/// Of one level of parts at each pixel the depth of its first surface, and that of the next
/// surface behind it, of any level. +infinity where there is none before `until`.
struct LayerDepths {
    Image<float> first, next;
};

/// @param bvh       the cut set.
/// @param where     pixels that are asked (!= 0).
/// @param until     only what is nearer counts; same window.
/// @param level     by part id; empty: all 0.
/// @param levels    how many there are.
/// @param tolerance surfaces that lie closer together, metres (or 8 ulp), are one.
/// Cost: one occlusion ray a pixel that passes every surface in front of `until`.
[[nodiscard]] std::vector<LayerDepths> trace_layers(const Bvh& bvh, const View& view, const Mask& where,
                                                    const Image<float>& until, std::span<const std::uint8_t> level,
                                                    std::size_t levels, float tolerance, const Control& control = {},
                                                    std::int64_t* rays = nullptr);

/// First and last surface of a part on one ray.
struct PartExtent {
    PartId part = kNoPart;
    float first = 0, last = 0; ///< depths
};

/// What of `bvh` lies on the rays through the centres of `pixels`, per pixel by increasing part
/// id, along the whole ray.
[[nodiscard]] std::vector<std::vector<PartExtent>> trace_extents(const Bvh& bvh, const View& view,
                                                                 std::span<const Vec2i> pixels,
                                                                 const Control& control = {},
                                                                 std::int64_t* rays = nullptr);

/// What `cut` takes away and leaves at the centres of the pixels of `where` (!= 0).
struct CutEffect {
    Image<float> farthest;              ///< farthest surface of the cut set that is gone; -infinity: none
    Image<std::uint8_t> farthest_level; ///< its level
    Mask left;                          ///< 1 where something remains to be seen, or nothing was taken away
};

/// @param cut_set  BVH of the parts of the cut set.
/// @param whole    BVH of every part. Of loose parts what is nearer than `farthest` counts as gone.
/// Cost: two occlusion rays a pixel, a third where at first nothing seems to be left.
[[nodiscard]] CutEffect trace_cut_effect(const Bvh& cut_set, const Bvh& whole, const Cut& cut, const Mask& where,
                                         const Control& control = {}, std::int64_t* rays = nullptr);

} // namespace porthole
