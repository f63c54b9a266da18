// Who is seen where: id buffers, what lies in front of targets, the enclosing object.
// Every function gives the same bits for any number of threads and any window.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "porthole/base/cut.h"
#include "porthole/trace/bvh.h"
#include "porthole/trace/clusters.h"

namespace porthole {

/// Nearest part and depth at every pixel centre of `window` (absolute pixels; may reach beyond
/// the picture). Adds the rays traced to `rays`, if given.
/// Cost: one coherent ray a pixel.
[[nodiscard]] IdBuffer trace_ids(const Bvh& bvh, const View& view, Rect window, const Control& control = {},
                                 std::int64_t* rays = nullptr);

/// trace_ids over the marked blocks only; kNoPart elsewhere. With the blocks of `bvh`'s own
/// parts it equals trace_ids(bvh, view, window) on every pixel, by construction.
[[nodiscard]] IdBuffer trace_ids_in_blocks(const Bvh& bvh, const View& view, Rect window, const BlockMask& blocks,
                                           const Control& control = {}, std::int64_t* rays = nullptr);

/// Ids at given pixels of the parts that `mask` lets rays hit, for the paper's lazy follower.
[[nodiscard]] std::vector<PartId> trace_ids_at(const Bvh& bvh, const View& view, std::span<const Vec2i> pixels,
                                               std::uint32_t mask = kMaskAll);

/// A part that lies in front of targets.
struct PartSpan {
    PartId part = kNoPart;
    std::int64_t pixels = 0; ///< target pixels in front of which it lies
    float greatest_gap = 0;  ///< farthest in front of a target, metres of depth
};

struct Spans {
    Image<float> nearest;        ///< depth of the nearest such surface at target pixels; +infinity where none
    std::vector<PartSpan> parts; ///< by increasing id
};

/// What lies in front of the targets at their pixels, of the parts that `mask` lets rays hit.
/// Surfaces within `tolerance` metres (or 8 ulp) of the target count as behind it.
/// Cost: one occlusion ray a target pixel that passes every surface in front.
[[nodiscard]] Spans trace_spans(const Bvh& bvh, std::uint32_t mask, const View& view, const IdBuffer& targets,
                                float tolerance, const Control& control = {}, std::int64_t* rays = nullptr);

/// 1 where a ray through the pixel centre hits anything of `bvh`.
/// @param blocks  null, or the blocks that its parts' boxes touch: the others are not traced.
/// Cost: one occlusion ray a pixel, cheaper than a nearest hit.
[[nodiscard]] Mask trace_coverage(const Bvh& bvh, const View& view, Rect window, const BlockMask* blocks = nullptr,
                                  const Control& control = {}, std::int64_t* rays = nullptr);

/// At the pixels of `mask` the depth of the farthest surface of `bvh` nearer than `limit`
/// there; -infinity where there is none and outside the mask.
[[nodiscard]] Image<float> trace_farthest(const Bvh& bvh, const View& view, const Mask& mask, const Image<float>& limit,
                                          const Control& control = {}, std::int64_t* rays = nullptr);

/// At the pixels of `mask` whether a ray meets any surface of `bvh` at depth `from` there or
/// beyond; 0 outside the mask.
[[nodiscard]] Mask trace_beyond(const Bvh& bvh, const View& view, const Mask& mask, const Image<float>& from,
                                const Control& control = {}, std::int64_t* rays = nullptr);

/// At the pixels of `mask` whether the nearest surface of `bvh` at depth `from` or beyond is one
/// seen from behind, by its mesh's winding, and no farther than `until`; 0 outside the mask.
[[nodiscard]] Mask trace_back_faces(const Bvh& bvh, const View& view, const Mask& mask, const Image<float>& from,
                                    const Image<float>& until, const Control& control = {});

/// Hits of a target in the 16 sub-pixel positions (4x4 grid) of each pixel of `window`, for
/// targets too small for pixel centres.
struct FineCoverage {
    Image<std::uint16_t> hits; ///< bit 4 * row + column
    Image<float> depth;        ///< nearest of the hits; +infinity if none
    std::int64_t samples = 0;  ///< bits set
};
[[nodiscard]] FineCoverage trace_fine(const Bvh& bvh, const View& view, Rect window, const Control& control = {},
                                      std::int64_t* rays = nullptr);

/// Continuous pixel position of sub-sample `i` (0..15) of pixel (x, y) in trace_fine.
[[nodiscard]] inline Vec2f fine_position(int x, int y, int i) {
    const int row = i / 4, column = i % 4;
    return {float(x) + (float(column) + 0.5f) * 0.25f, float(y) + (float(row) + 0.5f) * 0.25f};
}

} // namespace porthole
