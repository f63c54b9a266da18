#include "porthole/io/reader.h"

#include <algorithm>
#include <type_traits>
#include <utility>

#include "porthole/base/tone.h"
#include "porthole/io/files.h"
#include "porthole/io/image_file.h"

namespace porthole {

std::string at_line(std::string_view path, std::uint64_t line) {
    return std::string(path) + ":" + std::to_string(line);
}

Vec3f linear_color(Vec3f srgb) {
    const auto linear = [](float v) { return v >= 0 && v <= 1 ? float(linear_from_srgb(double(v))) : v; };
    return {linear(srgb.x), linear(srgb.y), linear(srgb.z)};
}

std::string file_stem(const std::filesystem::path& path) {
    return path == "-" ? "model" : valid_utf8(path.stem().string());
}

void WarningLog::add(std::string code, std::string where, std::string reason) {
    constexpr std::uint64_t kMost = 16;
    if (++count_[code] <= kMost) kept_.push_back({std::move(code), std::move(where), std::move(reason)});
}

Warnings WarningLog::take(const std::string& path) {
    std::map<std::string, std::uint64_t> shown;
    for (const Warning& w : kept_) ++shown[w.code];
    for (const auto& [code, count] : count_)
        if (count > shown[code]) kept_.push_back({code, path, "and " + std::to_string(count - shown[code]) + " more"});
    count_.clear();
    return std::exchange(kept_, {});
}

void add_part(Scene& scene, Mesh&& mesh, std::string name, MeshRepair& dropped) {
    const MeshRepair repair = finish_mesh(mesh);
    dropped.non_finite += repair.non_finite;
    dropped.degenerate += repair.degenerate;
    Part part;
    part.name = std::move(name);
    part.mesh = static_cast<std::uint32_t>(scene.meshes.size());
    mesh.name = part.name;
    scene.meshes.push_back(std::move(mesh));
    scene.parts.push_back(std::move(part));
}

void drop_slack(Mesh& mesh) {
    const auto fit = [](auto& array) {
        if (array.capacity() < array.size() + array.size() / 8 + 64) return;
        std::remove_reference_t<decltype(array)> exact;
        exact.reserve(array.size() + 1); // finish_mesh wants room for one more
        exact.insert(exact.end(), array.begin(), array.end());
        array.swap(exact);
    };
    fit(mesh.positions);
    fit(mesh.triangles);
    fit(mesh.normals);
    fit(mesh.uv[0]);
    fit(mesh.colors);
}

void fill_missing_normals(Mesh& mesh) {
    const auto missing = [](Vec3f n) { return n == Vec3f{}; };
    if (std::all_of(mesh.normals.begin(), mesh.normals.end(), missing)) mesh.normals.clear();
    if (std::none_of(mesh.normals.begin(), mesh.normals.end(), missing)) return;
    std::vector<Vec3f> sum(mesh.normals.size());
    for (const Vec3u t : mesh.triangles) {
        const Vec3f a = mesh.positions[t.x];
        const Vec3f n = cross(mesh.positions[t.y] - a, mesh.positions[t.z] - a);
        if (!is_finite(n)) continue;
        for (const std::uint32_t v : {t.x, t.y, t.z}) sum[v] += n;
    }
    for (std::size_t v = 0; v < sum.size(); ++v)
        if (missing(mesh.normals[v])) mesh.normals[v] = normalize(sum[v]);
}

Material plain_material() {
    Material material;
    material.base_color = {0.6f, 0.6f, 0.6f, 1};
    material.metallic = 0;
    material.roughness = 0.6f;
    return material;
}

void report_dropped(const MeshRepair& dropped, const char* code, const std::string& path, WarningLog& log) {
    std::string what;
    if (dropped.non_finite) what = std::to_string(dropped.non_finite) + " with unusable corners";
    if (dropped.degenerate)
        what += (what.empty() ? "" : " and ") + std::to_string(dropped.degenerate) + " without area";
    if (!what.empty()) log.add(code, path, "triangles left out: " + what);
}

void check_memory(std::uint64_t bytes, const LoadParams& params, const std::string& path) {
    if (bytes > params.max_bytes)
        throw Error(ErrorKind::limit, "E0902", path,
                    "reading it takes more than " + std::to_string(params.max_bytes >> 20) +
                        " MB; --max-memory allows more");
}

std::int32_t TextureFiles::find(std::string_view reference, const std::string& where, WarningLog& log) {
    if (const auto known = by_reference_.find(reference); known != by_reference_.end()) return known->second;
    std::int32_t index = kNone;
    try {
        std::filesystem::path file = resolve_beside(model_, reference, where);
        const auto [entry, is_new] = by_file_.emplace(file, std::int32_t(entries_.size()));
        if (is_new) entries_.push_back({std::move(file), where});
        index = entry->second;
    } catch (const Error& error) {
        log.add("W0701", error.where, std::string("texture left out: ") + error.what());
    }
    by_reference_.emplace(std::string(reference), index);
    return index;
}

std::vector<Image<Rgba8>> TextureFiles::decode(const Control& control, WarningLog& log) const {
    struct Decoded {
        Image<Rgba8> image;
        Warnings warnings;
        bool readable = true;
    };
    std::vector<Decoded> decoded(entries_.size());
    const auto attempt = [&](std::size_t i, const auto& step) {
        const std::string where = entries_[i].where + ": " + valid_utf8(entries_[i].file.filename().string());
        try {
            step(FileBytes(entries_[i].file), where);
        } catch (const Error& error) {
            decoded[i].warnings.push_back({"W0702", where, std::string("texture left out: ") + error.what()});
            decoded[i].readable = false;
        }
    };

    // All sizes first: whether memory suffices must not depend on the order of decoding.
    std::uint64_t bytes = 0;
    for (std::size_t i = 0; i < entries_.size(); ++i)
        attempt(i, [&](const FileBytes& file, const std::string& where) {
            const ImageInfo info = image_info(file.bytes(), where);
            bytes += std::uint64_t(info.width) * std::uint64_t(info.height) * sizeof(Rgba8);
        });
    check_memory(bytes, *params_, model_.string());
    parallel_for(entries_.size(), control, [&](std::size_t i) {
        if (!decoded[i].readable) return;
        attempt(i, [&](const FileBytes& file, const std::string& where) {
            decoded[i].image = decode_image(file.bytes(), where, &decoded[i].warnings);
        });
    });

    std::vector<Image<Rgba8>> images;
    for (Decoded& d : decoded) {
        for (Warning& w : d.warnings) log.add(std::move(w.code), std::move(w.where), std::move(w.reason));
        images.push_back(std::move(d.image));
    }
    return images;
}

} // namespace porthole
