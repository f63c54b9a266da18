// The values of a plan as pictures, to look at.
#pragma once

#include <string>
#include <vector>

#include "porthole/plan.h"
#include "porthole/render/render.h"

namespace porthole {

struct NamedPicture {
    std::string name; ///< file name without extension, such as "03-contour"
    Image<Rgba8> picture;
};

/// Every value of the plan, in the order in which it was made, drawn over its own window:
/// ids (a colour per part), depths (grey, near is light), masks (white), distances (blue
/// inside, orange outside, a line every ten pixels). With frames, also their ids.
/// @param inferred  Frame::inferred of the frame as it was drawn: drawn black, traced pixels white.
[[nodiscard]] std::vector<NamedPicture> debug_pictures(const ViewPlan& plan, const Frame* before = nullptr,
                                                       const Frame* after = nullptr, const Mask* inferred = nullptr);

} // namespace porthole
