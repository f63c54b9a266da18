// The slow way to see: one ray a pixel, every surface it crosses in order. It shares with the
// plan and the renderer the hierarchy, the camera and the definition of the cut, no more.
#pragma once

#include <cstdint>
#include <vector>

#include "porthole/plan.h"

namespace porthole {

/// How many pixels show something. Where two surfaces lie at one depth either may be seen:
/// then `least` and `most` differ.
struct DenseCount {
    std::int64_t least = 0, most = 0;
    friend bool operator==(const DenseCount&, const DenseCount&) = default;
};

/// One target, seen through everything.
struct DenseTarget {
    PartId part = kNoPart;
    Image<float> depth;               ///< of its nearest hit; +infinity: none. Covers its projected vertices
    bool thin = false;                ///< under 16 pixels: `depth` is the least over 4x4 samples of a pixel
    std::int64_t pixels_alone = 0;    ///< with a hit, inside the picture
    std::int64_t samples = 0;         ///< the same, or of a thin target its samples that hit
    std::int64_t among = 0;           ///< pixels of the picture where it is the nearest opened target
    bool among_tied = false;          ///< another target ties with it somewhere
    DenseCount before, after;         ///< of its samples those where it is seen, without and with the cut
    DenseCount after_among;           ///< of the pixels `among` those where it is seen with the cut
    [[nodiscard]] Mask alone() const; ///< where `depth` is finite
};

struct DenseView {
    std::vector<DenseTarget> targets; ///< in the order of Subject::targets
    IdBuffer nearest;                 ///< of the opened targets, over picture and margin
    Mask tied;                        ///< 1 where another opened target is as near
    Mask before, after;               ///< 1 where the picture shows the model, without and with the cut
    std::int64_t rays = 0, crossings = 0;
    std::int64_t tied_pixels = 0; ///< of the picture, where a target is seen or not as one likes
};

/// Looks at `plan.view` densely. Of `plan` it takes the view, picture and margin, which
/// targets are opened, and the cut.
/// Cost: a ray through all surfaces for every pixel of the picture, and one through each
/// target for every pixel around it (16 of thin ones). The same for any number of threads.
[[nodiscard]] DenseView look_densely(const Subject& subject, const ViewPlan& plan, const Control& control = {});

/// Intersection over union of two masks after each pixel was added that cannot reach the
/// edge of the picture over 4-neighbours outside its mask; 1 if both are empty.
[[nodiscard]] double dense_outline_iou(const Mask& before, const Mask& after);

} // namespace porthole
