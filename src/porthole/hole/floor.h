// Smoothing of the floor depth over the band.
#pragma once

#include "porthole/base/ids.h"

namespace porthole {

/// `depth` with its pixels in `box` that are in `mask` and outside the targets replaced by the
/// mean over the mask's pixels in the square of 2 radius + 1 pixels around them, `times` over.
///
/// A pixel's result depends on nothing but the square's pixels, to the last bit, whatever the
/// window and the box. Cost: linear in the box grown by the radius.
[[nodiscard]] Image<float> blur_floor(Image<float> depth, const Mask& mask, const Image<PartId>& targets, Rect box,
                                      int radius, int times);

} // namespace porthole
