// Steps of plan_view that its styles share. Not installed.
#pragma once

#include <algorithm>

#include "porthole/plan.h"

namespace porthole {

template <typename T> Image<T> cropped(const Image<T>& image, Rect window) {
    if (window == image.window()) return image;
    Image<T> out(window);
    for (int y = window.y0; y < window.y1; ++y) std::copy_n(&image(window.x0, y), window.width(), out.row(y));
    return out;
}

inline IdBuffer cropped(const IdBuffer& ids, Rect window) {
    IdBuffer out;
    out.id = cropped(ids.id, window);
    out.depth = cropped(ids.depth, window);
    return out;
}

/// E on `window`, a part of `whole`, the picture and its margin.
/// @param cut_set  hierarchy of `parts`.
/// @param plain    ids of all parts in the picture; may be null.
/// Cost: one occlusion ray a pixel of `window` that the parts' boxes touch, and beyond it those that lie
/// on the way of the background to the edge of `whole`.
[[nodiscard]] Mask enclosing_object(const Scene& scene, std::span<const PartId> parts, const Bvh& cut_set,
                                    const View& view, Rect window, Rect whole, const Control& control,
                                    std::int64_t& rays, const IdBuffer* plain);

/// Width in pixels of a length that users give. Not below 0.
[[nodiscard]] double length_px(const Subject& subject, const View& view, Length length);

/// How far around the picture style cutaway needs what: E, occluders and hole, and the targets.
struct CutawayMargins {
    int hole = 0, targets = 0;
};
[[nodiscard]] CutawayMargins cutaway_margins(const View& view, const PlanParams& params, const HoleParams& band);

/// Closing radius that style cutaway tries first.
[[nodiscard]] int closing_radius_px(const View& view);

/// Sorts the cut set into levels that open one step after the other: fills plan.cut.level (left
/// empty where there is only one).
///
/// A layer is a part within which the floor lies over most of the core, as within skin, skull
/// and brain. Every other part belongs to the innermost layer that is mostly in front of it.
/// @param plan  with cut set, core and hole.
/// @return how many levels, 1 to 4.
/// Cost: some 2000 rays along their whole length.
[[nodiscard]] std::size_t find_levels(const Subject& subject, const Bvh& cut_bvh, ViewPlan& plan,
                                      const Control& control);

/// The rest of a plan of style cutaway once the targets are known: cut set, core, hole, cut.
/// @param ids    the opened targets in the window that the closing needs, which holds plan.window;
///               plan.target_ids, contours and spans are made.
/// @param most   with the widest band; around targets that are thin lines it is 3 % of the picture's
///               height, unless the user asked for a width.
/// @param plain  ids of all parts in the picture; may be null.
/// @param around where the enclosing object can matter; a part of plan.whole.
void plan_cutaway(const Subject& subject, const PlanParams& params, const HoleParams& most, Rect around,
                  const IdBuffer& ids, const IdBuffer* plain, ViewPlan& plan, const Control& control);

} // namespace porthole
