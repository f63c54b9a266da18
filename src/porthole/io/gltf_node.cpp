#include "porthole/io/gltf_node.h"

#include <algorithm>
#include <cmath>

namespace porthole::gltf {
namespace {

void read_transform(Document& doc, Node& node) {
    const Json& json = *node.json;
    double m[16];
    if (doc.numbers(json, "matrix", m)) {
        node.has_matrix = true;
        node.matrix = {{m[0], m[1], m[2]}, {m[4], m[5], m[6]}, {m[8], m[9], m[10]}, {m[12], m[13], m[14]}};
        if (m[3] != 0 || m[7] != 0 || m[11] != 0 || m[15] != 1)
            doc.warn("W0305", json, "matrix", "the last row is not 0 0 0 1; it is ignored");
        return;
    }
    double t[3], r[4], s[3];
    if (doc.numbers(json, "translation", t)) node.translation = {t[0], t[1], t[2]};
    if (doc.numbers(json, "scale", s)) node.scale = {s[0], s[1], s[2]};
    if (doc.numbers(json, "rotation", r)) {
        const double length = std::sqrt(r[0] * r[0] + r[1] * r[1] + r[2] * r[2] + r[3] * r[3]);
        node.rotation = normalize(Quaternion{r[0], r[1], r[2], r[3]});
        if (!(length > 0) || !std::isfinite(length))
            doc.warn("W0305", json, "rotation", "the quaternion has no length; the node is not rotated");
        else if (std::abs(length - 1) > 0.01)
            doc.warn("W0305", json, "rotation",
                     "the quaternion has length " + std::to_string(length) + ", expected 1; normalised");
    }
}

// An index into a list that only adds to the picture: out of range is a warning.
std::int32_t optional_index(Document& doc, const Json& object, std::string_view key, std::size_t size,
                            std::string_view what) {
    const auto index = doc.uint(object, key);
    if (!index) return kNone;
    if (*index < size) return static_cast<std::int32_t>(*index);
    doc.warn("W0306", object, key,
             "refers to " + std::string(what) + " " + std::to_string(*index) + " of " + std::to_string(size) +
                 "; ignored");
    return kNone;
}

Node read_node(Document& doc, const Json& json, std::size_t node_count) {
    const auto count = [&](std::string_view list) { return doc.list(doc.root(), list).size(); };
    Node node;
    node.json = &json;
    read_transform(doc, node);
    if (const auto mesh = doc.index(json, "mesh", count("meshes"), "mesh"))
        node.mesh = static_cast<std::int32_t>(*mesh);
    if (const auto skin = doc.index(json, "skin", count("skins"), "skin")) node.skin = static_cast<std::int32_t>(*skin);
    node.camera = optional_index(doc, json, "camera", count("cameras"), "camera");
    if (const Json* use = doc.extension(json, "KHR_lights_punctual")) {
        const Json* lights = doc.extension(doc.root(), "KHR_lights_punctual");
        node.light = optional_index(doc, *use, "light", lights ? doc.list(*lights, "lights").size() : 0, "light");
    }
    if (const Json* visibility = doc.extension(json, "KHR_node_visibility"))
        node.visible = doc.bool_or(*visibility, "visible", true);
    for (const Json& child : doc.list(json, "children"))
        node.children.push_back(doc.as_index(child, node_count, "node"));
    for (const Json& weight : doc.list(json, "weights")) {
        if (!weight.is_number()) doc.fail("E0303", weight, {}, "is not a number");
        node.weights.push_back(static_cast<float>(weight.get<double>()));
    }
    return node;
}

std::vector<std::uint32_t> parentless(std::span<const Node> nodes) {
    std::vector<std::uint32_t> roots;
    for (std::size_t i = 0; i < nodes.size(); ++i)
        if (nodes[i].parent == kNone) roots.push_back(static_cast<std::uint32_t>(i));
    return roots;
}

} // namespace

Quaternion normalize(Quaternion q) {
    const double length = std::sqrt(q.x * q.x + q.y * q.y + q.z * q.z + q.w * q.w);
    if (!(length > 0) || !std::isfinite(length)) return {};
    return {q.x / length, q.y / length, q.z / length, q.w / length};
}

Affine3d compose(Vec3d translation, Quaternion q, Vec3d scale) {
    const double xx = q.x * q.x, yy = q.y * q.y, zz = q.z * q.z;
    const double xy = q.x * q.y, xz = q.x * q.z, yz = q.y * q.z;
    const double wx = q.w * q.x, wy = q.w * q.y, wz = q.w * q.z;
    return {Vec3d{1 - 2 * (yy + zz), 2 * (xy + wz), 2 * (xz - wy)} * scale.x,
            Vec3d{2 * (xy - wz), 1 - 2 * (xx + zz), 2 * (yz + wx)} * scale.y,
            Vec3d{2 * (xz + wy), 2 * (yz - wx), 1 - 2 * (xx + yy)} * scale.z, translation};
}

Affine3d Node::parent_from_node() const { return has_matrix ? matrix : compose(translation, rotation, scale); }

std::vector<Node> read_nodes(Document& doc) {
    const std::span<const Json> list = doc.list_of_objects(doc.root(), "nodes");
    std::vector<Node> nodes;
    nodes.reserve(list.size());
    for (const Json& json : list) nodes.push_back(read_node(doc, json, list.size()));
    for (std::size_t i = 0; i < nodes.size(); ++i) {
        const std::vector<std::uint32_t>& children = nodes[i].children;
        for (std::size_t k = 0; k < children.size(); ++k) {
            Node& child = nodes[children[k]];
            if (child.parent != kNone)
                doc.fail("E0309", *nodes[i].json, "children/" + std::to_string(k),
                         "node " + std::to_string(children[k]) + " has two parents, " + std::to_string(child.parent) +
                             " and " + std::to_string(i) + "; glTF nodes form a tree");
            child.parent = static_cast<std::int32_t>(i);
        }
    }
    // With at most one parent each, whatever no root leads to runs in a circle.
    std::vector<std::uint8_t> reached(nodes.size(), 0);
    for (const std::uint32_t i : depth_first(nodes, parentless(nodes))) reached[i] = 1;
    const auto lost = std::find(reached.begin(), reached.end(), 0);
    if (lost != reached.end()) {
        const auto i = static_cast<std::size_t>(lost - reached.begin());
        doc.fail("E0309", *nodes[i].json, {},
                 "node " + std::to_string(i) + " is its own ancestor (its parent is node " +
                     std::to_string(nodes[i].parent) + "); glTF nodes form a tree");
    }
    return nodes;
}

std::vector<std::uint32_t> depth_first(std::span<const Node> nodes, std::span<const std::uint32_t> roots) {
    std::vector<std::uint32_t> order, stack(roots.rbegin(), roots.rend());
    order.reserve(nodes.size());
    while (!stack.empty()) {
        const std::uint32_t i = stack.back();
        stack.pop_back();
        order.push_back(i);
        stack.insert(stack.end(), nodes[i].children.rbegin(), nodes[i].children.rend());
    }
    return order;
}

std::vector<std::uint32_t> scene_roots(Document& doc, std::span<const Node> nodes) {
    const std::span<const Json> scenes = doc.list_of_objects(doc.root(), "scenes");
    const std::uint32_t scene = doc.index(doc.root(), "scene", scenes.size(), "scene").value_or(0);
    if (scenes.empty()) return parentless(nodes);

    std::vector<std::uint32_t> roots;
    std::vector<std::uint8_t> listed(nodes.size(), 0);
    for (const Json& entry : doc.list(scenes[scene], "nodes")) {
        const std::uint32_t i = doc.as_index(entry, nodes.size(), "node");
        if (listed[i]) {
            doc.warn("W0305", entry, {}, "node " + std::to_string(i) + " is listed twice; it is drawn once");
            continue;
        }
        listed[i] = 1;
        roots.push_back(i);
    }
    // A listed node below another listed one would be drawn twice.
    std::vector<std::uint8_t> covered(nodes.size(), 0);
    for (const std::uint32_t i : depth_first(nodes, parentless(nodes)))
        if (const std::int32_t parent = nodes[i].parent; parent != kNone)
            covered[i] = covered[std::size_t(parent)] | listed[std::size_t(parent)];
    std::erase_if(roots, [&](std::uint32_t i) {
        if (nodes[i].parent != kNone)
            doc.warn("W0305", scenes[scene], "nodes",
                     "node " + std::to_string(i) + " is no root; it has the parent " + std::to_string(nodes[i].parent));
        return covered[i] != 0;
    });
    return roots;
}

std::vector<Affine3d> world_transforms(std::span<const Node> nodes) {
    std::vector<Affine3d> world(nodes.size());
    for (const std::uint32_t i : depth_first(nodes, parentless(nodes))) {
        const Node& node = nodes[i];
        const Affine3d local = node.parent_from_node();
        world[i] = node.parent == kNone ? local : world[std::size_t(node.parent)] * local;
    }
    return world;
}

std::vector<Affine3d> read_instances(const Document& doc, std::span<const Accessor> accessors, const Json& node) {
    const Json* extension = doc.extension(node, "EXT_mesh_gpu_instancing");
    if (!extension) return {};
    const Json* attributes = doc.object(*extension, "attributes");
    if (!attributes) doc.fail("E0303", *extension, {}, "has no \"attributes\", which the extension requires");

    std::uint64_t count = 0;
    const auto find = [&](std::string_view key, int components) -> const Accessor* {
        const auto index = doc.index(*attributes, key, accessors.size(), "accessor");
        if (!index) return nullptr;
        const Accessor& a = accessors[*index];
        if (a.components != components)
            doc.fail("E0303", *a.json, "type", "does not fit the instance attribute " + std::string(key));
        if (count != 0 && count != a.count)
            doc.fail("E0303", *attributes, key,
                     "has " + std::to_string(a.count) + " elements, another attribute has " + std::to_string(count));
        count = a.count;
        return &a;
    };
    const Accessor* translation = find("TRANSLATION", 3);
    const Accessor* rotation = find("ROTATION", 4);
    const Accessor* scale = find("SCALE", 3);

    std::vector<Affine3d> instances;
    instances.reserve(count);
    for (std::size_t i = 0; i < count; ++i) {
        float t[3] = {0, 0, 0}, r[4] = {0, 0, 0, 1}, s[3] = {1, 1, 1};
        if (translation) read_floats(*translation, i, 1, 3, t);
        if (rotation) read_floats(*rotation, i, 1, 4, r);
        if (scale) read_floats(*scale, i, 1, 3, s);
        instances.push_back(
            compose({t[0], t[1], t[2]}, normalize(Quaternion{r[0], r[1], r[2], r[3]}), {s[0], s[1], s[2]}));
    }
    return instances;
}

std::string_view raw_name(const Json& json) {
    const Json* name = Document::find(json, "name");
    return name && name->is_string() ? std::string_view(name->get_ref<const std::string&>()) : std::string_view{};
}

std::string without_nul(std::string_view name) {
    std::string clean;
    for (const char c : name) {
        if (c == '\0')
            clean += "\xEF\xBF\xBD";
        else
            clean += c;
    }
    return clean;
}

} // namespace porthole::gltf
