// Apparent contours: from a complete id buffer, and as the paper follows them.
#pragma once

#include <cstdint>
#include <functional>
#include <span>
#include <vector>

#include "porthole/base/ids.h"

namespace porthole {

/// One border of one 8-connected component of target pixels.
struct Contour {
    std::vector<Vec2i> pixels; ///< in following order, absolute coordinates; a pixel may repeat on thin parts
    bool outer = true;         ///< false: the border of an enclosed (4-connected) background region
    bool closed = true;        ///< the paper's follower may end open
};

/// The apparent contour of all targets together: every target pixel with a 4-neighbour
/// outside all targets is on at least one chain, and no other pixel is. Beyond the window
/// counts as inside (the caller traces a margin), so the window's edge makes no contour.
/// Chains are in scan order of their first pixel, outer before inner.
/// Source: border following, Suzuki and Abe, CVGIP 30 (1985), algorithm 1.
/// Cost: linear in the window. Safe to call concurrently.
[[nodiscard]] std::vector<Contour> find_contours(const Image<PartId>& target_ids);

/// Contour pixels of `contours`, each once, in scan order.
[[nodiscard]] std::vector<Vec2i> contour_pixels(std::span<const Contour> contours);

/// Ids on demand: traces the given pixels (absolute) against the targets only.
using TraceIds = std::function<std::vector<PartId>(std::span<const Vec2i>)>;

struct PaperContours {
    std::vector<Contour> contours;  ///< one per departure, in the order they were found
    std::vector<PartId> ids;        ///< the id each contour belongs to
    std::int64_t step1_rays = 0, step2_rays = 0; ///< pixels traced, each pixel once
    Image<PartId> known; ///< every id traced so far; kNoPart also where nothing was traced
    Mask traced;         ///< 1 where `known` was traced
};

/// The paper's contour detection, steps 1 and 2, by the frozen readings of DESIGN 2.3:
/// 8x8 grid at (0,0), corners UL UR DL DR, four sub blocks down to 2x2, the first pixel of
/// each id in scan order of blocks is its departure; then the code direction technique with
/// neighbours 0=E 1=NE 2=N 3=NW 4=W 5=SW 6=S 7=SE.
/// Differs from the paper only where it is silent: rays are traced once per pixel, on demand.
[[nodiscard]] PaperContours find_contours_paper(const TraceIds& trace, Rect window);

} // namespace porthole
