// Choosing the view: the best plan over candidate directions.
#pragma once

#include "porthole/plan.h"
#include "porthole/scene/camera.h"

namespace porthole {

/// What a view is worth, and from what.
struct ViewScore {
    double visible = 0;             ///< V: mean over targets of the share that is seen through the hole
    std::int64_t target_pixels = 0; ///< A
    double ring = 1;                ///< R: mean ring, 1 if nothing is covered
    double context_removed = 0;
    double entropy = 0;   ///< H: entropy of the parts' shares of the picture over ln(parts)
    double pose = 1;      ///< U: how one likes to look at a thing, see pose_of
    bool refused = false; ///< some target is refused or absent

    /// V^4 sqrt(A/A_max) (0.1 + R) sqrt(1 - context_removed) (0.5 + 0.5 H) U.
    /// Differs from DESIGN 2.5 in V^4 for V, so that a view in which one target hides another
    /// loses, and in U.
    [[nodiscard]] double value(std::int64_t largest_area) const;
};

/// How one likes to look at a thing from `toward_eye` (unit length): 1 from 5 to 50 degrees
/// above the horizon, 0.75 at the horizon, 0.5 below it, down to 0.25 straight from above; times
/// 0.85 from behind, and times 0.7 along an axis of the model, rising to 1 for three-quarter views, which show three
/// sides.
[[nodiscard]] double pose_of(Vec3f toward_eye);

/// @param ids  plain id buffer of the same view.
[[nodiscard]] ViewScore score_view(const Subject& subject, const ViewPlan& plan, const IdBuffer& ids);

/// The direction towards the eye that `--camera auto` settles on: all candidate directions at
/// 256 px width (of style cutaway with the straight walls of `hole`), the best five again at 512 px; ties by lowest
/// index; views that refuse a target come last. Differs from DESIGN 2.5: the second round is at 512 px, not at full
/// size, which costs five full frames of rays (docs/decisions). Candidates that cannot come among the best any more,
/// whatever their plan, are not planned. The same for any number of threads. Cost: the targets alone in 71 small
/// pictures, all parts in about half of them, and ten to twenty small plans, spread over the threads.
[[nodiscard]] Vec3f best_direction(const Subject& subject, const FrameSubject& frame, const CameraParams& camera,
                                   int width, int height, const PlanParams& params, const Control& control = {});

} // namespace porthole
