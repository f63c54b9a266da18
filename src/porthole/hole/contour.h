// Apparent contours: from a complete id buffer, and as the paper follows them.
#pragma once

#include <cstdint>
#include <functional>
#include <span>
#include <vector>

#include "porthole/base/bits.h"
#include "porthole/base/ids.h"

namespace porthole {

/// One border of one 8-connected component of target pixels, or a piece of one.
struct Contour {
    std::vector<Vec2i> pixels; ///< in following order, absolute coordinates; a pixel may repeat on thin parts
    bool outer = true;         ///< false: the border of an enclosed (4-connected) background region
    bool closed = true;        ///< false: cut by the window's edge, or the paper's follower ended open
};

/// The apparent contour of all targets together: every target pixel with a 4-neighbour
/// outside all targets is on at least one chain, and no other pixel is.
///
/// Beyond the window counts as inside a target (the caller traces a margin), so the window's
/// edge makes no contour: a border that runs into it ends there, as open pieces.
///
/// @return chains in scan order of the pixel at which a raster scan meets the border: of an
///         outer border its first pixel, of an inner one the pixel left of the region's first.
///         Closed chains start there; consecutive pixels are 8-neighbours, also the last and
///         the first. Seen on the picture, outer borders run counter-clockwise and inner ones
///         clockwise. The pieces of a cut border follow each other in that order.
/// Source: border following, Suzuki and Abe, CVGIP 30 (1985), algorithm 1.
/// Cost: linear in the window, about a millisecond per million pixels. Safe to call concurrently.
///
///   const std::vector<Contour> contours = find_contours(target_ids.id);
[[nodiscard]] std::vector<Contour> find_contours(const Image<PartId>& target_ids);

/// The same for `window` of the targets' pixels, which may have more around it.
[[nodiscard]] std::vector<Contour> find_contours(const Bits& targets, Rect window);

/// Contour pixels of `contours`, each once, in scan order.
[[nodiscard]] std::vector<Vec2i> contour_pixels(std::span<const Contour> contours);

/// Ids on demand: traces the given pixels (absolute, inside the window, none twice) against
/// the targets only and returns their ids in the same order.
using TraceIds = std::function<std::vector<PartId>(std::span<const Vec2i>)>;

struct PaperContours {
    std::vector<Contour> contours;               ///< one per departure, in the order they were found
    std::vector<PartId> ids;                     ///< the id each contour belongs to
    std::int64_t step1_rays = 0, step2_rays = 0; ///< pixels traced, each pixel once
    Image<PartId> known;                         ///< every id traced so far; kNoPart also where nothing was traced
    Mask traced;                                 ///< 1 where `known` was traced
};

/// The paper's contour detection, steps 1 and 2, by frozen readings.
///
/// Step 1: blocks of 8x8 pixels at multiples of 8, clamped to the window, in scan order. Ids
/// at the corners UL, UR, DL, DR; where they differ, four sub blocks (UL, UR, DL, DR), down to
/// 2x2. In the 2x2 blocks that differ, the first pixel of each id not seen before is that
/// id's departure. A target that no corner meets, or that fills whole blocks exactly, is missed.
///
/// Step 2: neighbours 0=E 1=NE 2=N 3=NW 4=W 5=SW 6=S 7=SE. From the current pixel C the next is
/// the first n_i, i = 0..7, not yet on the chain, with id(n_i) = id(C) and
/// id(n_{i-1}) != id(n_{i+1}). When there is none the chain is closed if it has at least three
/// pixels and its first is a neighbour of its last, else open.
///
/// Where the paper is silent: a pixel is traced once, when its id is first asked for; beyond
/// the window there is no part, and nothing is traced.
///
/// @param trace  called with many pixels at a time in step 1, with one in step 2.
/// @param window the picture's pixels.
[[nodiscard]] PaperContours find_contours_paper(const TraceIds& trace, Rect window);

} // namespace porthole
