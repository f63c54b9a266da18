#include "porthole/io/gltf_part.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <tuple>
#include <unordered_map>

namespace porthole::gltf {
namespace {

// Bounds that keep a small file with one long name, a deep chain or instances of instances
// from filling the memory.
constexpr std::uint64_t kMostPathBytes = std::uint64_t(128) << 20;
constexpr std::uint64_t kMostParts = std::uint64_t(4) << 20;

// What the nodes that show a mesh need to know about it.
struct MeshFacts {
    std::size_t targets = 0;
    std::vector<float> weights; // its own, of the morph targets
    bool can_be_skinned = true;
};

MeshFacts facts_of(const Document& doc, const Json& mesh) {
    MeshFacts facts;
    const std::span<const Json> primitives = doc.list_of_objects(mesh, "primitives");
    if (!primitives.empty()) facts.targets = doc.list(primitives[0], "targets").size();
    for (const Json& w : doc.list(mesh, "weights")) {
        if (!w.is_number()) doc.fail("E0303", w, {}, "is not a number");
        facts.weights.push_back(static_cast<float>(w.get<double>()));
    }
    for (const Json& primitive : primitives) {
        const Json* attributes = doc.object(primitive, "attributes");
        facts.can_be_skinned &=
            attributes && Document::find(*attributes, "JOINTS_0") && Document::find(*attributes, "WEIGHTS_0");
    }
    return facts;
}

// Weights of the morph targets, empty if they change nothing.
std::vector<float> morph_weights(Document& doc, const Node& node, const MeshFacts& mesh) {
    std::vector<float> weights = node.weights.empty() ? mesh.weights : node.weights;
    if (weights.size() != mesh.targets && !weights.empty())
        doc.warn("W0307", *node.json, {},
                 std::to_string(weights.size()) + " weights for " + std::to_string(mesh.targets) + " morph targets");
    weights.resize(std::min(weights.size(), mesh.targets));
    if (std::all_of(weights.begin(), weights.end(), [](float w) { return w == 0; })) weights.clear();
    return weights;
}

std::vector<Affine3d> world_from_bind(const Document& doc, std::span<const Accessor> accessors, std::int32_t skin,
                                      std::span<const Affine3d> world) {
    const Json& json = doc.element("skins", std::size_t(skin));
    const std::span<const Json> joints = doc.list(json, "joints");
    if (joints.empty()) doc.fail("E0303", json, "joints", "is empty or missing; a skin needs joints");
    const Accessor* inverse_bind = nullptr;
    if (const auto index = doc.index(json, "inverseBindMatrices", accessors.size(), "accessor")) {
        inverse_bind = &accessors[*index];
        if (inverse_bind->components != 16 || inverse_bind->count < joints.size())
            doc.fail("E0303", json, "inverseBindMatrices",
                     "needs " + std::to_string(joints.size()) + " elements of type MAT4");
    }
    std::vector<Affine3d> out;
    out.reserve(joints.size());
    for (std::size_t j = 0; j < joints.size(); ++j) {
        const Affine3d& joint = world[doc.as_index(joints[j], world.size(), "node")];
        if (!inverse_bind) {
            out.push_back(joint);
            continue;
        }
        float f[16];
        read_floats(*inverse_bind, j, 1, 16, f);
        const double m[16] = {f[0], f[1], f[2],  f[3],  f[4],  f[5],  f[6],  f[7],
                              f[8], f[9], f[10], f[11], f[12], f[13], f[14], f[15]};
        out.push_back(joint *
                      Affine3d{{m[0], m[1], m[2]}, {m[4], m[5], m[6]}, {m[8], m[9], m[10]}, {m[12], m[13], m[14]}});
    }
    return out;
}

// Whether the transform can be undone and keeps the mesh within single precision.
bool is_usable(const Affine3d& m, const Bounds3f& bounds) {
    const double x = length(m.x), y = length(m.y), z = length(m.z);
    if (!(x > 1e-30 && y > 1e-30 && z > 1e-30) || !(std::abs(m.determinant()) > 1e-10 * x * y * z)) return false;
    for (int corner = 0; corner < 8; ++corner) {
        const Vec3d p = m.point(Vec3d(bounds.corner(corner)));
        if (!(std::max({std::abs(p.x), std::abs(p.y), std::abs(p.z)}) < double(kLargestCoordinate))) return false;
    }
    return true;
}

// What a node is called: by its own name or, without one, by its mesh's. Names stay in the
// JSON: they may be long, and shared by many nodes.
std::string_view called(const Document& doc, const Node& node) {
    const std::string_view name = raw_name(*node.json);
    return name.empty() && node.mesh != kNone ? raw_name(doc.element("meshes", std::size_t(node.mesh))) : name;
}

// Segments of paths: the names, and numbers for unnamed nodes and those that share a name with
// a sibling.
struct Segments {
    std::vector<std::string_view> names;
    std::vector<std::int64_t> numbers; // -1: none
};

Segments name_segments(const Document& doc, std::span<const Node> nodes) {
    Segments s;
    s.names.reserve(nodes.size());
    for (const Node& node : nodes) s.names.push_back(called(doc, node));
    s.numbers.assign(nodes.size(), -1);
    const auto number = [&](std::span<const std::uint32_t> siblings) {
        std::unordered_map<std::string_view, std::pair<std::uint32_t, std::uint32_t>> seen; // how many, next number
        for (const std::uint32_t i : siblings) ++seen[s.names[i]].first;
        for (const std::uint32_t i : siblings) {
            auto& [count, next] = seen[s.names[i]];
            if (count > 1 || s.names[i].empty()) s.numbers[i] = next++;
        }
    };
    std::vector<std::uint32_t> top;
    for (std::uint32_t i = 0; i < nodes.size(); ++i) {
        if (nodes[i].parent == kNone) top.push_back(i);
        number(nodes[i].children);
    }
    number(top);
    return s;
}

// The path of `node`, if it and the paths before it (`total` bytes) stay within the bound.
std::string path_of(const Document& doc, std::span<const Node> nodes, const Segments& segments, std::uint32_t node,
                    std::uint64_t& total) {
    std::vector<std::uint32_t> chain;
    for (std::int32_t k = static_cast<std::int32_t>(node); k != kNone; k = nodes[std::size_t(k)].parent) {
        chain.push_back(static_cast<std::uint32_t>(k));
        total += segments.names[std::size_t(k)].size() + 8; // number and slash
        if (total > kMostPathBytes)
            doc.fail_limit(doc.root(), "nodes",
                           "the paths of all parts take over 128 MB; the tree is too deep or its names too long");
    }
    std::string path;
    for (auto i = chain.rbegin(); i != chain.rend(); ++i) {
        if (i != chain.rbegin()) path += '/';
        path += without_nul(segments.names[*i]);
        if (segments.numbers[*i] >= 0) path += '[' + std::to_string(segments.numbers[*i]) + ']';
    }
    return path;
}

} // namespace

PlacedMeshes place_meshes(Document& doc, std::span<const Accessor> accessors, std::span<const Node> nodes,
                          std::span<const std::uint32_t> drawn, std::span<const Affine3d> world) {
    PlacedMeshes placed;
    std::map<std::int32_t, MeshFacts> facts;
    std::map<std::int32_t, std::shared_ptr<const std::vector<Affine3d>>> skins;
    std::map<std::tuple<std::int32_t, std::int32_t, std::vector<float>>, std::size_t> known;
    const auto place = [&](std::uint32_t node, std::size_t request, const Affine3d& world_from_mesh) {
        if (placed.placements.size() == kMostParts)
            doc.fail_limit(*nodes[node].json, {}, "the model has over " + std::to_string(kMostParts) + " parts");
        placed.placements.push_back({node, request, world_from_mesh});
    };
    for (const std::uint32_t i : drawn) {
        const Node& node = nodes[i];
        if (node.mesh == kNone) continue;
        const auto [fact, first_use] = facts.try_emplace(node.mesh);
        if (first_use) fact->second = facts_of(doc, doc.element("meshes", std::size_t(node.mesh)));
        const MeshFacts& mesh = fact->second;
        const std::int32_t skin = mesh.can_be_skinned ? node.skin : kNone;
        if (skin != node.skin)
            doc.warn("W0307", *node.json, "skin",
                     "the mesh has a primitive without joints and weights; it is not skinned");
        std::vector<float> weights = morph_weights(doc, node, mesh);

        const auto [entry, fresh] = known.try_emplace({node.mesh, skin, weights}, placed.requests.size());
        if (fresh) {
            MeshRequest request{static_cast<std::uint32_t>(node.mesh), std::move(weights), skin, {}};
            if (skin != kNone) {
                std::shared_ptr<const std::vector<Affine3d>>& joints = skins[skin];
                if (!joints)
                    joints =
                        std::make_shared<const std::vector<Affine3d>>(world_from_bind(doc, accessors, skin, world));
                request.world_from_bind = joints;
            }
            placed.requests.push_back(std::move(request));
        }
        // A skin alone says where the vertices are; its node does not move them.
        const Affine3d base = skin != kNone ? Affine3d{} : world[i];
        if (!doc.extension(*node.json, "EXT_mesh_gpu_instancing")) {
            place(i, entry->second, base);
            continue;
        }
        for (const Affine3d& instance : read_instances(doc, accessors, *node.json))
            place(i, entry->second, base * instance);
    }
    return placed;
}

void add_parts(Document& doc, std::span<const Node> nodes, const PlacedMeshes& placed, std::vector<Mesh> meshes,
               Scene& scene) {
    std::vector<std::int32_t> mesh_of(meshes.size(), kNone);
    for (std::size_t r = 0; r < meshes.size(); ++r) {
        if (meshes[r].positions.empty()) continue; // points and lines only; they have warned
        mesh_of[r] = static_cast<std::int32_t>(scene.meshes.size());
        scene.meshes.push_back(std::move(meshes[r]));
    }
    const Segments segments = name_segments(doc, nodes);
    std::vector<std::vector<std::string>> paths;
    std::uint64_t path_bytes = 0;
    for (const Placement& p : placed.placements) {
        const Node& node = nodes[p.node];
        const std::int32_t mesh = mesh_of[p.request];
        if (mesh == kNone) continue; // its primitives have warned
        const Bounds3f& bounds = scene.meshes[std::size_t(mesh)].bounds;
        if (!is_usable(p.world_from_mesh, bounds.empty() ? Bounds3f{{0, 0, 0}, {0, 0, 0}} : bounds)) {
            doc.warn("W0305", *node.json, {},
                     "the part is flat, or beyond 1e12 m, after its transforms; it is left out");
            continue;
        }
        paths.push_back({path_of(doc, nodes, segments, p.node, path_bytes)});
        const std::string_view name = segments.names[p.node];
        if (name.find('\0') != name.npos)
            doc.warn("W0310", *node.json, "name", "has a NUL character; it is read as U+FFFD");
        scene.parts.push_back({without_nul(name), {}, static_cast<std::uint32_t>(mesh), p.world_from_mesh});
    }
    assign_paths(scene, paths);
}

} // namespace porthole::gltf
