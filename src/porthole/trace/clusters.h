// Runs of neighbouring triangles with their boxes, and the blocks of pixels that those touch.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "porthole/base/image.h"
#include "porthole/base/parallel.h"
#include "porthole/base/view.h"
#include "porthole/scene/scene.h"

namespace porthole {

/// A mesh's triangles in runs of about 64 neighbours, each with the vertices that it uses.
struct TriangleClusters {
    struct Run {
        std::uint32_t first_vertex = 0, first_triangle = 0;
        std::uint32_t vertices = 0, triangles = 0; ///< at most 192 and 64
    };
    std::vector<Run> runs;                              ///< in the order of the mesh's boxes
    std::vector<Vec3f> vertices;                        ///< mesh coordinates
    std::vector<std::array<std::uint8_t, 3>> triangles; ///< vertices of the run, counted from its first
};

/// Boxes around runs of about 64 neighbouring triangles, mesh coordinates, by mesh index.
struct ClusterBoxes {
    std::vector<std::vector<Bounds3f>> by_mesh;
    std::vector<TriangleClusters> triangles; ///< by mesh: what is in the boxes; none for a mesh of primitives
};

/// Boxes for the meshes of `parts`; other meshes get none. Triangles are grouped along a
/// Morton curve of their centroids; a mesh of primitives has one box.
/// Cost: a sort of the parts' triangles, and 12 to 16 bytes for each.
[[nodiscard]] ClusterBoxes cluster_boxes(const Scene& scene, std::span<const PartId> parts,
                                         const Control& control = {});

/// What a box covers in the picture.
struct ProjectedBox {
    Rect pixels;        ///< one pixel more on each side, within the window; empty when behind the eye
    bool finite = true; ///< false: the box reaches the eye's plane, no rectangle bounds it, `pixels` is the window
    double nearest = 0, farthest = 0; ///< depth, metres
    double extent_px = 0;             ///< greatest distance from the picture's centre, beyond the window too
};
[[nodiscard]] ProjectedBox project_box(const Bounds3f& box, const Affine3d& camera_from_mesh, const View& view,
                                       Rect window);

/// 4x4-pixel blocks of `window`, aligned to multiples of 4 in absolute pixels, that the
/// projected boxes of `parts` touch: near-clipped, rounded outward, one pixel more. A block
/// that is not marked cannot hold a pixel whose ray hits one of the parts.
struct BlockMask {
    Rect blocks; ///< in block coordinates (pixel / 4, rounded down)
    Mask marked; ///< window = blocks
    [[nodiscard]] std::int64_t count() const;
};
/// None of the blocks of `window`.
[[nodiscard]] BlockMask no_blocks(Rect window);
[[nodiscard]] BlockMask mark_blocks(const Scene& scene, std::span<const PartId> parts, const ClusterBoxes& boxes,
                                    const View& view, Rect window);

/// The pixels of `window` that the blocks cover.
[[nodiscard]] Rect pixel_rect(const BlockMask& blocks, Rect window);

} // namespace porthole
