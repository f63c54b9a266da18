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
    open,    ///< bounds no material: of an open piece, a flat sheet, or a copy of another triangle
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
    std::uint32_t components = 0;              ///< pieces joined by edges, less copies, flat sheets and needles
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
/// outward, one strictly inside it bounds a cavity, one inside that is a body in the cavity. So
/// a housing with an inner skin is one wall. Pieces that touch, cross or coincide do not nest:
/// each is a body, and where bodies overlap a ray is inside several. Flat sheets (no volume
/// to speak of), copies of triangles and needles bound nothing and open nothing.
///
/// The pieces that edges leave open are judged by 300 seeded lines through points of their
/// surface, in six directions (1500 lines in thirty where the first ones leave a doubt): closed if
/// on at least 94 % of them the crossings balance and never go negative.
/// - All together, as many CAD exports tessellate each face by itself. They face as wound, or all
///   the other way if that is what balances. Where more than a fifth of the lines is inside
///   twice, bodies that overlap cannot be told from a cavity wound the wrong way: open.
/// - One by one, if there are up to 64 and the first test leaves a doubt: surfaces with pinholes
///   nest like closed ones when every one of them passes.
/// - Together with the closed pieces, as the file winds them, if that alone makes sense.
/// Closed pieces inside open ones that pass bound cavities there. Around open ones that do not
/// pass, those within their box count as open, too: they may be walls of a cavity.
///
/// Rays through the gap of a mesh closed by rays (balanced_lines < lines) can still enter it
/// without leaving it, up to 6 % of them.
///
/// Deterministic. Cost: about 0.25 s per million triangles. That of find_pieces, for several
/// pieces one pass over the triangles more, for open ones six or more. Nesting looks at no more
/// than 200,000 points and 32 pairs of triangle and line for each triangle (20 million at
/// least); a mesh that needs more, such as many thousand shells in each other, comes out open.
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
