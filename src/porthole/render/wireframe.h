// The paper's wireframe: edges of the triangles, with hidden lines left out or dashed.
#pragma once

#include "porthole/render/render.h"

namespace porthole {

enum class Wire : std::uint8_t {
    none,      ///< no wireframe asked for; drawn as automatic
    automatic, ///< mesh where edges in the picture are 8 px long on average and hidden ones are left out, else feature
    mesh,      ///< every edge of every triangle
    feature    ///< outlines, creases, and edges that do not join two triangles; a quarter wider
};
enum class HiddenLines : std::uint8_t { none, dashed };

struct WireParams {
    Wire wire = Wire::none;
    HiddenLines hidden = HiddenLines::none;
    float width_px = 1; ///< in pixels of a picture up to 1080 high, in higher ones as much wider, (0, 100]
};

/// Draws the edges of `parts` without surfaces: alpha 0 between the lines.
///
/// Edges are found on each mesh after welding its vertices, projected, and asked along their
/// length, every pixel, whether something lies in front: surfaces are opaque, whatever their
/// material. That needs no orientation, closedness or connection of the triangles. What is nearer
/// than a third of a pixel's size does not hide. An edge is a crease from 60 degrees on, from 15 where
/// vertex normals are split at it, from 30 without vertex normals. Primitives have no edges: their outlines and
/// creases are found by rays, of up to four surfaces behind each other if they are dashed.
/// @param background  linear; lines are dark on it, or light where it is darker than mid grey.
/// @return colour and ids as render() does.
/// @throws Error usage E0140; limit E0902; Cancelled.
/// The same bits for any number of threads. Reports progress as stage "render".
/// Cost: a sort of the edges and a ray for each pixel of their length.
[[nodiscard]] Frame render_wireframe(const MeshBvhs& meshes, std::span<const PartId> parts, const View& view,
                                     const WireParams& params, Vec3f background = {1, 1, 1},
                                     const Control& control = {});

} // namespace porthole
