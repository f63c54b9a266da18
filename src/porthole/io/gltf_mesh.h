// Primitives to meshes: layout, parallel decoding, morph targets and skins.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <span>
#include <vector>

#include "porthole/base/parallel.h"
#include "porthole/io/gltf_accessor.h"
#include "porthole/io/gltf_json.h"
#include "porthole/io/load.h"
#include "porthole/scene/scene.h"

namespace porthole::gltf {

/// The accessors of a primitive or of a morph target; null where it has none.
struct Attributes {
    const Accessor* position = nullptr;
    const Accessor* normal = nullptr;
    const Accessor* tangent = nullptr;
    const Accessor* uv[2] = {};
    const Accessor* color = nullptr;
    std::vector<const Accessor*> joints, weights; ///< JOINTS_n and WEIGHTS_n, as many of each

    friend bool operator==(const Attributes&, const Attributes&) = default;
};

enum class Topology : std::uint8_t { none, triangles, strip, fan };

struct Primitive {
    const Json* json = nullptr;
    Topology topology = Topology::triangles;
    std::int32_t material = kNone; ///< glTF material
    Attributes attributes;
    std::vector<Attributes> targets;   ///< differences, one per morph target
    const Accessor* indices = nullptr; ///< null: 0, 1, 2, ...
    std::uint64_t vertices = 0, corners = 0, triangles = 0;
};

/// A mesh as one or several nodes need it.
struct MeshRequest {
    std::uint32_t mesh = 0;                                       ///< glTF mesh
    std::vector<float> weights;                                   ///< of morph targets; empty: not morphed
    std::int32_t skin = kNone;                                    ///< glTF skin; the vertices end up in world space
    std::shared_ptr<const std::vector<Affine3d>> world_from_bind; ///< by joint; null without a skin
};

/// The data that all meshes draw from.
struct MeshSource {
    std::span<const BufferView> views;
    std::span<const Accessor> accessors;
    std::span<const std::uint32_t> material_of; ///< Scene material by glTF material; last: of none
};

/// glTF materials that the meshes of `requests` use, by index; the last element tells whether
/// a primitive has none.
[[nodiscard]] std::vector<std::uint8_t> used_materials(const Document& doc, std::span<const MeshRequest> requests);

/// The meshes in the order of `requests`, finished (scene/scene.h, finish_mesh). One without
/// triangles had nothing that can be drawn. What was left out is in doc's warnings.
/// @throws Error E0303, E0306, E0308; limit E0902 when they would take over params.max_bytes;
///         Cancelled.
[[nodiscard]] std::vector<Mesh> build_meshes(Document& doc, const MeshSource& source,
                                             std::span<const MeshRequest> requests, const LoadParams& params,
                                             const Control& control);

/// Calls body(i) for every i in [0, n) in parallel; of several Errors the one of the lowest i
/// is thrown, so that the message does not depend on threads.
void parallel_in_order(std::size_t n, const Control& control, const std::function<void(std::size_t)>& body);

// gltf_primitive.cpp

/// The primitives of glTF mesh `mesh`; Draco ones still without counts and accessors.
[[nodiscard]] std::vector<Primitive> read_primitives(Document& doc, std::span<const Accessor> accessors,
                                                     std::uint32_t mesh);
/// Sets counts from the accessors; drops attributes whose count disagrees, with a warning.
void settle_counts(Document& doc, Primitive& primitive);

// gltf_vertices.cpp

struct VertexFaults {
    bool no_normal = false;           ///< a normal had no length; it is NaN now
    std::uint64_t unknown_joints = 0; ///< vertices that name a joint the skin does not have; its first is used
};
/// Writes vertices [first, first + count) of `primitive` into `mesh` from `base + first` on:
/// decoded, morphed, skinned, unit length. Attribute arrays of the mesh that are empty are
/// skipped; those that the primitive lacks become white, zero, an arbitrary tangent or a NaN
/// normal.
VertexFaults fill_vertices(const Primitive& primitive, const MeshRequest& request, std::size_t base, std::size_t first,
                           std::size_t count, Mesh& mesh);

struct BadIndices {
    std::uint64_t triangles = 0;
    std::uint64_t first_triangle = 0; ///< of the primitive
    std::uint32_t first_index = 0;
};
/// Writes triangles [first, first + count) of `primitive`, whose vertices start at `base`. A
/// triangle with an index beyond the vertices gets indices that finish_mesh drops.
BadIndices fill_triangles(const Primitive& primitive, std::uint32_t base, std::size_t first, std::size_t count,
                          Vec3u* out);

/// Gives triangles of submeshes that have no normals (`flat`, by submesh) corners of their own
/// with the face normal, for a mesh whose other submeshes have normals.
void flatten_submeshes(Mesh& mesh, std::span<const std::uint8_t> flat);

/// Replaces NaN normals by the area-weighted mean of the faces around.
void repair_normals(Mesh& mesh);

} // namespace porthole::gltf
