// What the JSON of a primitive says, checked.
#include <algorithm>

#include "porthole/io/gltf_mesh.h"

namespace porthole::gltf {
namespace {

// The accessor that `key` of `object` names, if it is there; its type must be one of `types`
// (component counts).
const Accessor* find_accessor(const Document& doc, std::span<const Accessor> accessors, const Json& object,
                              std::string_view key, std::initializer_list<int> types) {
    const auto index = doc.index(object, key, accessors.size(), "accessor");
    if (!index) return nullptr;
    const Accessor& accessor = accessors[*index];
    if (std::find(types.begin(), types.end(), accessor.components) == types.end()) {
        const char* expected[] = {"", "SCALAR", "VEC2", "VEC3", "VEC4"};
        std::string list;
        for (const int type : types) list += (list.empty() ? "" : " or ") + std::string(expected[type]);
        doc.fail("E0303", *accessor.json, "type",
                 "is \"" + shortened(doc.string_or(*accessor.json, "type")) + "\", but " + std::string(key) +
                     " must be " + list);
    }
    return &accessor;
}

bool is_index_type(Component c) { return c == Component::u8 || c == Component::u16 || c == Component::u32; }

Attributes read_attributes(const Document& doc, std::span<const Accessor> accessors, const Json& json) {
    if (!json.is_object()) doc.fail("E0303", json, {}, "expected an object of attributes");
    Attributes a;
    a.position = find_accessor(doc, accessors, json, "POSITION", {3});
    a.normal = find_accessor(doc, accessors, json, "NORMAL", {3});
    a.tangent = find_accessor(doc, accessors, json, "TANGENT", {3, 4}); // VEC3 in morph targets
    a.uv[0] = find_accessor(doc, accessors, json, "TEXCOORD_0", {2});
    a.uv[1] = find_accessor(doc, accessors, json, "TEXCOORD_1", {2});
    a.color = find_accessor(doc, accessors, json, "COLOR_0", {3, 4});
    for (int n = 0;; ++n) {
        const Accessor* joints = find_accessor(doc, accessors, json, "JOINTS_" + std::to_string(n), {4});
        const Accessor* weights = find_accessor(doc, accessors, json, "WEIGHTS_" + std::to_string(n), {4});
        if (!joints || !weights) break;
        if (!is_index_type(joints->component))
            doc.fail("E0303", *joints->json, "componentType", "joint numbers must be unsigned integers");
        a.joints.push_back(joints);
        a.weights.push_back(weights);
    }
    return a;
}

void drop_unequal(Document& doc, const Json& json, const Accessor*& accessor, std::uint64_t vertices,
                  const char* name) {
    if (!accessor || accessor->count == vertices) return;
    doc.warn("W0307", json, name,
             "has " + std::to_string(accessor->count) + " elements, POSITION has " + std::to_string(vertices) +
                 "; the attribute is ignored");
    accessor = nullptr;
}

void drop_unequal(Document& doc, const Json& json, Attributes& a, std::uint64_t vertices) {
    drop_unequal(doc, json, a.position, vertices, "POSITION");
    drop_unequal(doc, json, a.normal, vertices, "NORMAL");
    drop_unequal(doc, json, a.tangent, vertices, "TANGENT");
    drop_unequal(doc, json, a.uv[0], vertices, "TEXCOORD_0");
    drop_unequal(doc, json, a.uv[1], vertices, "TEXCOORD_1");
    drop_unequal(doc, json, a.color, vertices, "COLOR_0");
    for (std::size_t n = 0; n < a.joints.size(); ++n) {
        drop_unequal(doc, json, a.joints[n], vertices, "JOINTS");
        drop_unequal(doc, json, a.weights[n], vertices, "WEIGHTS");
    }
    if (std::count(a.joints.begin(), a.joints.end(), nullptr) +
        std::count(a.weights.begin(), a.weights.end(), nullptr)) {
        a.joints.clear();
        a.weights.clear();
    }
}

} // namespace

std::vector<Primitive> read_primitives(Document& doc, std::span<const Accessor> accessors, std::uint32_t mesh) {
    const Json& mesh_json = doc.list(doc.root(), "meshes")[mesh];
    const std::span<const Json> list = doc.list_of_objects(mesh_json, "primitives");
    if (list.empty()) doc.warn("W0302", mesh_json, "primitives", "is empty or missing; the mesh draws nothing");
    const std::size_t materials = doc.list(doc.root(), "materials").size();

    std::vector<Primitive> primitives;
    primitives.reserve(list.size());
    for (const Json& json : list) {
        Primitive& p = primitives.emplace_back();
        p.json = &json;
        switch (const std::uint64_t mode = doc.uint_or(json, "mode", 4)) {
        case 0:
        case 1:
        case 2:
        case 3:
            p.topology = Topology::none;
            doc.warn("W0302", json, {},
                     std::string("draws ") + (mode == 0 ? "points" : "lines") + ", which are left out");
            continue;
        case 4: p.topology = Topology::triangles; break;
        case 5: p.topology = Topology::strip; break;
        case 6: p.topology = Topology::fan; break;
        default: doc.fail("E0303", json, "mode", "is " + std::to_string(mode) + ", expected 0 to 6");
        }
        const Json* attributes = doc.object(json, "attributes");
        if (!attributes) doc.fail("E0303", json, {}, "has no \"attributes\", which glTF requires");
        p.attributes = read_attributes(doc, accessors, *attributes);
        if (!p.attributes.position) doc.fail("E0303", *attributes, {}, "has no POSITION, so there is nothing to draw");
        if (const auto material = doc.index(json, "material", materials, "material"))
            p.material = static_cast<std::int32_t>(*material);
        for (const Json& target : doc.list_of_objects(json, "targets"))
            p.targets.push_back(read_attributes(doc, accessors, target));

        p.indices = find_accessor(doc, accessors, json, "indices", {1});
        if (p.indices && !is_index_type(p.indices->component))
            doc.fail("E0303", *p.indices->json, "componentType",
                     "is " + std::to_string(unsigned(p.indices->component)) +
                         ", but indices must be 5121, 5123 or 5125");
    }
    return primitives;
}

void settle_counts(Document& doc, Primitive& p) {
    p.vertices = p.attributes.position->count;
    drop_unequal(doc, (*p.json)["attributes"], p.attributes, p.vertices);
    for (std::size_t t = 0; t < p.targets.size(); ++t)
        drop_unequal(doc, (*p.json)["targets"][t], p.targets[t], p.vertices);
    if (p.vertices > 0xFFFFFFF0u)
        doc.fail_limit(*p.json, {}, "has " + std::to_string(p.vertices) + " vertices, over the limit of 2^32");

    p.corners = p.indices ? p.indices->count : p.vertices;
    if (p.topology == Topology::triangles) {
        p.triangles = p.corners / 3;
        if (p.corners % 3 != 0)
            doc.warn("W0301", *p.json, {},
                     std::to_string(p.corners) + " corners are no whole number of triangles; the rest is left out");
    } else {
        p.triangles = p.corners < 3 ? 0 : p.corners - 2;
    }
    if (p.triangles == 0) doc.warn("W0301", *p.json, {}, "has no triangle");
}

} // namespace porthole::gltf
