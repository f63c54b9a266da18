// Smoothing of the hole's maps.
#pragma once

#include <cstdint>

#include "porthole/base/ids.h"

namespace porthole {

/// `depth` with its pixels in `box` that are in `mask` and outside the targets replaced by the
/// mean over the mask's pixels in the square of 2 radius + 1 pixels around them, `times` over.
///
/// A pixel's result depends on nothing but the square's pixels, to the last bit, whatever the
/// window and the box. Cost: linear in the box grown by the radius.
[[nodiscard]] Image<float> blur_floor(Image<float> depth, const Mask& mask, const Image<PartId>& targets, Rect box,
                                      int radius, int times);

enum class Fit : std::uint8_t {
    mean, ///< of the values around
    plane ///< least squares: a map that rises evenly stays as it is, also at the edge of what is known
};

/// `map` in `box` fitted to its values at the pixels of `known` (!= 0) within some 2 radius
/// pixels, weighted by two passes of a square of 2 radius + 1 pixels (a tent); +infinity where
/// there is none. Outside `box` the map keeps what it holds.
///
/// Fitted at the centres of cells of 1, 2 or 4 pixels, at multiples of that in absolute pixels,
/// and interpolated between them. A pixel's result depends on nothing but the pixels within
/// 2 radius + 8, to the last bit, whatever the window and the box.
/// @param map     window as that of `known`.
/// @param radius  [0, 4096]
/// Cost: linear in the box grown by twice the radius, and little beyond reading it.
void smooth_over(Image<float>& map, const Mask& known, Rect box, int radius, Fit fit);

} // namespace porthole
