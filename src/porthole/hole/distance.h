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
[[nodiscard]] Image<std::int64_t> distance_transform(const Mask& sites);

/// A disc: the pixels p with scale * |p - center|^2 <= weight.
struct PowerSite {
    Vec2i center;
    std::int64_t weight = 0;
};

struct PowerDistance {
    Image<std::int64_t> value;  ///< min over sites of scale * |p - c|^2 - weight; kFar if no sites
    Image<std::int32_t> nearest; ///< index of the site that attains it (the lowest such index); -1 if none
};

/// Power (weighted) distance transform, exact, in integers: the union of the sites' discs is
/// where value <= 0. Two sites on one pixel: the heavier counts. Cost: linear in the pixels.
[[nodiscard]] PowerDistance power_distance_transform(Rect window, std::span<const PowerSite> sites, std::int64_t scale);

} // namespace porthole
