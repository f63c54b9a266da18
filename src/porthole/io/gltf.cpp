#include "porthole/io/gltf.h"

#include <algorithm>
#include <cmath>
#include <new>
#include <tuple>
#include <unordered_map>

#include "porthole/io/gltf_container.h"
#include "porthole/io/gltf_extension.h"
#include "porthole/io/gltf_material.h"
#include "porthole/io/gltf_mesh.h"
#include "porthole/io/gltf_node.h"

namespace porthole::gltf {
namespace {

// Names along a path are repeated for every part below them: a bound on the sum keeps a small
// file with one long name or a deep chain from filling the memory.
constexpr std::uint64_t kMostNames = std::uint64_t(2) << 20;
constexpr std::size_t kDeepTree = 10000; // no modeller nests this deep
constexpr std::uint64_t kMostNameBytes = std::uint64_t(64) << 20;

Json parse(const Container& container, const std::string& file, std::uint64_t max_bytes, bool& repaired) {
    try {
        return parse_json(container.json, file, container.json_offset, max_bytes);
    } catch (const Error& e) {
        // Old exporters write names in the local code page: worth a second try.
        if (e.code != "E0302") throw;
        const std::string text = valid_utf8(container.json);
        if (text == container.json) throw;
        try {
            Json root = parse_json(text, file, container.json_offset, max_bytes);
            repaired = true;
            return root;
        } catch (const Error&) {
            throw e; // positions in the repaired text would be off
        }
    }
}

/// A mesh in the world: what becomes a Part.
struct Placement {
    std::uint32_t node = 0;
    std::size_t request = 0;
    Affine3d world_from_mesh;
};

// Weights of the morph targets, empty if they change nothing.
std::vector<float> morph_weights(Document& doc, const Node& node, const Json& mesh) {
    const std::span<const Json> primitives = doc.list_of_objects(mesh, "primitives");
    const std::size_t targets = primitives.empty() ? 0 : doc.list(primitives[0], "targets").size();
    std::vector<float> weights = node.weights;
    if (weights.empty())
        for (const Json& w : doc.list(mesh, "weights")) {
            if (!w.is_number()) doc.fail("E0303", w, {}, "is not a number");
            weights.push_back(static_cast<float>(w.get<double>()));
        }
    if (weights.size() != targets && !weights.empty())
        doc.warn("W0307", *node.json, {},
                 std::to_string(weights.size()) + " weights for " + std::to_string(targets) + " morph targets");
    weights.resize(std::min(weights.size(), targets));
    if (std::all_of(weights.begin(), weights.end(), [](float w) { return w == 0; })) weights.clear();
    return weights;
}

bool can_be_skinned(Document& doc, const Node& node, const Json& mesh) {
    for (const Json& primitive : doc.list_of_objects(mesh, "primitives")) {
        const Json* attributes = doc.object(primitive, "attributes");
        if (attributes && Document::find(*attributes, "JOINTS_0") && Document::find(*attributes, "WEIGHTS_0")) continue;
        doc.warn("W0307", *node.json, "skin", "the mesh has a primitive without joints and weights; it is not skinned");
        return false;
    }
    return true;
}

std::vector<Affine3d> world_from_bind(const Document& doc, std::span<const Accessor> accessors, std::int32_t skin,
                                      std::span<const Affine3d> world) {
    const Json& json = doc.list_of_objects(doc.root(), "skins")[std::size_t(skin)];
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

struct Placed {
    std::vector<Placement> placements;
    std::vector<MeshRequest> requests;
};

Placed place_meshes(Document& doc, std::span<const Accessor> accessors, std::span<const Node> nodes,
                    std::span<const std::uint32_t> drawn, std::span<const Affine3d> world) {
    const std::span<const Json> meshes = doc.list_of_objects(doc.root(), "meshes");
    Placed placed;
    std::map<std::tuple<std::int32_t, std::int32_t, std::vector<float>>, std::size_t> known;
    for (const std::uint32_t i : drawn) {
        const Node& node = nodes[i];
        if (node.mesh == kNone) continue;
        const Json& mesh = meshes[std::size_t(node.mesh)];
        std::vector<float> weights = morph_weights(doc, node, mesh);
        const std::int32_t skin = node.skin != kNone && can_be_skinned(doc, node, mesh) ? node.skin : kNone;
        const auto [entry, fresh] = known.try_emplace({node.mesh, skin, weights}, placed.requests.size());
        if (fresh) {
            MeshRequest request{static_cast<std::uint32_t>(node.mesh), std::move(weights), skin, {}};
            if (skin != kNone) request.world_from_bind = world_from_bind(doc, accessors, skin, world);
            placed.requests.push_back(std::move(request));
        }
        // A skin alone says where the vertices are; its node does not move them.
        const Affine3d base = skin != kNone ? Affine3d{} : world[i];
        if (Document::find(*node.json, "extensions") && doc.extension(*node.json, "EXT_mesh_gpu_instancing")) {
            for (const Affine3d& instance : read_instances(doc, accessors, *node.json))
                placed.placements.push_back({i, entry->second, base * instance});
        } else {
            placed.placements.push_back({i, entry->second, base});
        }
    }
    return placed;
}

// The nodes of the scene that are not hidden, in the order of the tree.
std::vector<std::uint32_t> visible_nodes(std::span<const Node> nodes, std::span<const std::uint32_t> roots) {
    std::vector<std::uint8_t> hidden(nodes.size(), 0);
    std::vector<std::uint32_t> order = depth_first(nodes, roots);
    std::erase_if(order, [&](std::uint32_t i) {
        hidden[i] = !nodes[i].visible || (nodes[i].parent != kNone && hidden[std::size_t(nodes[i].parent)]);
        return hidden[i] != 0;
    });
    return order;
}

std::size_t depth_of(std::span<const Node> nodes) {
    std::vector<std::size_t> level(nodes.size(), 1);
    std::vector<std::uint32_t> top;
    for (std::uint32_t i = 0; i < nodes.size(); ++i)
        if (nodes[i].parent == kNone) top.push_back(i);
    std::size_t deepest = 0;
    for (const std::uint32_t i : depth_first(nodes, top)) {
        if (nodes[i].parent != kNone) level[i] = level[std::size_t(nodes[i].parent)] + 1;
        deepest = std::max(deepest, level[i]);
    }
    return deepest;
}

// Whether the transform can be undone and keeps the mesh within single precision.
bool is_usable(const Affine3d& m, const Bounds3f& bounds) {
    const double x = length(m.x), y = length(m.y), z = length(m.z);
    if (!(x > 1e-30 && y > 1e-30 && z > 1e-30) || !(std::abs(m.determinant()) > 1e-10 * x * y * z)) return false;
    for (int corner = 0; corner < 8; ++corner) {
        const Vec3d p = m.point(Vec3d(bounds.corner(corner)));
        if (!(std::max({std::abs(p.x), std::abs(p.y), std::abs(p.z)}) < 1.8e18)) return false;
    }
    return true;
}

// What a node is called: by its own name or, without one, by its mesh's.
std::string called(Document& doc, const Node& node) {
    std::string name = name_of(doc, *node.json);
    if (name.empty() && node.mesh != kNone) name = name_of(doc, doc.list(doc.root(), "meshes")[std::size_t(node.mesh)]);
    return name;
}

// Path segments by node: unnamed nodes and those that share a name with a sibling are numbered.
std::vector<std::string> path_segments(std::span<const Node> nodes, std::span<const std::string> names) {
    std::vector<std::string> segments(nodes.size());
    const auto number = [&](std::span<const std::uint32_t> siblings) {
        std::unordered_map<std::string_view, std::pair<std::uint32_t, std::uint32_t>> seen; // of how many, next
        for (const std::uint32_t i : siblings) ++seen[names[i]].first;
        for (const std::uint32_t i : siblings) {
            auto& [count, next] = seen[names[i]];
            segments[i] = names[i];
            if (count > 1 || names[i].empty()) segments[i] += '[' + std::to_string(next++) + ']';
        }
    };
    std::vector<std::uint32_t> top;
    for (std::uint32_t i = 0; i < nodes.size(); ++i) {
        if (nodes[i].parent == kNone) top.push_back(i);
        number(nodes[i].children);
    }
    number(top);
    return segments;
}

void add_parts(Document& doc, std::span<const Node> nodes, const Placed& placed, std::vector<Mesh> meshes,
               Scene& scene) {
    std::vector<std::string> names(nodes.size());
    for (std::size_t i = 0; i < nodes.size(); ++i) names[i] = called(doc, nodes[i]);
    const std::vector<std::string> segments = path_segments(nodes, names);

    std::vector<std::int32_t> mesh_of(meshes.size(), kNone);
    for (std::size_t r = 0; r < meshes.size(); ++r) {
        if (meshes[r].triangles.empty()) continue;
        mesh_of[r] = static_cast<std::int32_t>(scene.meshes.size());
        scene.meshes.push_back(std::move(meshes[r]));
    }
    std::vector<std::vector<std::string>> chains;
    std::uint64_t name_count = 0, name_bytes = 0;
    for (const Placement& p : placed.placements) {
        const Node& node = nodes[p.node];
        const std::int32_t mesh = mesh_of[p.request];
        if (mesh == kNone) continue; // its primitives have warned
        if (!is_usable(p.world_from_mesh, scene.meshes[std::size_t(mesh)].bounds)) {
            doc.warn("W0305", *node.json, {},
                     "the part is flat, or beyond 1.8e18, after its transforms; it is left out");
            continue;
        }
        std::vector<std::string> chain;
        for (std::int32_t k = static_cast<std::int32_t>(p.node); k != kNone; k = nodes[std::size_t(k)].parent) {
            chain.push_back(segments[std::size_t(k)]);
            name_bytes += chain.back().size() + 1;
            if (++name_count > kMostNames || name_bytes > kMostNameBytes)
                doc.fail_limit(
                    doc.root(), "nodes",
                    "the paths of all parts would take over 64 MB; the tree is too deep or its names too long");
        }
        std::reverse(chain.begin(), chain.end());
        chains.push_back(std::move(chain));
        scene.parts.push_back({names[p.node], {}, static_cast<std::uint32_t>(mesh), p.world_from_mesh});
    }
    assign_paths(scene, chains);
}

void read_camera(Document& doc, const Node& node, const Affine3d& world, Scene& scene) {
    const Json& json = doc.list_of_objects(doc.root(), "cameras")[std::size_t(node.camera)];
    FileCamera camera;
    camera.name = name_of(doc, json);
    if (camera.name.empty()) camera.name = name_of(doc, *node.json);
    const std::string_view type = doc.string_or(json, "type");
    const Json* lens = doc.object(json, type == "orthographic" ? "orthographic" : "perspective");
    const double size = lens ? doc.number_or(*lens, type == "orthographic" ? "ymag" : "yfov", 0) : 0;
    camera.orthographic = type == "orthographic";
    const bool good = camera.orthographic ? size > 0 && size < 1e18 : size > 0 && size < 3.1;
    // Cameras look along -z; scale and shear of the node do not change the lens.
    const Vec3d z = normalize(world.z, Vec3d{0, 0, 0});
    const Vec3d x = normalize(cross(world.y, z), Vec3d{0, 0, 0});
    if (!good || !is_finite(world.p) || !(length(z) > 0.5) || !(length(x) > 0.5)) {
        doc.warn("W0306", json, {}, "the camera cannot be used: its angle, size or transform is out of range");
        return;
    }
    camera.world_from_camera = {x, cross(z, x), z, world.p};
    (camera.orthographic ? camera.half_height : camera.fov_y) = static_cast<float>(size);
    scene.cameras.push_back(std::move(camera));
}

void read_light(Document& doc, const Node& node, const Affine3d& world, Scene& scene) {
    const Json* extension = doc.extension(doc.root(), "KHR_lights_punctual");
    const Json& json = doc.list_of_objects(*extension, "lights")[std::size_t(node.light)];
    Light light;
    light.name = name_of(doc, json);
    if (light.name.empty()) light.name = name_of(doc, *node.json);
    const std::string_view type = doc.string_or(json, "type");
    if (type == "directional")
        light.kind = Light::Kind::directional;
    else if (type == "point")
        light.kind = Light::Kind::point;
    else if (type == "spot")
        light.kind = Light::Kind::spot;
    else {
        doc.warn("W0306", json, "type",
                 "is \"" + shortened(type) + "\", expected directional, point or spot; the light is left out");
        return;
    }
    double color[3] = {1, 1, 1};
    doc.numbers(json, "color", color);
    light.color = {float(color[0]), float(color[1]), float(color[2])};
    light.intensity = static_cast<float>(doc.number_or(json, "intensity", 1));
    const double range = doc.number_or(json, "range", double(kInfinity));
    light.range = static_cast<float>(range);
    if (const Json* spot = doc.object(json, "spot"); spot && light.kind == Light::Kind::spot) {
        light.inner_cone = static_cast<float>(doc.number_or(*spot, "innerConeAngle", 0));
        light.outer_cone = static_cast<float>(doc.number_or(*spot, "outerConeAngle", double(kPi) / 4));
    }
    light.position = Vec3f(world.p);
    light.direction = Vec3f(normalize(-world.z, Vec3d{0, 0, 0}));
    const bool good = is_finite(light.color) && light.color.x >= 0 && light.color.y >= 0 && light.color.z >= 0 &&
                      light.intensity >= 0 && std::isfinite(light.intensity) && range > 0 && light.inner_cone >= 0 &&
                      light.outer_cone > light.inner_cone && light.outer_cone <= kPi / 2 + 1e-3f &&
                      is_finite(light.position) && !(light.direction == Vec3f{0, 0, 0});
    if (!good)
        doc.warn("W0306", json, {}, "the light cannot be used: a value or its transform is out of range");
    else
        scene.lights.push_back(std::move(light));
}

Scene read(const FileBytes& file, const std::filesystem::path& path, const LoadParams& params, const Control& control) {
    const auto progress = [&](double share) {
        if (control.stop.stop_requested()) throw Cancelled{};
        if (control.progress) control.progress("load", share);
    };
    const std::string name = path.string();
    const Container container = open_container(file.bytes(), name);
    bool repaired = false;
    Document doc(name, parse(container, name, params.max_bytes, repaired));
    if (!doc.root().is_object()) doc.fail("E0303", doc.root(), {}, "is JSON, but not an object; this is no glTF file");
    if (repaired) doc.warn("W0310", doc.root(), {}, "the JSON is not valid UTF-8; what was wrong is read as U+FFFD");
    if (container.trailing_bytes) doc.warn("W0307", doc.root(), {}, "bytes after the end of the GLB are ignored");
    check_asset(doc);
    check_extensions(doc);
    check_names(doc);
    progress(0.1);

    const std::vector<Buffer> buffers = read_buffers(doc, container, path);
    std::uint64_t data_bytes = 0;
    for (const Buffer& buffer : buffers) data_bytes += buffer.bytes.data.size();
    const std::vector<BufferView> views = read_buffer_views(doc, buffers, params.max_bytes, control);
    const std::vector<Accessor> accessors = read_accessors(doc, views, data_bytes + container.json.size());

    std::vector<Node> nodes = read_nodes(doc);
    if (params.time >= 0) animate(doc, accessors, params.time, nodes);
    const std::vector<Affine3d> world = world_transforms(nodes);
    const std::vector<std::uint32_t> drawn = visible_nodes(nodes, scene_roots(doc, nodes));
    if (const std::size_t levels = depth_of(nodes); levels > kDeepTree)
        doc.warn("W0307", doc.root(), "nodes",
                 "the tree is " + std::to_string(levels) + " levels deep; is that meant?");
    const Placed placed = place_meshes(doc, accessors, nodes, drawn, world);
    progress(0.2);

    Scene scene;
    MaterialSet set = read_materials(doc, used_materials(doc, placed.requests), views, path, params, control);
    scene.materials = std::move(set.materials);
    scene.textures = std::move(set.textures);
    scene.images = std::move(set.images);
    progress(0.4);

    const MeshSource source{views, accessors, set.material_of};
    add_parts(doc, nodes, placed, build_meshes(doc, source, placed.requests, params, control), scene);
    for (const std::uint32_t i : drawn) {
        if (nodes[i].camera != kNone) read_camera(doc, nodes[i], world[i], scene);
        if (nodes[i].light != kNone) read_light(doc, nodes[i], world[i], scene);
    }
    progress(1);
    scene.source = name;
    scene.format = "glTF";
    scene.warnings = doc.take_warnings();
    return scene;
}

} // namespace
} // namespace porthole::gltf

namespace porthole {

Scene read_gltf(const FileBytes& file, const std::filesystem::path& path, const LoadParams& params,
                const Control& control) {
    const auto out_of_memory = [&] {
        return Error(ErrorKind::limit, "E0902", path.string(), "the model does not fit into memory");
    };
    try {
        return gltf::read(file, path, params, control);
    } catch (const std::bad_alloc&) {
        throw out_of_memory();
    } catch (const std::length_error&) {
        throw out_of_memory();
    }
}

} // namespace porthole
