// Where parallel lines pierce a mesh: exact bookkeeping for judging solids, without a tree.
#pragma once

#include <cstdint>
#include <limits>
#include <optional>
#include <span>
#include <vector>

#include "porthole/scene/scene.h"

namespace porthole {

/// A line passes through a triangle.
struct Piercing {
    std::uint32_t line = 0, triangle = 0;
    bool entering = false; ///< against the triangle's normal, by its winding
    double along = 0;      ///< from the line's point, in units of the direction
    friend bool operator==(const Piercing&, const Piercing&) = default;
};

/// All piercings of the lines through `points` along `direction`, sorted by line, then along it.
///
/// Every line meets a triangle of a closed surface exactly when its neighbours agree: a line
/// through a shared edge or vertex pierces one triangle of the two, or of the fan, as if it
/// were moved aside by less than any distance; triangles that lie along the lines are never
/// pierced. So entries and exits of a closed surface always balance.
///
/// @param wanted     by triangle, 0: leave it out; empty: all are wanted.
/// @param direction  unit length, the mesh's coordinates.
/// @param budget     the most pairs of triangle and line to look at; a piercing counts for nine.
/// @param from       piercings nearer along the line than this are left out.
/// @return nothing if the budget did not suffice.
/// Cost: linear in triangles for small ones, as each looks only at lines near it; about 0.03 s
/// per million triangles and some hundred lines.
[[nodiscard]] std::optional<std::vector<Piercing>> find_piercings(
    const Mesh& mesh, std::span<const std::uint8_t> wanted, Vec3d direction, std::span<const Vec3d> points,
    std::uint64_t budget, double from = -std::numeric_limits<double>::infinity());

} // namespace porthole
