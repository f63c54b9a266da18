// Which meshes bound a volume, when their edges alone do not tell.
#pragma once

#include <cstdint>
#include <vector>

#include "porthole/trace/bvh.h"

namespace porthole {

/// What some hundred random rays through a mesh say.
struct SolidTest {
    int rays = 0;          ///< rays that met it at all
    int balanced = 0;      ///< of those, entered and left equally often, never left before entering
    bool inverted = false; ///< `balanced` counts with every face turned around, which fits better

    /// Balanced on nearly all (94 %) of at least eight rays.
    [[nodiscard]] bool closed() const { return rays >= 8 && 100 * balanced >= 94 * rays; }
};

/// Shoots 300 seeded random lines through the box of each wanted mesh and follows the signs of
/// the surfaces they cross.
/// CAD exports often leave their faces unconnected or with slightly different edges, so that
/// edge matching calls closed solids open; rays do not mind.
/// @param wanted  by mesh index; others get an empty result.
/// @return one result per mesh. The same for any number of threads. Cost: 300 rays a mesh.
[[nodiscard]] std::vector<SolidTest> test_solids(const MeshBvhs& meshes, const std::vector<std::uint8_t>& wanted,
                                                 const Control& control = {});

} // namespace porthole
