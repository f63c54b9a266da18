#include "porthole/io/scene_json.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <initializer_list>
#include <map>
#include <optional>
#include <utility>

#include "porthole/io/gltf_json.h"
#include "porthole/io/reader.h"

namespace porthole {

namespace {

using gltf::Document;
using gltf::Json;
using gltf::shortened;

constexpr const char* kMark = "porthole_scene";
constexpr double kSmallest = 1e-6, kLargest = 1e6; ///< of lengths, metres, and of scales
constexpr int kMaxGroups = 64;                     ///< groups in each other

struct Range {
    double low, high;
};
constexpr const char* kShapeKeys[] = {"sphere", "box",   "cylinder",     "cone",
                                      "torus",  "union", "intersection", "difference"};
constexpr Range kLength{kSmallest, kLargest}, kPlace{-kLargest, kLargest}, kShare{0, 1};

std::string text_of(double value) {
    char text[32];
    std::snprintf(text, sizeof text, "%.9g", value);
    return text;
}

/// Cosine and sine of an angle in degrees, exact for right angles.
Vec2d turn(double degrees) {
    const double rest = std::remainder(degrees, 360);
    if (rest == 0) return {1, 0};
    if (std::abs(rest) == 180) return {-1, 0};
    if (std::abs(rest) == 90) return {0, rest > 0 ? 1.0 : -1.0};
    const double radians = rest * (3.14159265358979323846 / 180);
    return {std::cos(radians), std::sin(radians)};
}

struct SceneReader {
    Document doc;
    const std::string& file;
    const LoadParams& params;
    const Control& control;
    Scene scene;
    std::map<std::string, std::uint32_t, std::less<>> material_by_name;
    std::optional<std::uint32_t> plain; ///< material of parts that name none
    std::vector<std::vector<std::string>> chains;
    std::uint64_t bytes = 0;

    /// @throws Error E1002 unless `json` is an object with none but these keys and comments.
    void check_keys(const Json& json, std::initializer_list<const char*> keys) const {
        if (!json.is_object())
            doc.fail("E1002", json, {}, std::string("is of type ") + json.type_name() + ", expected object");
        for (const auto& [key, value] : json.items()) {
            if (key == "comment" || std::ranges::find(keys, key) != keys.end()) continue;
            std::string known;
            for (const char* k : keys) known += (known.empty() ? "" : ", ") + std::string(k);
            doc.fail("E1002", value, {}, "is not known here; the keys are: " + known + ", comment");
        }
    }
    [[nodiscard]] const Json& need(const Json& object, const char* key) const {
        const Json* value = Document::find(object, key);
        if (!value) doc.fail("E1002", object, {}, std::string("has no \"") + key + "\"");
        return *value;
    }
    [[nodiscard]] double number(const Json& value, Range range) const {
        if (!value.is_number())
            doc.fail("E1002", value, {}, std::string("is of type ") + value.type_name() + ", expected number");
        const auto v = value.get<double>();
        if (!(v >= range.low && v <= range.high))
            doc.fail("E1003", value, {},
                     "is " + text_of(v) + ", expected " + text_of(range.low) + " to " + text_of(range.high));
        return v;
    }
    [[nodiscard]] double number_or(const Json& object, const char* key, double fallback, Range range) const {
        const Json* value = Document::find(object, key);
        return value ? number(*value, range) : fallback;
    }
    [[nodiscard]] Vec3d vector(const Json& value, Range range) const {
        if (!value.is_array() || value.size() != 3)
            doc.fail("E1002", value, {},
                     std::string("is of type ") + value.type_name() +
                         (value.is_array() ? " with " + std::to_string(value.size()) + " values" : "") +
                         ", expected array of three numbers");
        return {number(value[0], range), number(value[1], range), number(value[2], range)};
    }
    /// Three numbers, or one for all.
    [[nodiscard]] Vec3d vector_or_number(const Json& value, Range range) const {
        if (value.is_array()) return vector(value, range);
        const double v = number(value, range);
        return {v, v, v};
    }
    [[nodiscard]] std::string text(const Json& value) const {
        if (!value.is_string())
            doc.fail("E1002", value, {}, std::string("is of type ") + value.type_name() + ", expected string");
        return value.get_ref<const std::string&>();
    }
    [[nodiscard]] std::string text_or(const Json& object, const char* key) const {
        const Json* value = Document::find(object, key);
        return value ? text(*value) : std::string();
    }
    /// The members of the array `key`; none if it is absent.
    [[nodiscard]] std::span<const Json> list(const Json& object, const char* key) const {
        const Json* value = Document::find(object, key);
        if (!value) return {};
        if (!value->is_array())
            doc.fail("E1002", *value, {}, std::string("is of type ") + value->type_name() + ", expected array");
        return value->get_ref<const Json::array_t&>();
    }

