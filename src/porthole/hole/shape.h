// The core of the hole: the targets' pixels, made into one readable window.
#pragma once

#include <cstdint>

#include "porthole/base/ids.h"

namespace porthole {

/// Outline of the hole's core M, from which the band grows.
enum class HoleShape : std::uint8_t {
    silhouette, ///< the targets' own pixels T
    smooth,     ///< T closed: gaps narrower than the closing radius are filled, notches rounded
    hull,       ///< convex hull of each group of targets
    box         ///< bounding rectangle of each group
};

/// `mask` (!= 0) dilated and then eroded by the disc of `radius_px` pixels: the pixels that no
/// such disc free of mask pixels covers. Values 0 and 1; beyond the window there is nothing.
/// A pixel's result depends on the pixels within twice the radius only.
/// @param radius_px  [0, 16384]
/// Cost: linear in the box of the mask grown by the radius, whatever the radius.
[[nodiscard]] Mask closed_mask(const Mask& mask, int radius_px);

/// Number of the 8-connected component of `mask` (!= 0) at each pixel, from 0 in scan order of
/// their first pixels; -1 outside.
struct Components {
    Image<std::int32_t> label;
    std::int32_t count = 0;
};
[[nodiscard]] Components connected_components(const Mask& mask);

/// Pixels whose centres lie in the convex hull of the centres of the mask's pixels, or in their
/// bounding rectangle; of each group by itself. `groups`: of connected_components, covering `mask`.
/// Cost: linear in the window, times the groups where their hulls overlap.
[[nodiscard]] Mask hull_mask(const Mask& mask, const Components& groups);
[[nodiscard]] Mask box_mask(const Mask& mask, const Components& groups);

/// Where the core holds pixels of no target: which target pixel is nearest.
///
/// @param targets  ids and depths of the targets alone.
/// @param core     1 on a superset of the targets' pixels; same window.
/// @return ids and depths of `targets`, and at the other pixels of the core those of the nearest
///         target pixel (the leftmost, then the topmost of several).
/// Cost: linear in the box of the core.
[[nodiscard]] IdBuffer fill_core(const IdBuffer& targets, const Mask& core);

} // namespace porthole
