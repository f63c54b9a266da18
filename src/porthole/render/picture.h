// The passes of one picture, tile by tile. Each pass reads what earlier ones wrote, and a tile
// writes only its own pixels, so the result does not depend on the order of tiles.
#pragma once

#include <atomic>
#include <optional>

#include "porthole/render/filter.h"
#include "porthole/render/gbuffer.h"
#include "porthole/render/paths.h"

namespace porthole {

/// RayCounts that many threads add to. Integers: the sum does not depend on the order.
class RayTotals {
public:
    void add(const RayCounts& rays);
    void set(const RayCounts& rays);
    [[nodiscard]] RayCounts get() const;

private:
    std::atomic<std::int64_t> primary_{0}, shadow_{0}, ambient_{0}, reflection_{0}, refraction_{0};
};

/// One picture on its way.
struct Picture {
    const View& view;
    const RenderParams& params;
    const Camera& camera;
    GBuffer buffer;
    Image<Vec4f> color;      ///< display-linear, premultiplied; the buffer's window
    Mask edges;              ///< not 0 where the first sample is not enough: see find_edges()
    bool everything = false; ///< every pixel is wanted, but for those covered
    Mask covered;            ///< 1 where only the ids are wanted; empty: nowhere
    Mask opened;             ///< with a cut: 1 where some sample is in the hole
    Mask known;              ///< of the paper's refinement: 1 where the first sample is traced, whether shaded or not
    Mask inferred;           ///< 1 where the ids were not traced; empty: nowhere
    RayTotals rays;

    Picture(const View& seen, const RenderParams& how, const Camera& by, Rect window)
        : view(seen), params(how), camera(by), buffer(window), color(window, Vec4f{}), edges(window), opened(window) {}
};

/// Says what is to be traced in the plain picture: everything. Of pixels that `cut`, if there
/// is one, opens so far around that their light and edges are of no use to others, only the ids.
void mark_everything(Picture& picture, const Cut* cut = nullptr);

/// Marks the pixels that can have samples in the hole, those that the rim may cross, and a
/// few around, whose light the filter and the rim's samples need.
void mark_hole(Picture& picture, const Cut& cut);

/// Pixels that mark_hole() would mark, rounded out to blocks, inside the picture.
[[nodiscard]] Rect hole_window(const Cut& cut, const View& view);

/// Camera rays of blocks of 4x4 pixels (pixel / 4), and, if their light is wanted, shadow and ambient
/// rays. Fastest when blocks that follow each other lie close.
void gather_blocks(Picture& picture, const Occlusion& occlusion, const std::vector<Placement>& placements,
                   std::span<const Vec2i> blocks, bool light);

/// Writes what lane `lane` of `seen` saw at pixel (x, y) of the buffer.
/// @return the point; nothing where nothing is hit or only the ids are wanted.
std::optional<SurfacePoint> record(Picture& picture, const std::vector<Placement>& placements, const Samples16& samples,
                                   const Seen16& seen, int lane, int x, int y);

/// Whether the hole covers a pixel centre at most `reach` pixels away in x and y.
[[nodiscard]] bool near_hole(const Cut& cut, int x, int y, int reach);

/// Pass 1: camera rays through the pixel centres, their shadow and ambient rays.
/// @param but  1 for blocks that are traced already; null: none is.
void gather_tile(Picture& picture, const Occlusion& occlusion, const std::vector<Placement>& placements, Rect tile,
                 const Mask* but = nullptr);

/// What Frame::inside says of a pixel.
[[nodiscard]] inline std::uint8_t inside_of(const Pixel& pixel) {
    return pixel.has(Pixel::cap)         ? std::uint8_t(Frame::cap)
           : pixel.has(Pixel::open_back) ? std::uint8_t(Frame::open_back)
                                         : std::uint8_t{0};
}

/// trace_inferred_ids() of a frame's parts.
std::int64_t trace_inferred_ids(const Bvh& bvh, const View& view, IdBuffer& ids, Mask& inferred, Rect window,
                                const Control& control);

/// Shades a pixel's first sample, in `light`.
void shade_first(const Picture& picture, const Stage& stage, Vec2i at, const Reach& light, std::uint32_t slot,
                 Shader& shader);

/// Filters the light of traced pixels of `tile` and shades their first samples.
void shade_pixels(Picture& picture, const Stage& stage, Rect tile, std::span<const Vec2i> pixels);

/// Pass 2: shade_pixels() for all that are traced.
void shade_tile(Picture& picture, const Stage& stage, Rect tile);

/// Pass 3: marks traced pixels whose first sample is not enough: those that differ from a neighbour
/// in part, or across a crease or step in brightness or colour; those whose brightness is not
/// what their neighbours on both sides have on average; those that the rim may cross. Only the
/// first samples of traced pixels count, and all that is compared is what the screen shows.
/// Picture::edges becomes the contrast with the neighbours in 255ths, at least 1. All traced pixels are
/// marked with RenderParams::uniform.
void find_edges(Picture& picture, Rect tile);

/// Pass 4: more samples in marked pixels, 4, then twice as many each time, until a pixel has as many
/// as the contrast of its samples, or half the contrast with its neighbours, asks for:
/// RenderParams::samples x contrast^(3/4), twice that where the hole may be. The colour is their mean.
/// Decides from the first samples and a pixel's own, so that tiles do not matter. What light reaches
/// the samples is borrowed from a neighbouring pixel that saw the same surface, so that edges are as
/// smooth as the surfaces beside them; traced only if there is none.
void refine_tile(Picture& picture, const Stage& stage, Rect tile);

} // namespace porthole