    /// Three linear values, or "#rrggbb" as in web pages.
    [[nodiscard]] Vec3f color(const Json& value, Range range) const {
        if (!value.is_string()) return Vec3f(vector(value, range));
        const std::string hex = text(value);
        if (hex.size() != 7 || hex[0] != '#' || hex.find_first_not_of("0123456789abcdefABCDEF", 1) != std::string::npos)
            doc.fail("E1002", value, {}, "is \"" + shortened(hex) + "\", expected \"#rrggbb\" or three numbers");
        const auto channel = [&](std::size_t at) { return float(std::stoi(hex.substr(at, 2), nullptr, 16)) / 255.0f; };
        return linear_color({channel(1), channel(3), channel(5)});
    }

    void read_materials() {
        const Json* all = Document::find(doc.root(), "materials");
        if (!all) return;
        if (!all->is_object())
            doc.fail("E1002", *all, {}, std::string("is of type ") + all->type_name() + ", expected object");
        for (const auto& [name, json] : all->items()) {
            check_keys(json, {"color", "metallic", "roughness", "alpha", "transmission", "ior", "emission"});
            Material material = plain_material();
            material.name = name;
            if (const Json* c = Document::find(json, "color")) {
                const Vec3f rgb = color(*c, kShare);
                material.base_color = {rgb.x, rgb.y, rgb.z, 1};
            }
            material.metallic = float(number_or(json, "metallic", 0, kShare));
            material.roughness = float(number_or(json, "roughness", 0.6, kShare));
            material.base_color.w = float(number_or(json, "alpha", 1, kShare));
            if (material.base_color.w < 1) material.alpha_mode = AlphaMode::blend;
            material.transmission = float(number_or(json, "transmission", 0, kShare));
            material.ior = float(number_or(json, "ior", 1.5, {1, 4}));
            if (const Json* e = Document::find(json, "emission")) material.emissive = color(*e, {0, kLargest});
            // Primitives are bodies, so light bends in them; how thick they are the rays find out.
            if (material.transmission > 0) material.thickness = 1;
            material_by_name[name] = std::uint32_t(scene.materials.size());
            scene.materials.push_back(std::move(material));
        }
    }
    /// The material that `object` names, else the one that applies around it.
    [[nodiscard]] std::optional<std::uint32_t> material(const Json& object, std::optional<std::uint32_t> around) const {
        const Json* value = Document::find(object, "material");
        if (!value) return around;
        const std::string name = text(*value);
        const auto found = material_by_name.find(name);
        if (found == material_by_name.end())
            doc.fail("E1002", *value, {}, "names the material \"" + shortened(name) + "\", which is not there");
        return found->second;
    }
    [[nodiscard]] std::uint32_t material_index(std::optional<std::uint32_t> material) {
        if (material) return *material;
        if (!plain) {
            plain = std::uint32_t(scene.materials.size());
            scene.materials.push_back(plain_material());
        }
        return *plain;
    }

