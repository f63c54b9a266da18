// porthole parts: the model's tree.
#include <algorithm>
#include <cstdio>

#include <nlohmann/json.hpp>

#include "porthole/io/files.h"
#include "porthole/scene/solid.h"
#include "session.h"

namespace porthole::cli {

namespace {

struct Unit {
    const char* name;
    double metres;
};

/// The unit in which the model's size is a handy number.
Unit unit_for(double diagonal) {
    static constexpr Unit kUnits[] = {{"km", 1000}, {"m", 1}, {"mm", 1e-3}, {"um", 1e-6}, {"nm", 1e-9}};
    for (const Unit& unit : kUnits)
        if (diagonal >= unit.metres) return unit;
    return diagonal > 0 ? kUnits[4] : kUnits[1];
}

std::string in_unit(Vec3d size, Unit unit) {
    char text[96];
    std::snprintf(text, sizeof text, "%.3g x %.3g x %.3g %s", size.x / unit.metres, size.y / unit.metres,
                  size.z / unit.metres, unit.name);
    return text;
}

/// Names of the materials of a part, each once, in the order of the mesh.
std::vector<std::string> materials_of(const Scene& scene, const Part& part) {
    std::vector<std::uint32_t> seen;
    std::vector<std::string> names;
    for (const Submesh& run : scene.meshes[part.mesh].submeshes) {
        if (std::ranges::find(seen, run.material) != seen.end()) continue;
        seen.push_back(run.material);
        names.push_back(scene.materials[run.material].name);
    }
    return names;
}

std::string joined(const std::vector<std::string>& names, std::size_t limit) {
    std::string text;
    for (const std::string& name : names) text += (text.empty() ? "" : ", ") + (name.empty() ? "-" : escaped(name, 60));
    if (text.size() <= limit) return text;
    std::size_t end = limit - 3;
    while (end > 0 && (static_cast<unsigned char>(text[end]) & 0xC0u) == 0x80u) --end;
    return text.substr(0, end) + "...";
}

std::vector<std::string> segments_of(const std::string& path) {
    std::vector<std::string> out;
    for (std::size_t begin = 0;;) {
        const std::size_t slash = path.find('/', begin);
        out.push_back(path.substr(begin, slash - begin));
        if (slash == std::string::npos) return out;
        begin = slash + 1;
    }
}

/// What is worth knowing of the parts beyond the scene.
struct Facts {
    std::vector<MeshSolid> solids; ///< by mesh
    std::vector<Bounds3d> boxes;   ///< by part
    Bounds3d whole;
};

Facts find_facts(const Scene& scene, const Control& control) {
    Facts facts{find_solids(scene, {}, control), std::vector<Bounds3d>(scene.parts.size()), {}};
    parallel_for(scene.parts.size(), control,
                 [&](std::size_t i) { facts.boxes[i] = part_bounds(scene, PartId{std::uint32_t(i)}); });
    for (const Bounds3d& box : facts.boxes) facts.whole.extend(box);
    return facts;
}

const char* faces_of(const MeshSolid& solid) {
    return solid.closed ? "closed" : solid.has_material() ? "partly" : "open";
}

nlohmann::ordered_json reason_of(const MeshSolid& solid) {
    if (solid.by == ClosedBy::nothing) return nullptr;
    return solid.by == ClosedBy::edges ? "edges" : "rays";
}

std::string table(const Scene& scene, const Facts& facts) {
    const Bounds3d& whole = facts.whole;
    const Unit unit = unit_for(whole.diagonal());
    std::string text = escaped(scene.source) + ": " + scene.format + ", " +
                       with_commas(std::int64_t(scene.parts.size())) + " parts, " +
                       with_commas(std::int64_t(triangle_count(scene))) + " triangles, " + in_unit(whole.size(), unit) +
                       '\n';
    if (scene.parts.empty()) return text;
    const auto row = [&](const std::string& id, const std::string& triangles, const std::string& surface,
                         const std::string& size, const std::string& material, const std::string& name) {
        // Names may be longer than any buffer, so the last column is added as it is.
        char columns[192];
        std::snprintf(columns, sizeof columns, "%6s %11s  %-6s  %-26s  %-20s  ", id.c_str(), triangles.c_str(),
                      surface.c_str(), size.c_str(), material.c_str());
        text += columns + name + '\n';
    };
    row("id", "triangles", "faces", "size", "material", "part");
    std::vector<std::string> above; // groups that the last line stood in
    for (std::size_t i = 0; i < scene.parts.size(); ++i) {
        const Part& part = scene.parts[i];
        const std::vector<std::string> path = segments_of(part.path);
        std::size_t common = 0;
        while (common < above.size() && common + 1 < path.size() && above[common] == path[common]) ++common;
        above.assign(path.begin(), path.end() - 1);
        for (std::size_t k = common; k < above.size(); ++k)
            row("", "", "", "", "", std::string(2 * std::min<std::size_t>(k, 40), ' ') + escaped(above[k]) + '/');
        const Mesh& mesh = scene.meshes[part.mesh];
        // Primitives have no triangles: they are what their formulas say.
        row('#' + std::to_string(i),
            mesh.primitives.empty() ? with_commas(std::int64_t(mesh.triangles.size())) : "exact",
            faces_of(facts.solids[part.mesh]), in_unit(facts.boxes[i].size(), unit),
            joined(materials_of(scene, part), 20),
            std::string(2 * std::min<std::size_t>(above.size(), 40), ' ') + escaped(path.back()));
    }
    return text;
}

nlohmann::ordered_json numbers(Vec3d v) { return {v.x, v.y, v.z}; }

std::string as_json(const Scene& scene, const Facts& facts) {
    using Json = nlohmann::ordered_json;
    Json j;
    j["version"] = PORTHOLE_VERSION;
    j["command"] = "parts";
    j["model"] = {{"path", scene.source},
                  {"format", scene.format},
                  {"parts", scene.parts.size()},
                  {"triangles", triangle_count(scene)},
                  {"size_m", numbers(facts.whole.size())}};
    Json parts = Json::array();
    for (std::size_t i = 0; i < scene.parts.size(); ++i) {
        const Part& part = scene.parts[i];
        const MeshSolid& solid = facts.solids[part.mesh];
        const Closedness& c = solid.edges;
        const Bounds3d& box = facts.boxes[i];
        parts.push_back(
            {{"id", i},
             {"path", part.path},
             {"name", part.name},
             {"mesh", part.mesh},
             {"triangles", scene.meshes[part.mesh].triangles.size()},
             {"closed", solid.closed},
             {"by", reason_of(solid)},
             {"components",
              {{"all", solid.components}, {"closed", solid.closed_components}, {"flipped", solid.flipped_components}}},
             {"edges", {{"all", c.edges}, {"open", c.open_edges}, {"odd", c.odd_edges}}},
             {"size_m", numbers(box.size())},
             {"center_m", numbers(box.empty() ? Vec3d{} : box.center() + scene.origin)},
             {"materials", materials_of(scene, part)}});
    }
    j["parts"] = std::move(parts);
    j["cameras"] = Json::array();
    for (const FileCamera& camera : scene.cameras) j["cameras"].push_back(camera.name);
    j["warnings"] = Json::array();
    for (const Warning& w : scene.warnings)
        j["warnings"].push_back({{"code", w.code}, {"where", w.where}, {"reason", w.reason}});
    return j.dump(2, ' ', false, Json::error_handler_t::replace) + "\n";
}

} // namespace

int run_parts(const PartsOptions& options, Output& out, const Control& control) {
    const Scene scene = load(options.common, out, control);
    const Facts facts = find_facts(scene, control);
    print(options.json ? as_json(scene, facts) : table(scene, facts));
    return kExitDone;
}

} // namespace porthole::cli
