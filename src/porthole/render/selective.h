// Pictures by the paper's selective refinement: the rules of macro_pixels.h, traced.
#pragma once

#include "porthole/render/picture.h"

namespace porthole {

/// The macro pixels that meet `window`, inside the picture.
[[nodiscard]] Rect whole_macro_pixels(Rect window, const RefineParams& by, const View& view);

/// Says in `picture` which first samples are traced whatever the refinement says.
///
/// In a hole all of them, and those around that the targets' tints and the rim's line look at, so
/// that ids and metrics there are those of every other picture; the same where the plain picture
/// will be cut.
/// @param cut       of the picture; null: it is the plain one.
/// @param covering  of the plain picture: the hole that will be drawn over it; may be null.
/// @param targets   whether parts are to be emphasised in the plain picture.
void mark_known(Picture& picture, const Cut* cut, const Cut* covering, bool targets);

/// Pass 1 of the paper's refinement: camera rays through the marked pixels' centres.
void look_tile(Picture& picture, const std::vector<Placement>& placements, Rect tile);

/// Passes 2 to 4: decides which pixels are traced, traces and shades them with one sample each, and
/// infers the others. A pixel in the hole whose key is not the one inferred is shaded all the same:
/// what the ids say is seen is drawn.
/// The same bits for any number of threads. Cost: for each pixel shaded a camera ray and up to 16
/// shadow and ambient rays.
void draw_selectively(Picture& picture, const Stage& stage, const Control& control);

} // namespace porthole
