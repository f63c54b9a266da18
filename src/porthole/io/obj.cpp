#include "porthole/io/obj.h"

#include <algorithm>
#include <cstring>
#include <set>
#include <unordered_map>

#include "porthole/io/mtl.h"
#include "porthole/io/obj_parse.h"
#include "porthole/io/polygon.h"
#include "porthole/io/reader.h"

namespace porthole {
namespace {

constexpr std::uint32_t kNoVertex = 0xFFFFFFFFu;

/// Makes one mesh after the other of the faces of a part.
class MeshBuilder {
public:
    MeshBuilder(ObjData& data, const std::vector<std::uint32_t>& scene_material)
        : data_(data), scene_material_(scene_material), newest_(data.positions.size(), kNoVertex) {}

    /// @param runs  the part's runs, by index into ObjData::runs.
    Mesh build(const std::vector<std::uint32_t>& runs);
    [[nodiscard]] std::uint64_t polygons_given_up() const { return triangulator_.gave_up(); }

private:
    void add_face(std::uint32_t face);
    std::uint32_t local_vertex(ObjCorner c);

    ObjData& data_;
    const std::vector<std::uint32_t>& scene_material_;
    Triangulator triangulator_;
    Mesh mesh_;
    // Vertices of the mesh made from one file vertex form a chain from newest_[v].
    std::vector<std::uint32_t> newest_, older_;
    std::vector<ObjCorner> made_from_;
    std::vector<std::uint32_t> face_;
    std::vector<Vec3f> face_points_;
    bool has_uv_ = false, lacks_normal_ = false;
};

Mesh MeshBuilder::build(const std::vector<std::uint32_t>& runs) {
    mesh_ = {};
    older_.clear();
    made_from_.clear();
    has_uv_ = lacks_normal_ = false;

    // One submesh per material, in the order of their first use.
    std::vector<std::uint32_t> materials;
    std::unordered_map<std::uint32_t, std::size_t> rank;
    for (const std::uint32_t r : runs)
        if (rank.emplace(data_.runs[r].material, materials.size()).second) materials.push_back(data_.runs[r].material);
    std::vector<std::uint32_t> sorted = runs;
    std::stable_sort(sorted.begin(), sorted.end(), [&](std::uint32_t a, std::uint32_t b) {
        return rank[data_.runs[a].material] < rank[data_.runs[b].material];
    });
    for (std::size_t i = 0; i < sorted.size();) {
        const std::uint32_t material = data_.runs[sorted[i]].material;
        Submesh submesh{std::uint32_t(mesh_.triangles.size()), 0, scene_material_[material]};
        for (; i < sorted.size() && data_.runs[sorted[i]].material == material; ++i) {
            const std::size_t next = sorted[i] + std::size_t(1);
            const auto end =
                next < data_.runs.size() ? data_.runs[next].first_face : std::uint32_t(data_.face_end.size());
            for (std::uint32_t face = data_.runs[sorted[i]].first_face; face < end; ++face) add_face(face);
        }
        submesh.triangle_count = std::uint32_t(mesh_.triangles.size()) - submesh.first_triangle;
        mesh_.submeshes.push_back(submesh);
    }

    if (!has_uv_) mesh_.uv[0].clear();
    if (lacks_normal_) fill_missing_normals(mesh_);
    for (const ObjCorner& c : made_from_) newest_[std::size_t(c.v)] = kNoVertex;
    drop_slack(mesh_);
    return std::move(mesh_);
}

void MeshBuilder::add_face(std::uint32_t face) {
    const std::uint32_t first = face == 0 ? 0 : data_.face_end[face - 1];
    const std::uint32_t end = data_.face_end[face];
    for (std::uint32_t i = first; i < end; ++i) {
        const auto v = std::size_t(data_.corners[i].v);
        if (v < data_.positions.size()) continue;
        return data_.bad_faces.note(data_.line_of(face), "index " + std::to_string(v + 1) + " where " +
                                                             std::to_string(data_.positions.size()) + " are defined");
    }
    face_.clear();
    for (std::uint32_t i = first; i < end; ++i) face_.push_back(local_vertex(data_.corners[i]));
    if (face_.size() == 3) {
        mesh_.triangles.push_back({face_[0], face_[1], face_[2]});
        return;
    }
    face_points_.clear();
    for (const std::uint32_t v : face_) face_points_.push_back(mesh_.positions[v]);
    for (const Vec3u t : triangulator_.triangulate(face_points_))
        mesh_.triangles.push_back({face_[t.x], face_[t.y], face_[t.z]});
}

std::uint32_t MeshBuilder::local_vertex(ObjCorner c) {
    if (c.vt >= 0 && std::size_t(c.vt) >= data_.uvs.size()) {
        data_.bad_references.note(0, "texture coordinate " + std::to_string(c.vt + 1) + " where " +
                                         std::to_string(data_.uvs.size()) + " are defined");
        c.vt = -1;
    }
    if (c.vn >= 0 && std::size_t(c.vn) >= data_.normals.size()) {
        data_.bad_references.note(0, "normal " + std::to_string(c.vn + 1) + " where " +
                                         std::to_string(data_.normals.size()) + " are defined");
        c.vn = -1;
    }
    // A hub of a fan may have thousands of different corners: past some, sharing is not worth
    // the search.
    int steps = 0;
    for (std::uint32_t i = newest_[std::size_t(c.v)]; i != kNoVertex && steps < 32; i = older_[i], ++steps)
        if (made_from_[i].vt == c.vt && made_from_[i].vn == c.vn) return i;

    const auto index = std::uint32_t(mesh_.positions.size());
    older_.push_back(std::exchange(newest_[std::size_t(c.v)], index));
    made_from_.push_back(c);
    mesh_.positions.push_back(data_.positions[std::size_t(c.v)]);
    if (!data_.colors.empty()) mesh_.colors.push_back(data_.colors[std::size_t(c.v)]);
    if (!data_.uvs.empty()) {
        // Images have their first row on top: v runs down.
        const Vec2f uv = c.vt < 0 ? Vec2f{} : data_.uvs[std::size_t(c.vt)];
        mesh_.uv[0].push_back({uv.x, 1.0f - uv.y});
        has_uv_ = has_uv_ || c.vt >= 0;
    }
    if (!data_.normals.empty()) {
        const Vec3f n = c.vn < 0 ? Vec3f{} : normalize(data_.normals[std::size_t(c.vn)], Vec3f{});
        mesh_.normals.push_back(n);
        lacks_normal_ = lacks_normal_ || n == Vec3f{};
    }
    return index;
}

// ---------------------------------------------------------------- material libraries

/// Every material that the file's libraries define, by name; the first definition counts.
struct Library {
    std::vector<std::vector<MtlMaterial>> files;
    std::unordered_map<std::string, const MtlMaterial*> by_name;
};

Library read_libraries(const ObjData& data, const std::filesystem::path& path, WarningLog& log) {
    Library library;
    std::set<std::filesystem::path> seen;
    std::set<std::string, std::less<>> seen_names;
    const auto read = [&](std::string_view name, const std::string& where) {
        const std::filesystem::path file = resolve_beside(path, name, where);
        if (!seen.insert(file).second) return;
        std::error_code failure;
        if (std::filesystem::equivalent(file, path, failure))
            throw Error(ErrorKind::input, "E0410", where, "the material library is the model itself");
        const FileBytes bytes(file);
        if (std::memchr(bytes.text().data(), 0, bytes.text().size()))
            throw Error(ErrorKind::input, "E0410", where, "the material library is not text");
        library.files.push_back(parse_mtl(bytes.text(), valid_utf8(file.string()), log));
    };
    const auto attempt = [&](std::string_view name, std::uint64_t line) {
        try {
            read(name, at_line(path.string(), line));
        } catch (const Error& error) {
            log.add("W0410", error.where, std::string("material library left out: ") + error.what());
        }
    };
    for (const auto& [text, line] : data.libraries) {
        if (!seen_names.insert(text).second) continue;
        // One name with blanks in it, or several names.
        bool whole = text.find_first_of(" \t") == std::string::npos;
        if (!whole) try {
                whole = !resolve_beside(path, text, "").empty();
            } catch (const Error&) {
            }
        if (whole) {
            attempt(text, line);
            continue;
        }
        for (std::size_t at = 0; at < text.size();) {
            const std::size_t first = text.find_first_not_of(" \t", at);
            if (first == std::string::npos) break;
            at = std::min(text.find_first_of(" \t", first), text.size());
            const std::string_view name = std::string_view(text).substr(first, at - first);
            if (seen_names.emplace(name).second) attempt(name, line);
        }
    }
    for (const std::vector<MtlMaterial>& file : library.files)
        for (const MtlMaterial& material : file) library.by_name.emplace(material.name, &material);
    return library;
}

/// Gives the scene the materials that faces use.
/// @return the scene's material for each of data.materials.
std::vector<std::uint32_t> make_materials(Scene& scene, const ObjData& data, const std::filesystem::path& path,
                                          const LoadParams& params, const Control& control, WarningLog& log) {
    const Library library = read_libraries(data, path, log);
    std::vector<std::uint8_t> wanted(data.materials.size(), 0);
    for (const ObjRun& run : data.runs) wanted[run.material] = 1;

    const MtlMaterial fallback;
    std::vector<const MtlMaterial*> used;
    std::unordered_map<const MtlMaterial*, std::uint32_t> index_of;
    std::vector<std::uint32_t> scene_material(data.materials.size(), 0);
    for (std::size_t i = 0; i < data.materials.size(); ++i) {
        if (!wanted[i]) continue;
        const auto found = library.by_name.find(data.materials[i]);
        const MtlMaterial* material = found == library.by_name.end() ? &fallback : found->second;
        if (material == &fallback && i > 0)
            log.add("W0411", at_line(path.string(), data.material_line[i]),
                    "material '" + escaped(data.materials[i], 80) + "' is not defined; drawn grey");
        const auto [entry, is_new] = index_of.emplace(material, std::uint32_t(used.size()));
        if (is_new) used.push_back(material);
        scene_material[i] = entry->second;
    }
    add_materials(scene, used, path, params, control, log);
    return scene_material;
}

// ---------------------------------------------------------------- names and messages

/// Names from the root to each part; objects that share a name are numbered, so that their
/// groups do not mix.
std::vector<std::vector<std::string>> name_chains(const ObjData& data, const std::string& stem) {
    std::unordered_map<std::string, std::uint32_t> count, next;
    for (const std::string& object : data.objects) ++count[object];
    std::vector<std::string> segment;
    for (const std::string& object : data.objects) {
        std::string name = valid_utf8(object);
        if (count[object] > 1 || name.empty()) name += '[' + std::to_string(next[object]++) + ']';
        segment.push_back(std::move(name));
    }
    std::vector<std::vector<std::string>> chains;
    for (const ObjPart& part : data.parts) {
        std::vector<std::string> chain;
        if (part.object >= 0) {
            const auto object = std::size_t(part.object);
            chain.push_back(part.group.empty() ? valid_utf8(data.objects[object]) : segment[object]);
        }
        if (!part.group.empty()) chain.push_back(valid_utf8(part.group));
        if (chain.empty()) chain.push_back(data.parts.size() == 1 ? stem : std::string());
        chains.push_back(std::move(chain));
    }
    return chains;
}

std::string first_at(const Fault& fault) {
    return fault.first + (fault.count > 1 ? " (and " + std::to_string(fault.count - 1) + " more)" : "");
}

void report_faults(const ObjData& data, const std::string& path, WarningLog& log) {
    const auto tell = [&](const char* code, const Fault& fault, const std::string& what) {
        if (fault.count == 0) return;
        log.add(code, fault.first_line ? at_line(path, fault.first_line) : path, what + ": " + first_at(fault));
    };
    tell("W0401", data.bad_vertices, "a vertex has no three finite numbers, faces with it are left out");
    tell("W0402", data.bad_faces, "face left out");
    tell("W0406", data.huge_faces, "an unlikely face, drawn all the same");
    tell("W0403", data.bad_references, "texture coordinate or normal left out");
    tell("W0405", data.not_drawn, "points, lines and free-form surfaces are not drawn");
    tell("W0407", data.commands, "commands in a model are never run");
    tell("W0408", data.unknown, "unknown statement");
}

/// @throws Error E0401, E0403 if nothing can come of the file.
void refuse_hopeless(const ObjData& data, const std::string& path) {
    if (data.face_statements == 0 && data.unknown.count > 0)
        throw Error(ErrorKind::input, "E0401", at_line(path, data.unknown.first_line),
                    "no faces found, and the line " + data.unknown.first + " is not OBJ; another kind of file?");
}

} // namespace

Scene read_obj(const FileBytes& file, const std::filesystem::path& path, const LoadParams& params,
               const Control& control) {
    const std::string name = path.string();
    const std::string_view text = file.text();
    if (text.starts_with("\xFE\xFF") || text.starts_with("\xFF\xFE"))
        throw Error(ErrorKind::input, "E0402", name, "the text is UTF-16; save it as UTF-8");
    if (const void* zero = text.empty() ? nullptr : std::memchr(text.data(), 0, text.size()))
        throw Error(ErrorKind::input, "E0402",
                    name + ":byte " + std::to_string(static_cast<const char*>(zero) - text.data()),
                    "a zero byte: an OBJ file is text");

    ObjData data = parse_obj(text, name, params, control);
    refuse_hopeless(data, name);
    WarningLog log;
    Scene scene;
    std::vector<std::uint32_t> scene_material;
    if (!data.parts.empty()) scene_material = make_materials(scene, data, path, params, control, log);

    std::vector<std::vector<std::uint32_t>> runs_of_part(data.parts.size());
    for (std::uint32_t r = 0; r < data.runs.size(); ++r) runs_of_part[data.runs[r].part].push_back(r);
    const std::vector<std::vector<std::string>> chains = name_chains(data, file_stem(path));
    MeshBuilder builder(data, scene_material);
    MeshRepair dropped;
    for (std::size_t i = 0; i < data.parts.size(); ++i) {
        if (control.stop.stop_requested()) throw Cancelled{};
        add_part(scene, builder.build(runs_of_part[i]), chains[i].back(), dropped);
    }
    assign_paths(scene, chains);

    report_faults(data, name, log);
    report_dropped(dropped, "W0404", name, log);
    if (builder.polygons_given_up())
        log.add("W0406", name,
                std::to_string(builder.polygons_given_up()) + " concave polygons are too large and cut roughly");
    if (triangle_count(scene) == 0 && (data.bad_faces.count || dropped.non_finite)) {
        const Fault& fault = data.bad_faces.count ? data.bad_faces : data.bad_vertices;
        throw Error(ErrorKind::input, "E0403", fault.first_line ? at_line(name, fault.first_line) : name,
                    "no face can be used: " + first_at(fault));
    }
    scene.format = "OBJ";
    scene.warnings = log.take(name);
    return scene;
}

} // namespace porthole
