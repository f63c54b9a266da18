// Solids given by formulas: spheres, boxes, cones, tori and what union, intersection and
// difference make of them. Crossings of lines are found on the formulas, in double.
#pragma once

#include <cstdint>
#include <limits>
#include <span>
#include <vector>

#include "porthole/base/math.h"

namespace porthole {

/// Unit shapes, centred at the origin of their own coordinates; the placement gives the size.
enum class PrimitiveKind : std::uint8_t {
    sphere,  ///< radius 1; one surface
    box,     ///< [-1, 1]^3; six surfaces: -x, +x, -y, +y, -z, +z
    frustum, ///< around y in [-1, 1], radius 1 below and `ratio` in [0, 1] above; side, bottom, top
    torus    ///< around y, radius 1 to the middle of a tube of radius `ratio` in [1e-4, 0.9999]; one surface
};

[[nodiscard]] std::uint32_t surface_count(PrimitiveKind kind);

/// Radius of a unit frustum at height y in [-1, 1].
[[nodiscard]] inline double frustum_radius(double ratio, double y) { return 0.5 * (ratio + 1) + 0.5 * (ratio - 1) * y; }

/// One primitive in the coordinates of its mesh. Made by make_primitive().
struct PrimitiveLeaf {
    PrimitiveKind kind = PrimitiveKind::sphere;
    bool flipped = false; ///< taken away an odd number of times: its inside is outside
    double ratio = 0;
    std::uint32_t material = 0;
    std::uint32_t first_surface = 0; ///< number of its first surface in the tree
    Affine3d mesh_from_leaf, leaf_from_mesh;
    Vec3d nx, ny, nz; ///< columns that turn an outward leaf normal into an outward mesh normal
};

enum class CsgOperation : std::uint8_t {
    leaf,
    unite,     ///< in any child
    intersect, ///< in every child
    subtract   ///< in the first child and in no other
};

struct PrimitiveNode {
    CsgOperation operation = CsgOperation::leaf;
    std::uint32_t leaf = 0;     ///< index into PrimitiveTree::leaves, of a leaf
    std::uint32_t end = 1;      ///< index after the last node below this one
    std::uint32_t children = 0; ///< of an operation
    Bounds3d box;               ///< holds the solid; mesh coordinates
};

/// A solid: nodes in the order parent, first child and all below it, second child, and so on.
/// Plain value; no nodes: no solid. Surfaces are numbered through all leaves in their order.
struct PrimitiveTree {
    std::vector<PrimitiveNode> nodes;
    std::vector<PrimitiveLeaf> leaves;
    std::vector<std::uint32_t> leaf_of_surface;
    std::uint32_t depth = 0; ///< nodes from the root to the deepest leaf

    [[nodiscard]] bool empty() const { return nodes.empty(); }
    /// Box of the whole solid; empty if it has no points. Tight for single primitives and
    /// unions, and may be larger than the solid otherwise.
    [[nodiscard]] Bounds3d bounds() const { return nodes.empty() ? Bounds3d{} : nodes[0].box; }
};

/// Most that combine() accepts.
inline constexpr std::uint32_t kMaxTreeDepth = 64, kMaxTreeLeaves = 4096;

/// A tree of one primitive.
/// @param ratio           as the kind says; no matter for spheres and boxes.
/// @param mesh_from_leaf  invertible; may be mirrored.
[[nodiscard]] PrimitiveTree make_primitive(PrimitiveKind kind, double ratio, const Affine3d& mesh_from_leaf,
                                           std::uint32_t material = 0);

/// The solid that `operation` (not leaf) makes of the children.
/// @return empty if there is no child, or more leaves or depth than the limits.
[[nodiscard]] PrimitiveTree combine(CsgOperation operation, std::span<const PrimitiveTree> children);

/// The solid moved by an invertible map.
[[nodiscard]] PrimitiveTree placed(PrimitiveTree tree, const Affine3d& map);

/// Box of the solid under a map, as bounds() is of the identity.
[[nodiscard]] Bounds3d bounds(const PrimitiveTree& tree, const Affine3d& map);

/// Points in mesh coordinates whose hull holds the solid, for framing: some hundred a leaf that
/// adds to it, none outside bounds().
[[nodiscard]] std::vector<Vec3f> hull_points(const PrimitiveTree& tree);

/// Where a line passes through the surface of a solid.
struct PrimitiveCrossing {
    double t = 0;
    std::uint32_t surface = 0;
    bool entering = true; ///< into the solid
};

/// All crossings of the line origin + t direction with t in [t0, t1], by increasing t; entering
/// and leaving alternate, on a whole line beginning with entering. Material or gaps thinner than a billionth of the
/// distance to the far side of the tree are left out where solids meet, so that faces in one plane leave no film.
/// @param direction  any finite length above 0.
/// @param crossings  replaced; its memory is used again.
/// The same line gives the same bits always, whatever the stretch: nothing but + - * / and square roots.
/// Cost: about 30 ns a primitive whose box the stretch meets, a torus about ten times that.
void find_crossings(const PrimitiveTree& tree, Vec3d origin, Vec3d direction, double t0, double t1,
                    std::vector<PrimitiveCrossing>& crossings);

/// The same of the whole line.
inline void find_crossings(const PrimitiveTree& tree, Vec3d origin, Vec3d direction,
                           std::vector<PrimitiveCrossing>& crossings) {
    constexpr double kEver = std::numeric_limits<double>::infinity();
    find_crossings(tree, origin, direction, -kEver, kEver, crossings);
}

/// A point of a surface: what a crossing becomes when only its surface and two numbers are kept.
struct PrimitivePoint {
    Vec3d position; ///< mesh coordinates
    Vec3d normal;   ///< unit, outward from the solid, mesh coordinates
};

/// Coordinates in [-2, 2]^2 of a point, in mesh coordinates, on or near a surface.
[[nodiscard]] Vec2f surface_coordinates(const PrimitiveTree& tree, std::uint32_t surface, Vec3d position);

/// The point of `surface` with these coordinates: the one they were made from to 3e-7 of the
/// primitive's size, and on the surface to double precision.
[[nodiscard]] PrimitivePoint surface_point(const PrimitiveTree& tree, std::uint32_t surface, Vec2f coordinates);

/// Up to `count` points spread at random and evenly over the surface of a solid, mesh
/// coordinates; fewer, or none, where it is too thin to be found. The same every time.
/// Cost: that of up to 32 lines a point.
[[nodiscard]] std::vector<Vec3d> surface_samples(const PrimitiveTree& tree, int count);

} // namespace porthole