    /// Scaled, then turned about x, y and z in this order, then moved.
    [[nodiscard]] Affine3d placement(const Json& object) const {
        Affine3d m;
        if (const Json* scale = Document::find(object, "scale")) {
            const Vec3d s = vector_or_number(*scale, kPlace);
            for (int axis = 0; axis < 3; ++axis)
                if (!(std::abs(s[axis]) >= kSmallest))
                    doc.fail("E1003", *scale, {},
                             "flattens what it places: no scale may be below " + text_of(kSmallest));
            m = {{s.x, 0, 0}, {0, s.y, 0}, {0, 0, s.z}, {}};
        }
        if (const Json* rotate = Document::find(object, "rotate")) {
            const Vec3d degrees = vector(*rotate, {-3.6e5, 3.6e5});
            for (int axis = 0; axis < 3; ++axis) {
                const Vec2d t = turn(degrees[axis]);
                const int a = (axis + 1) % 3, b = (axis + 2) % 3;
                Affine3d turned;
                Vec3d* const column[3] = {&turned.x, &turned.y, &turned.z};
                (*column[a])[a] = t.x, (*column[a])[b] = t.y;
                (*column[b])[a] = -t.y, (*column[b])[b] = t.x;
                m = turned * m;
            }
        }
        if (const Json* translate = Document::find(object, "translate")) m.p = vector(*translate, kPlace);
        return m;
    }
    /// @throws Error E1003 where many placements together left what float coordinates can hold.
    void check_placement(const Json& at, const Affine3d& m) const {
        constexpr double kLeast = 1e-9, kMost = 1e9, kFlattest = 1e-3;
        double product = 1;
        for (const Vec3d& column : {m.x, m.y, m.z}) {
            const double l = length(column);
            if (!(l >= kLeast && l <= kMost))
                doc.fail("E1003", at, {},
                         "is scaled to " + text_of(l) + " by all placements together, expected 1e-09 to 1e+09");
            product *= l;
        }
        if (!(length(m.p) <= kMost))
            doc.fail("E1003", at, {}, "lies more than 1e9 m away after all placements together");
        if (!(std::abs(m.determinant()) > kFlattest * product))
            doc.fail("E1003", at, {}, "is flattened or sheared by its placements together");
    }

    /// Maps the unit axis -y..y to `from`..`to`, x and z to radius 1.
    [[nodiscard]] static Affine3d along(Vec3d from, Vec3d to, double radius) {
        const Vec3d half = (to - from) * 0.5, y = normalize(half);
        const Vec3d x = normalize(cross(y, std::abs(y.z) < 0.7 ? Vec3d{0, 0, 1} : Vec3d{1, 0, 0}));
        return {x * radius, half, cross(x, y) * radius, (from + to) * 0.5};
    }
    /// The placement of a unit cylinder or cone: of some height around y, or between two points.
    [[nodiscard]] Affine3d axis_placement(const Json& shape, double radius) const {
        if (!Document::find(shape, "from") && !Document::find(shape, "to")) {
            const double height = number(need(shape, "height"), kLength);
            return {{radius, 0, 0}, {0, 0.5 * height, 0}, {0, 0, radius}, {}};
        }
        if (Document::find(shape, "height"))
            doc.fail("E1002", shape, "height", "is given by \"from\" and \"to\" already");
        const Vec3d from = vector(need(shape, "from"), kPlace), to = vector(need(shape, "to"), kPlace);
        if (!(length(to - from) >= kSmallest)) doc.fail("E1003", shape, "to", "is at the same place as \"from\"");
        return along(from, to, radius);
    }

