// Exact Euclidean and power distance transforms on pixel grids, linear time.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "porthole/base/image.h"

namespace porthole {

inline constexpr std::int64_t kFar = std::int64_t(1) << 60; ///< squared distance where no site exists

/// Squared Euclidean distance from every pixel of the window to the nearest pixel with
/// `sites` != 0; kFar everywhere if there is none.
/// Source: Felzenszwalb and Huttenlocher, Theory of Computing 8 (2012), in integers.
/// Cost: linear in the window.
[[nodiscard]] Image<std::int64_t> distance_transform(const Mask& sites);

/// The same at some pixels only: squared distance from each of `queries` (inside the window)
/// to the nearest pixel with `sites` != 0, kFar if there is none.
/// Cost: reads the window once; beyond that, linear in the rows that hold queries.
[[nodiscard]] std::vector<std::int64_t> squared_distances(const Mask& sites, std::span<const Vec2i> queries);

/// Signed distance in pixels to the border of `mask`, which runs midway between the centres
/// of inside and outside pixels: <= -0.5 where mask != 0, >= 0.5 elsewhere. Where the mask has
/// no border, +-kNoBorder. Cost: linear in the window.
[[nodiscard]] Image<float> signed_distance(const Mask& mask);
inline constexpr float kNoBorder = 1e6f;

/// A disc: the pixels p with scale * |p - center|^2 <= weight.
struct PowerSite {
    Vec2i center;
    std::int64_t weight = 0;
};

struct PowerDistance {
    Image<std::int64_t> value;   ///< min over sites of scale * |p - c|^2 - weight; kFar beyond the limit
    Image<std::int32_t> nearest; ///< index of the site that attains it; -1 beyond the limit
};

/// Power (weighted) distance transform, exact, in integers: the union of the sites' discs is
/// where value <= 0.
///
/// When several sites attain the value, the one with the smallest x is `nearest`, then the
/// smallest y, then (two sites on one pixel) the smallest index. The same rule whatever the
/// window and the order of the sites.
///
/// @param sites  centres inside the window; |weight| < 2^50.
/// @param scale  > 0; scale * (width^2 + height^2) < 2^50.
/// @param limit  values above it are not wanted and read kFar: distant pixels cost less.
/// Cost: linear in the pixels.
[[nodiscard]] PowerDistance power_distance_transform(Rect window, std::span<const PowerSite> sites, std::int64_t scale,
                                                     std::int64_t limit = kFar - 1);

/// Greatest integer whose square is at most n (>= 0, < 2^52).
[[nodiscard]] std::int64_t integer_sqrt(std::int64_t n);

} // namespace porthole
