// The paper's selective refinement: which pixels are traced, and what the others are taken to
// show. Pixels only: rays are somebody else's.
#pragma once

#include <cstdint>
#include <functional>
#include <span>

#include "porthole/base/ids.h"
#include "porthole/render/render.h"

namespace porthole {

/// A picture of which only some pixels are traced. All images have one window.
struct PartialPicture {
    enum State : std::uint8_t { unknown, inferred, traced };
    static constexpr std::uint64_t kNothing = ~std::uint64_t{0};

    Image<std::uint64_t> surface; ///< pixels that see the same surface have the same number; kNothing: none
    Image<Vec4f> color;           ///< display-linear, premultiplied
    IdBuffer ids;
    Mask state;

    explicit PartialPicture(Rect window)
        : surface(window, kNothing), color(window, Vec4f{}), ids(window), state(window, unknown) {}
    [[nodiscard]] Rect window() const { return state.window(); }
};

/// Fills in surface, colour and ids of pixels of the window, each named once.
using TracePixels = std::function<void(PartialPicture& picture, std::span<const Vec2i> pixels)>;

/// Fills in a picture by `how`: paper1, paper2 or expansion. See docs/method.md.
///
/// Macro pixels lie at multiples of their size in absolute pixels and are clipped to the window.
/// Blocks of one size are decided together, so that every pixel is traced once, when it is first
/// asked for; what is traced stays as it was traced.
///
/// @param by      checked: see RefineParams.
/// @param wanted  blocks without a wanted pixel are left out, their pixels stay unknown; empty: all
///                are wanted.
/// The result depends on nothing but what `trace` fills in. One thread, but for `trace`.
/// Cost: linear in pixels, and in blocks for each size.
void infer_pixels(Refine how, const RefineParams& by, const Mask& wanted, PartialPicture& picture,
                  const TracePixels& trace);

} // namespace porthole
