// Smoothing of the hole's maps.
#pragma once

#include <span>

#include "porthole/base/ids.h"

namespace porthole {

/// `depth` with its pixels in `box` that are in `mask` and outside the targets replaced by the
/// mean over the mask's pixels in the square of 2 radius + 1 pixels around them, `times` over.
///
/// A pixel's result depends on nothing but the square's pixels, to the last bit, whatever the
/// window and the box. Cost: linear in the box grown by the radius.
[[nodiscard]] Image<float> blur_floor(Image<float> depth, const Mask& mask, const Image<PartId>& targets, Rect box,
                                      int radius, int times);

/// Each of `maps` in `box` as the mean of its values at the pixels of `known` (!= 0) within
/// 2 radius pixels, weighted by two passes of a square of 2 radius + 1 pixels (a tent);
/// +infinity where there is none. Outside `box` maps keep what they hold.
///
/// A pixel's result depends on nothing but those pixels, to the last bit, whatever the window
/// and the box. Cost: linear in the box grown by twice the radius.
/// @param maps  same window as `known`.
void smooth_over(std::span<Image<float>> maps, const Mask& known, Rect box, int radius);

} // namespace porthole