    [[nodiscard]] PrimitiveTree box(const Json& shape, const Affine3d& m, std::uint32_t material) const {
        check_keys(shape, {"size", "from", "to"});
        Vec3d half, center;
        if (const Json* size = Document::find(shape, "size")) {
            if (Document::find(shape, "from") || Document::find(shape, "to"))
                doc.fail("E1002", shape, {}, "has a \"size\", and \"from\" or \"to\" as well");
            half = vector_or_number(*size, kLength) * 0.5;
        } else {
            const Vec3d from = vector(need(shape, "from"), kPlace), to = vector(need(shape, "to"), kPlace);
            half = (to - from) * 0.5, center = (from + to) * 0.5;
            for (int axis = 0; axis < 3; ++axis)
                if (!(2 * half[axis] >= kSmallest))
                    doc.fail("E1003", need(shape, "to")[std::size_t(axis)], {},
                             "is not above the same number in \"from\"");
        }
        return make_primitive(PrimitiveKind::box, 0,
                              m * Affine3d{{half.x, 0, 0}, {0, half.y, 0}, {0, 0, half.z}, center}, material);
    }
    [[nodiscard]] PrimitiveTree cone(const Json& shape, const Affine3d& m, std::uint32_t material) const {
        check_keys(shape, {"radius", "top_radius", "height", "from", "to"});
        const double below = number(need(shape, "radius"), {0, kLargest});
        const double above = number_or(shape, "top_radius", 0, {0, kLargest});
        const double wide = std::max(below, above);
        if (!(wide >= kSmallest)) doc.fail("E1003", shape, "radius", "and \"top_radius\" are both 0");
        Affine3d place = axis_placement(shape, wide);
        // Half a turn about x puts the wider end below.
        if (above > below) place.y = -place.y, place.z = -place.z;
        return make_primitive(PrimitiveKind::frustum, std::min(below, above) / wide, m * place, material);
    }

    /// The solid of an object with one of the shape keys.
    /// @param m      its whole placement in the mesh
    /// @param depth  operations around it
    [[nodiscard]] PrimitiveTree solid(const Json& object, const Affine3d& m, std::optional<std::uint32_t> inherited,
                                      std::uint32_t depth) {
        if (depth >= kMaxTreeDepth)
            doc.fail("E1004", object, {}, "is nested deeper than " + std::to_string(kMaxTreeDepth) + " operations");
        const std::optional<std::uint32_t> its = material(object, inherited);
        const std::string key = shape_key(object);
        const Json& shape = need(object, key.c_str());
        if (key == "union" || key == "intersection" || key == "difference") {
            const auto operands = list(object, key.c_str());
            if (operands.empty()) doc.fail("E1002", shape, {}, "has no operands");
            std::vector<PrimitiveTree> children;
            std::size_t leaves = 0;
            for (const Json& operand : operands) {
                check_keys(operand, {"sphere", "box", "cylinder", "cone", "torus", "union", "intersection",
                                     "difference", "material", "translate", "rotate", "scale"});
                children.push_back(solid(operand, m * placement(operand), its, depth + 1));
                leaves += children.back().leaves.size();
                if (leaves > kMaxTreeLeaves)
                    doc.fail("E1004", shape, {}, "has more than " + std::to_string(kMaxTreeLeaves) + " primitives");
            }
            if (children.size() == 1) return std::move(children[0]);
            PrimitiveTree tree = combine(key == "union"          ? CsgOperation::unite
                                         : key == "intersection" ? CsgOperation::intersect
                                                                 : CsgOperation::subtract,
                                         children);
            if (tree.bounds().empty()) doc.fail("E1005", shape, {}, "has operands that do not meet: nothing is left");
            return tree;
        }

        const std::uint32_t with = material_index(its);
        PrimitiveTree tree;
        if (key == "sphere") {
            check_keys(shape, {"radius"});
            const double r = number(need(shape, "radius"), kLength);
            tree = make_primitive(PrimitiveKind::sphere, 0, m * Affine3d{{r, 0, 0}, {0, r, 0}, {0, 0, r}, {}}, with);
        } else if (key == "box") {
            tree = box(shape, m, with);
        } else if (key == "cylinder") {
            check_keys(shape, {"radius", "height", "from", "to"});
            const double r = number(need(shape, "radius"), kLength);
            tree = make_primitive(PrimitiveKind::frustum, 1, m * axis_placement(shape, r), with);
        } else if (key == "cone") {
            tree = cone(shape, m, with);
        } else {
            check_keys(shape, {"radius", "tube"});
            const double r = number(need(shape, "radius"), kLength);
            const double tube = number(need(shape, "tube"), {1e-4 * r, 0.9999 * r});
            tree =
                make_primitive(PrimitiveKind::torus, tube / r, m * Affine3d{{r, 0, 0}, {0, r, 0}, {0, 0, r}, {}}, with);
        }
        check_placement(object, tree.leaves[0].mesh_from_leaf);
        return tree;
    }
    /// The one shape key of an object.
    [[nodiscard]] std::string shape_key(const Json& object) const {
        std::string found;
        for (const char* key : kShapeKeys) {
            if (!Document::find(object, key)) continue;
            if (!found.empty()) doc.fail("E1002", object, key, "stands beside \"" + found + "\"; a part has one shape");
            found = key;
        }
        if (found.empty())
            doc.fail("E1002", object, {},
                     "has no shape: sphere, box, cylinder, cone, torus, union, intersection or difference");
        return found;
    }

