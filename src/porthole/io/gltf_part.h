// From nodes to parts: which mesh, posed how, stands where, and what it is called.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "porthole/io/gltf_accessor.h"
#include "porthole/io/gltf_json.h"
#include "porthole/io/gltf_mesh.h"
#include "porthole/io/gltf_node.h"
#include "porthole/scene/scene.h"

namespace porthole::gltf {

/// A mesh in the world: what becomes a Part.
struct Placement {
    std::uint32_t node = 0;
    std::size_t request = 0;
    Affine3d world_from_mesh;
};

struct PlacedMeshes {
    std::vector<Placement> placements; ///< in the order of the tree, instances in theirs
    std::vector<MeshRequest> requests; ///< every mesh in every pose once
};

/// The meshes of the nodes `drawn`.
/// @throws Error E0303, E0306; limit E0902 for over 4 million parts.
[[nodiscard]] PlacedMeshes place_meshes(Document& doc, std::span<const Accessor> accessors, std::span<const Node> nodes,
                                        std::span<const std::uint32_t> drawn, std::span<const Affine3d> world);

/// Adds the meshes that have triangles and a part for every placement of them, with name and
/// path. A part whose transform cannot be undone is left out with a warning.
/// @throws Error limit E0902 when the paths of all parts take over 128 MB.
void add_parts(Document& doc, std::span<const Node> nodes, const PlacedMeshes& placed, std::vector<Mesh> meshes,
               Scene& scene);

} // namespace porthole::gltf
