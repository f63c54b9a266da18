// Crumbs: slivers of cut parts that a cut leaves floating in the hole.
#pragma once

#include "porthole/plan.h"
#include "porthole/trace/caps.h"

namespace porthole {

/// Area in pixels below which a piece can be a crumb: the square of 5 px or 1.1 % of the picture's
/// height, the greater.
[[nodiscard]] float crumb_area_px(const View& view);

/// Takes crumbs out of the plan's cut and traces the caps of what is left: `plan.cut` goes
/// behind each of them, `plan.crumbs` counts them.
///
/// A piece is what the picture shows, at pixel centres, of one part of the cut set; pixels of it no
/// more than two apart belong together. It is a crumb if
///  - it is smaller than crumb_area_px(),
///  - it lies more than two pixels inside the rim and inside the picture,
///  - it stands on nothing: at over half of the pixels beside it one sees past its far side, which is
///    the last of the part's surfaces that follow one another by less than the crumb's side.
/// It goes as a whole, or stays as a whole: where behind a pixel of it there is nothing to see, or
/// a target within two pixels is nearer than its far side. What comes to light is looked at
/// once more; crumbs that are there then stay and are counted as kept.
///
/// @param plan     after plan_caps(), of styles cutaway and hole. Nothing happens to an empty cut.
/// @param opened   every part, with roles and levels of plan.cut.
/// @param targets  the opened targets.
/// @return the caps of the cut as it is then; they need plan.solids alive.
/// Cost: trace_caps() and one more look at the pixels of the hole; both again if there are crumbs.
/// The same bits for any number of threads.
/// @throws Cancelled.
[[nodiscard]] Caps remove_crumbs(const Subject& subject, ViewPlan& plan, const Bvh& opened, const Bvh& targets,
                                 const Control& control = {});

} // namespace porthole
