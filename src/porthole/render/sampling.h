// Fixed sample patterns. Nothing here is random: a pixel's pattern follows from its
// coordinates, so that pictures do not depend on threads and neighbours complement each other.
#pragma once

#include <cstdint>
#include <vector>

#include "porthole/base/math.h"

namespace porthole {

/// Pixels share their secondary rays in cells of 4x4: each pixel traces its own part of the
/// pattern, and a filter over the cell sees all of it (interleaved sampling, Keller and
/// Heidrich 2001).
inline constexpr int kCell = 4;
inline constexpr int kCellPixels = kCell * kCell;

/// Rank of pixel (x, y) within its cell, 0..15, in the order of Bayer's ordered-dither matrix:
/// ranks that follow each other lie far apart.
[[nodiscard]] int cell_rank(int x, int y);

/// Position of sample `i` of any pixel in [0,1)^2; sample 0 is the centre. Nested: the first 4
/// are part of the first 8 and so on, and the first 4, 8, 16, 32 and 64 each measure what an edge
/// covers of the pixel as well as points found by descent do, within .10, .06, .034, .020 and .012 (root
/// mean square). After 64 the R2 sequence (Roberts 2018) goes on.
[[nodiscard]] Vec2f pixel_sample(int i);

/// Point `i` of `n` in the unit disc, evenly spread (Vogel's spiral); i < n.
[[nodiscard]] Vec2f disc_point(int i, int n);

/// One direction for ambient occlusion, meant with both signs: the one on the surface's side
/// is traced. Its contribution is weighted with the cosine, which is zero where it changes
/// sides, so no seam shows.
struct AmbientRay {
    Vec3f axis;  ///< unit
    float reach; ///< share of the ambient radius that this ray looks, (0, 1]
};

/// Directions for `per_pixel` rays in each of the 16 pixels of a cell: ray j of rank r is
/// element j * 16 + r. All of them together are evenly spread over the sphere.
[[nodiscard]] std::vector<AmbientRay> ambient_pattern(int per_pixel);

} // namespace porthole
