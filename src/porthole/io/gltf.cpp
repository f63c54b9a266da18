#include "porthole/io/gltf.h"

#include <algorithm>
#include <cmath>
#include <new>

#include "porthole/io/gltf_container.h"
#include "porthole/io/gltf_extension.h"
#include "porthole/io/gltf_material.h"
#include "porthole/io/gltf_mesh.h"
#include "porthole/io/gltf_node.h"
#include "porthole/io/gltf_part.h"

namespace porthole::gltf {
namespace {

constexpr std::size_t kDeepTree = 10000; // no modeller nests this deep
constexpr std::uint64_t kAlwaysAllowed = std::uint64_t(512) << 20, kMostUnfolding = 64;

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

// A file without any node says what there is, but not where: each mesh stands where it was made.
std::vector<Node> nodes_of_meshes(Document& doc) {
    std::vector<Node> nodes;
    for (const Json& mesh : doc.list_of_objects(doc.root(), "meshes")) {
        Node& node = nodes.emplace_back();
        node.json = &mesh;
        node.mesh = static_cast<std::int32_t>(nodes.size() - 1);
    }
    if (!nodes.empty()) doc.warn("W0305", doc.root(), {}, "there are no nodes; the meshes are drawn as they are");
    return nodes;
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

    UriReader uris(path);
    const std::vector<Buffer> buffers = read_buffers(doc, container, uris);
    std::uint64_t file_bytes = container.json.size();
    for (const Buffer& buffer : buffers) file_bytes += buffer.bytes.data.size();
    // Accessors and compressed views can be used any number of times: a file that unfolds to
    // far more than compression explains is one that was made to.
    LoadParams bounded = params;
    bounded.max_bytes = std::min(params.max_bytes, kAlwaysAllowed + kMostUnfolding * file_bytes);
    const std::vector<BufferView> views = read_buffer_views(doc, buffers, bounded.max_bytes, control);
    const std::vector<Accessor> accessors = read_accessors(doc, views, file_bytes);

    std::vector<Node> nodes = read_nodes(doc);
    if (nodes.empty()) nodes = nodes_of_meshes(doc);
    if (params.time >= 0) animate(doc, accessors, params.time, file_bytes, nodes);
    const std::vector<Affine3d> world = world_transforms(nodes);
    const std::vector<std::uint32_t> drawn = visible_nodes(nodes, scene_roots(doc, nodes));
    if (const std::size_t levels = depth_of(nodes); levels > kDeepTree)
        doc.warn("W0307", doc.root(), "nodes",
                 "the tree is " + std::to_string(levels) + " levels deep; is that meant?");
    const PlacedMeshes placed = place_meshes(doc, accessors, nodes, drawn, world);
    progress(0.2);

    Scene scene;
    MaterialSet set = read_materials(doc, used_materials(doc, placed.requests), views, uris, params, control);
    scene.materials = std::move(set.materials);
    scene.textures = std::move(set.textures);
    scene.images = std::move(set.images);
    progress(0.4);

    const MeshSource source{views, accessors, set.material_of};
    add_parts(doc, nodes, placed, build_meshes(doc, source, placed.requests, bounded, control), scene);
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
