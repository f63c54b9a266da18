// Edges of a mesh: whether its surface is closed, and the connected pieces it consists of.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "porthole/base/parallel.h"
#include "porthole/scene/scene.h"

namespace porthole {

struct Closedness {
    bool closed = false;          ///< there are triangles and neither open nor odd edges
    std::uint64_t edges = 0;      ///< distinct edges after welding
    std::uint64_t open_edges = 0; ///< with one triangle
    std::uint64_t odd_edges = 0;  ///< with two triangles of the same direction, or more than two
    friend bool operator==(const Closedness&, const Closedness&) = default;
};

/// For every position the index of the first equal one; -0 equals 0. Cost: linear.
[[nodiscard]] std::vector<std::uint32_t> weld(std::span<const Vec3f> positions);

enum class PieceKind : std::uint8_t {
    closed,   ///< every edge joins a triangle to exactly one opposite one
    open,     ///< some edge does not
    duplicate ///< triangles that repeat others, corner by corner, and close nothing: to be ignored
};

inline constexpr std::uint32_t kNoPiece = 0xFFFFFFFFu;

/// The pieces of a mesh that hang together by edges; touching in a vertex does not count.
struct Pieces {
    Closedness edges;
    std::vector<std::uint32_t> of_triangle; ///< piece index; kNoPiece: degenerate after welding
    std::vector<PieceKind> kind;            ///< by piece, in the order of their first triangles
};

/// Finds the pieces of one mesh after welding its vertices by exact position.
///
/// An edge with several triangles joins those that bound the same wedge of material: two
/// solids that touch in an edge or a face stay two closed pieces, an exact copy of a solid is
/// a solid of its own, and a fin that stands on a closed surface is an open piece beside it.
///
/// Cost: linear apart from edges with more than two triangles, which are sorted; about 0.2 s
/// and 60 MB of scratch per million triangles.
[[nodiscard]] Pieces find_pieces(const Mesh& mesh);

/// Judges one mesh after welding its vertices by exact position (-0 equals 0) and leaving
/// out triangles that this makes degenerate. Texture and normal seams thus do not count.
///
/// CAD exports often tessellate each face by itself, so that edges do not pair although the
/// solid has no gaps; those come out open here, and scene/solid.h judges them by rays.
/// Cost: that of find_pieces.
[[nodiscard]] Closedness closedness(const Mesh& mesh);

/// closedness() of every mesh of the scene, in order; meshes are judged in parallel.
/// @throws Cancelled.
[[nodiscard]] std::vector<Closedness> closedness(const Scene& scene, const Control& control = {});

} // namespace porthole
