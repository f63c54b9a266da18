// Which triangles of a mesh bound material, and on which side of them it lies.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "porthole/base/parallel.h"
#include "porthole/scene/closed.h"
#include "porthole/scene/scene.h"

namespace porthole {

enum class TriangleSide : std::uint8_t {
    open,    ///< bounds no material: of an open piece, a flat one, or a copy of another triangle
    outward, ///< as wound, its normal points out of the material
    inward   ///< as wound, its normal points into the material
};

enum class ClosedBy : std::uint8_t {
    nothing, ///< some of it is open
    edges,   ///< every edge has exactly two opposite triangles
    rays     ///< lines through it enter and leave in turn on nearly all
};

/// What find_solid() says of one mesh. Facing is by the mesh's own winding in the mesh's own
/// coordinates: a part that mirrors the mesh changes nothing here.
struct MeshSolid {
    bool closed = false; ///< it bounds material, and no piece of it is open
    ClosedBy by = ClosedBy::nothing;
    TriangleSide uniform = TriangleSide::open; ///< of every triangle, unless `side` tells them apart
    std::vector<TriangleSide> side;            ///< by triangle; empty: all alike
    std::uint32_t components = 0;              ///< pieces joined by edges; copies of triangles not counted
    std::uint32_t closed_components = 0;       ///< of those, the ones that bound material
    std::uint32_t flipped_components = 0;      ///< of those, the ones that face the wrong way
    std::uint32_t lines = 0;                   ///< of the ray test, when it was made
    std::uint32_t balanced_lines = 0;          ///< of those, the ones that speak for `closed`
    Closedness edges;

    [[nodiscard]] TriangleSide side_of(std::uint32_t triangle) const { return side.empty() ? uniform : side[triangle]; }
    /// Whether any triangle bounds material; false for a part that can have no cap at all.
    [[nodiscard]] bool has_material() const { return closed_components > 0; }
    friend bool operator==(const MeshSolid&, const MeshSolid&) = default;
};

/// What a ray does where it crosses a triangle: -1 it truly enters material, +1 it leaves it,
/// 0 the triangle bounds no material and is to be ignored.
/// @param entering  the ray runs against the normal of the triangle's own winding.
[[nodiscard]] inline int crossing_sign(const MeshSolid& solid, std::uint32_t triangle, bool entering) {
    const TriangleSide side = solid.side_of(triangle);
    if (side == TriangleSide::open) return 0;
    return entering == (side == TriangleSide::outward) ? -1 : 1;
}

/// Judges one mesh.
///
/// A piece (find_pieces) is closed by its edges. Its side follows from how deep it is nested in
/// the other closed pieces of the mesh, whatever way the file winds it: the outermost faces
/// outward, one inside it bounds a cavity, one inside that is a body in the cavity. So a housing
/// with an inner skin is one wall. Pieces that touch, cross or coincide do not nest: each is
/// a body, and where bodies overlap a ray is inside several. A piece whose volume is next to
/// nothing for its area is a flat sheet and bounds nothing.
///
/// The pieces that edges leave open are then judged together, as many CAD exports tessellate
/// each face by itself: of 300 seeded lines through points of their surface, in six directions,
/// at least 94 % must enter and leave equally often and never leave more often than enter.
/// Those are sides as wound (or all turned, if that balances), not by nesting. In a mesh that
/// has both, the winding of the file is taken when it makes sense of the whole; where it
/// does not, and the two kinds lie inside one another, or the rest stays open, closed pieces
/// within the box of the open ones count as open, too: they may be the walls of its cavity.
///
/// Deterministic. Cost: that of find_pieces, for several pieces one pass over the triangles
/// more, for open ones six; nesting looks at no more than 200,000 points and 32 pairs of
/// triangle and line for each triangle (20 million at least); a mesh that would need
/// more, such as many thousand shells in each other, comes out open.
[[nodiscard]] MeshSolid find_solid(const Mesh& mesh);

/// find_solid() of the wanted meshes, in order, the others left as they are by default;
/// meshes are judged in parallel.
/// @param wanted  by mesh; empty: all. A mesh that nobody asks for costs nothing.
/// @throws Cancelled.
[[nodiscard]] std::vector<MeshSolid> find_solids(const Scene& scene, std::span<const std::uint8_t> wanted = {},
                                                 const Control& control = {});

/// 1 for the meshes of the given parts.
[[nodiscard]] std::vector<std::uint8_t> meshes_of(const Scene& scene, std::span<const PartId> parts);

} // namespace porthole
