// How deep the hole goes beside the targets: the floor depth over the band.
#pragma once

#include <cstdint>
#include <vector>

#include "porthole/base/ids.h"

namespace porthole {

/// The pixels p with scale * |p - center|^2 <= weight, as deep as a target at the centre.
struct FloorDisc {
    Vec2i center;
    std::int64_t weight = 0;
    float depth = 0; ///< metres along camera -z
};

/// `depth` with, at every pixel of `box` outside the targets, the greatest depth of the discs
/// that cover it; unchanged elsewhere.
/// Cost: linear in the box plus, for each disc, its height: every pixel is painted once.
[[nodiscard]] Image<float> paint_floor(Image<float> depth, const Image<PartId>& targets, std::vector<FloorDisc> discs,
                                       std::int64_t scale, Rect box);

/// `depth` with its pixels in `box` that are in `mask` and outside the targets replaced by the
/// mean over the mask's pixels in the square of 2 radius + 1 pixels around them, `times` over.
///
/// A pixel's result depends on nothing but the square's pixels, to the last bit, whatever the
/// window and the box. Cost: linear in the box grown by the radius.
[[nodiscard]] Image<float> blur_floor(Image<float> depth, const Mask& mask, const Image<PartId>& targets, Rect box,
                                      int radius, int times);

} // namespace porthole
