// The node tree: transforms, names, what hangs on it; and animations that move it.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "porthole/io/gltf_accessor.h"
#include "porthole/io/gltf_json.h"
#include "porthole/scene/scene.h"

namespace porthole::gltf {

struct Quaternion {
    double x = 0, y = 0, z = 0, w = 1;
};

struct Node {
    const Json* json = nullptr;
    std::int32_t parent = kNone;
    std::vector<std::uint32_t> children;
    std::int32_t mesh = kNone, skin = kNone, camera = kNone, light = kNone; ///< glTF indices
    bool visible = true;                                                    ///< KHR_node_visibility, this node's own
    bool has_matrix = false;
    Affine3d matrix; ///< if has_matrix; else the three below
    Vec3d translation{0, 0, 0}, scale{1, 1, 1};
    Quaternion rotation;        ///< unit length
    std::vector<float> weights; ///< of morph targets; empty: the mesh's

    [[nodiscard]] Affine3d parent_from_node() const;
};

/// Rotation by a unit quaternion, then translation, after scaling.
[[nodiscard]] Affine3d compose(Vec3d translation, Quaternion rotation, Vec3d scale);
/// `q` at unit length; the identity if it has none.
[[nodiscard]] Quaternion normalize(Quaternion q);

/// All nodes with their parents.
/// @throws Error E0303, E0306, E0309 (a node with two parents, or a cycle).
[[nodiscard]] std::vector<Node> read_nodes(Document& doc);

/// Nodes that have no parent, then their children and so on: parents before children, siblings
/// in order (depth first).
[[nodiscard]] std::vector<std::uint32_t> depth_first(std::span<const Node> nodes, std::span<const std::uint32_t> roots);

/// The nodes that the default scene lists, or all without a parent when there is no scene.
/// @throws Error E0306 for a scene or node that does not exist.
[[nodiscard]] std::vector<std::uint32_t> scene_roots(Document& doc, std::span<const Node> nodes);

/// world_from_node of every node.
[[nodiscard]] std::vector<Affine3d> world_transforms(std::span<const Node> nodes);

/// Poses the nodes at `time` seconds into the first animation (before its start and after its
/// end: its first and last key). What cannot be applied is a warning.
/// @param file_bytes  bounds the keys that are read, which may share bytes only so far.
void animate(Document& doc, std::span<const Accessor> accessors, double time, std::uint64_t file_bytes,
             std::vector<Node>& nodes);

/// Value of an animation curve.
/// @param times   key times, not decreasing, at least one.
/// @param values  `width` floats per key; for cubic splines three times that (in-tangent,
///                value, out-tangent).
enum class Interpolation { step, linear, cubic };
[[nodiscard]] std::vector<double> sample_curve(std::span<const float> times, std::span<const float> values, int width,
                                               Interpolation interpolation, bool rotation, double time);

/// EXT_mesh_gpu_instancing: node_from_instance of every instance; empty if the node has none.
[[nodiscard]] std::vector<Affine3d> read_instances(const Document& doc, std::span<const Accessor> accessors,
                                                   const Json& node);

/// The name in the file; empty without one, or when it is no text (check_names warns).
[[nodiscard]] std::string_view raw_name(const Json& json);
/// `name` with NUL characters, which no path can hold, as U+FFFD.
[[nodiscard]] std::string without_nul(std::string_view name);

// gltf_light.cpp

/// Adds the camera or light of a node to the scene, or a warning if it cannot be used.
void read_camera(Document& doc, const Node& node, const Affine3d& world, Scene& scene);
void read_light(Document& doc, const Node& node, const Affine3d& world, Scene& scene);

} // namespace porthole::gltf
