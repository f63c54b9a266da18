// Where the outline of targets runs, by block closure: most of the background and of the targets'
// inside is inferred. Fast, and without a promise.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "porthole/trace/visibility.h"

namespace porthole {

/// Groups of marked blocks such that blocks of different groups never touch, each in the smallest
/// window that holds it, in scan order of their first blocks. One group, all of the mask, where
/// their windows would overlap too much to be worth it. Cost: linear in the blocks.
[[nodiscard]] std::vector<BlockMask> separate(const BlockMask& blocks);

/// The pixels of `window` that the blocks cover.
[[nodiscard]] Rect pixel_rect(const BlockMask& blocks, Rect window);

/// Ids of which only those near the outline were traced.
struct Outline {
    IdBuffer ids;       ///< in blocks of `inferred` the id of a pixel nearby, and no depth
    BlockMask inferred; ///< blocks not traced that are taken to be inside the targets
    std::int64_t rays = 0;
};

/// Follows the outline of all parts of `bvh` together through 4x4 blocks (the paper's
/// contour following, lifted from pixels to packets).
///
/// 1. One ray in each 8x8 block that the marked blocks touch, at its top left pixel. 2. Where the rays
///    at the four corners of an 8x8 block do not agree on inside and outside, its marked 4x4 blocks
///    are traced whole; where they agree on outside, those that hold a seed. 3. Where a pixel on the
///    side of a traced block does not agree with what is inferred for the marked block across, that
///    one is traced as well, and so on. A component of the outline that no ray, seed or neighbour
///    touches is missed; what is not marked is known to be outside.
///
/// @param seeds  pixels likely to be inside, from outline_seeds(); those outside are left out.
/// The same bits for any number of threads.
/// Source: compare Dandachy et al., steps 1 and 2, which follow pixels.
/// Cost: about ten rays a contour pixel.
[[nodiscard]] Outline trace_outline(const Bvh& bvh, const View& view, Rect window, const BlockMask& blocks,
                                    std::span<const Vec2i> seeds, const Control& control = {});

/// Traces the inferred blocks as well: then every id and depth is that of trace_ids(), but for
/// what of the targets the outline has missed.
void trace_inferred(Outline& outline, const Bvh& bvh, const View& view, const Control& control = {});

/// The pixels onto which some vertices of each part's mesh fall, if they lie before the eye.
[[nodiscard]] std::vector<Vec2i> outline_seeds(const Scene& scene, std::span<const PartId> parts, const View& view);

} // namespace porthole
