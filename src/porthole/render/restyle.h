// What is neither target nor cut: kept as it is, or stepping back behind what is.
#pragma once

#include <vector>

#include "porthole/render/render.h"

namespace porthole {

enum class Rest : std::uint8_t {
    keep,
    dim,  ///< paler and greyer
    line, ///< its outlines and creases alone, on the background
    ghost ///< a thin shell, see lay_shell()
};

/// What drew a picture: enough to ask again what a sample of it sees.
struct Drawn {
    const Bvh& bvh;
    const Bvh* targets = nullptr;
    const Cut* cut = nullptr;
    const Caps* caps = nullptr;
    const View& view;
    const RenderParams& params;
};

/// Restyles the pixels of `frame` that see parts with a 1 in `rest` (by part id), by as much of each
/// pixel as sees them: Rest::dim has saturation x .55 and goes 25 % towards (.72, .72, .74); Rest::line
/// has the background there and the lines of those parts. Ids stay.
/// @throws Error limit E0902; Cancelled. The same bits for any number of threads.
/// Cost: a ray a pixel, samples where `rest` begins.
void restyle(Frame& frame, const Drawn& drawn, const std::vector<std::uint8_t>& rest, Rest style,
             const Control& control = {});

/// Lays the parts of `shell` over a picture of everything else, thin: a veil in their own pale
/// colour that is clear where they face the eye and dense where they turn away, and their
/// outlines, steps and creases (none with Lines::none). Along a ray the first surface of the
/// first part is drawn, that of the second one weaker, both only in front of what `frame` shows. Pixels that show a
/// target are left as they are; what the shell alone covers gets its ids.
/// @param frame  the picture without those parts, as `drawn`.
/// @throws Error limit E0902; Cancelled. The same bits for any number of threads.
/// Cost: some four rays a pixel, samples at the shell's edges.
void lay_shell(Frame& frame, const Drawn& drawn, const Bvh& shell, const Control& control = {});

} // namespace porthole