    /// The parts of one group.
    void read_parts(std::span<const Json> parts, const Affine3d& world, std::optional<std::uint32_t> inherited,
                    std::vector<std::string>& chain) {
        if (int(chain.size()) > kMaxGroups)
            doc.fail("E1004", parts[0], {}, "is nested deeper than " + std::to_string(kMaxGroups) + " groups");
        std::map<std::string, std::pair<int, int>> groups; // by name: how many there are, and how many came
        for (const Json& json : parts) {
            check_keys(json, {"name", "parts", "sphere", "box", "cylinder", "cone", "torus", "union", "intersection",
                              "difference", "material", "translate", "rotate", "scale"});
            if (Document::find(json, "parts")) ++groups[text_or(json, "name")].first;
        }
        for (const Json& json : parts) {
            if (control.stop.stop_requested()) throw Cancelled{};
            const std::string name = text_or(json, "name");
            const Affine3d placed = world * placement(json);
            check_placement(json, placed);
            if (Document::find(json, "parts")) {
                for (const char* key : kShapeKeys)
                    if (Document::find(json, key)) doc.fail("E1002", json, key, "stands beside \"parts\"");
                const auto inner = list(json, "parts");
                if (inner.empty()) doc.fail("E1002", json, "parts", "is empty");
                auto& [all, came] = groups[name];
                chain.push_back(name.empty() || all > 1 ? name + '[' + std::to_string(came++) + ']' : name);
                read_parts(inner, placed, material(json, inherited), chain);
                chain.pop_back();
                continue;
            }
            add_part(json, name, placed, inherited);
            chains.push_back(chain);
            chains.back().push_back(name);
        }
    }
    void add_part(const Json& json, const std::string& name, const Affine3d& world,
                  std::optional<std::uint32_t> inherited) {
        Mesh mesh;
        mesh.name = name;
        mesh.primitives = solid(json, {}, inherited, 0);
        finish_mesh(mesh);
        bytes += sizeof(Mesh) + sizeof(Part) +
                 mesh.primitives.leaves.size() * (sizeof(PrimitiveLeaf) + sizeof(PrimitiveNode));
        check_memory(bytes, params, file);
        scene.parts.push_back({name, {}, std::uint32_t(scene.meshes.size()), world});
        scene.meshes.push_back(std::move(mesh));
    }

