// What the hole did to the picture, counted in pixels.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "porthole/base/cut.h"
#include "porthole/base/ids.h"
#include "porthole/hole/hole.h"

namespace porthole {

/// For each covered contour pixel c inside the picture, the share of the pixels within
/// `depth_px` of it, outside the targets and inside `opened`, where nothing cuttable nearer
/// than the floor depth at c (the target's own, on a target) remains. Same order as hole.band; -1 for uncovered pixels
/// and where there is no such pixel.
/// @param targets  ids and depths of the targets alone (the hole's window).
/// @param opened   ids and depths of the opened scene at pixel centres (the picture).
/// @param roles    by part id; fixed parts cannot be cut and do not count.
/// Cost: contour length times depth squared, vectorised.
[[nodiscard]] std::vector<float> ring_shares(const Hole& hole, const IdBuffer& targets, const IdBuffer& opened,
                                             std::span<const CutRole> roles, int depth_px);

/// Intersection over union of the two pictures' model masks (any part), background regions
/// that the model encloses counted as model. 1 when both are empty.
[[nodiscard]] double outline_iou(const Image<PartId>& before, const Image<PartId>& after);

/// #(W not in T or none, O != W) / #(W not in T or none); negative when that is 0 / 0.
/// @param is_target  by part id.
[[nodiscard]] double context_removed(const Image<PartId>& before, const Image<PartId>& after,
                                     std::span<const std::uint8_t> is_target);

} // namespace porthole