    void read_cameras() {
        for (const Json& json : list(doc.root(), "cameras")) {
            check_keys(json, {"name", "position", "look_at", "up", "view_angle_deg", "half_height"});
            FileCamera camera;
            camera.name = text_or(json, "name");
            const Vec3d eye = vector(need(json, "position"), kPlace);
            const Json* above = Document::find(json, "up");
            const Vec3d z = normalize(eye - vector(need(json, "look_at"), kPlace), Vec3d{});
            const Vec3d x = normalize(cross(above ? vector(*above, kPlace) : Vec3d{0, 1, 0}, z), Vec3d{});
            if (!(length(z) > 0.5)) doc.fail("E1003", json, "look_at", "is where the camera is");
            if (!(length(x) > 0.5))
                doc.fail("E1003", json, {}, "looks along its own \"up\", which is [0, 1, 0] if not given");
            camera.world_from_camera = {x, cross(z, x), z, eye};
            if (const Json* half = Document::find(json, "half_height")) {
                if (Document::find(json, "view_angle_deg"))
                    doc.fail("E1002", json, "half_height", "is for orthographic cameras, which have no angle");
                camera.orthographic = true;
                camera.half_height = float(number(*half, kLength));
            } else {
                camera.fov_y = float(number_or(json, "view_angle_deg", 30, {0.1, 170}) * double(kPi) / 180);
            }
            scene.cameras.push_back(std::move(camera));
        }
    }
    void read_lights() {
        for (const Json& json : list(doc.root(), "lights")) {
            Light light;
            const std::string kind = text(need(json, "type"));
            if (kind == "directional") {
                check_keys(json, {"type", "name", "color", "intensity", "direction"});
                light.kind = Light::Kind::directional;
                light.direction = Vec3f(normalize(vector(need(json, "direction"), kPlace), Vec3d{}));
                if (!(length(light.direction) > 0.5f)) doc.fail("E1003", json, "direction", "has no length");
            } else if (kind == "point") {
                check_keys(json, {"type", "name", "color", "intensity", "position"});
                light.kind = Light::Kind::point;
                light.position = Vec3f(vector(need(json, "position"), kPlace));
            } else {
                doc.fail("E1002", json, "type", "is \"" + shortened(kind) + "\", expected directional or point");
            }
            light.name = text_or(json, "name");
            if (const Json* c = Document::find(json, "color")) light.color = color(*c, kShare);
            light.intensity = float(number_or(json, "intensity", 1, {0, 1e9}));
            scene.lights.push_back(std::move(light));
        }
    }

    void read() {
        const Json& root = doc.root();
        if (!root.is_object() || !Document::find(root, kMark))
            throw Error(ErrorKind::input, "E1001", file, std::string("is no scene: \"") + kMark + "\": 1 is missing");
        if (const Json& version = need(root, kMark); !version.is_number() || version.get<double>() != 1)
            doc.fail("E1001", version, {}, "is no version of the format that is read; expected 1");
        check_keys(root, {kMark, "materials", "parts", "cameras", "lights"});
        read_materials();
        const auto parts = list(root, "parts");
        if (parts.empty()) doc.fail("E1002", root, {}, "has no \"parts\"");
        std::vector<std::string> chain;
        read_parts(parts, {}, std::nullopt, chain);
        assign_paths(scene, chains);
        read_cameras();
        read_lights();
        scene.format = "scene";
    }
};

} // namespace

bool has_scene_mark(std::string_view text) {
    return text.substr(0, 4096).find('"' + std::string(kMark) + '"') != std::string_view::npos;
}

Scene read_scene_json(const FileBytes& bytes, const std::filesystem::path& path, const LoadParams& params,
                      const Control& control) {
    std::string_view text = bytes.text();
    if (text.starts_with("\xEF\xBB\xBF")) text.remove_prefix(3);
    const std::string file = path.string();
    Json root;
    try {
        root = gltf::parse_json(text, file, bytes.text().size() - text.size(), params.max_bytes);
    } catch (const Error& error) {
        if (error.code != "E0302") throw;
        throw Error(error.kind, "E1001", error.where, error.what());
    }
    SceneReader reader{Document(file, std::move(root)), file, params, control, {}, {}, {}, {}, 0};
    reader.read();
    return std::move(reader.scene);
}

} // namespace porthole
