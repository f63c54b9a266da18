#include "porthole/io/load.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <optional>
#include <utility>

#include "porthole/io/files.h"
#include "porthole/io/gltf.h"
#include "porthole/io/obj.h"
#include "porthole/io/ply.h"
#include "porthole/io/scene_json.h"
#include "porthole/io/stl.h"
#include "porthole/scene/texture.h"

namespace porthole {
namespace {

enum class Format : std::uint8_t { gltf, obj, ply, scene, stl };

constexpr const char* kReadable = "glTF, GLB, OBJ, PLY, STL and scenes of primitives are read";

std::string lower(std::string_view text) {
    std::string out(text);
    std::transform(out.begin(), out.end(), out.begin(), [](char c) { return c >= 'A' && c <= 'Z' ? char(c + 32) : c; });
    return out;
}

std::optional<Format> format_named(std::string_view name) {
    const std::string s = lower(name);
    if (s == "glb" || s == "gltf" || s == "vrm") return Format::gltf;
    if (s == "obj") return Format::obj;
    if (s == "ply") return Format::ply;
    if (s == "scene" || s == "json") return Format::scene;
    if (s == "stl") return Format::stl;
    return std::nullopt;
}

const char* title(Format format) {
    switch (format) {
    case Format::gltf: return "glTF";
    case Format::obj: return "OBJ";
    case Format::ply: return "PLY";
    case Format::scene: return "scene";
    case Format::stl: break;
    }
    return "STL";
}

/// Files that are something else, told by how they begin.
struct Foreign {
    std::string_view magic;
    std::size_t at;
    const char* what;
};
using namespace std::string_view_literals;
constexpr Foreign kForeign[] = {
    {"version https://git-lfs", 0, "a Git LFS pointer, not the model itself; run: git lfs pull"},
    {"\x1F\x8B"sv, 0, "compressed with gzip; unpack it first (gunzip)"},
    {"BZh", 0, "compressed with bzip2; unpack it first"},
    {"\xFD\x37zXZ"sv, 0, "compressed with xz; unpack it first"},
    {"\x28\xB5\x2F\xFD"sv, 0, "compressed with zstd; unpack it first"},
    {"7z\xBC\xAF\x27"sv, 0, "a 7-Zip archive; unpack it first"},
    {"PK\x03\x04"sv, 0, "a ZIP archive (a 3MF, a USDZ or packed files)"},
    {"PK\x05\x06"sv, 0, "an empty ZIP archive"},
    {"Rar!", 0, "a RAR archive; unpack it first"},
    {"ustar", 257, "a tar archive; unpack it first"},
    {"\x89PNG"sv, 0, "a PNG picture"},
    {"\xFF\xD8\xFF"sv, 0, "a JPEG picture"},
    {"WEBP", 8, "a WebP picture"},
    {"GIF8", 0, "a GIF picture"},
    {"%PDF", 0, "a PDF document"},
    {"ISO-10303-21;", 0, "a STEP or IFC file; convert it to glTF first"},
    {"Kaydara FBX Binary", 0, "an FBX file; convert it to glTF first"},
    {"; FBX", 0, "an FBX file; convert it to glTF first"},
    {"PXR-USDC", 0, "a USD file; convert it to glTF first"},
    {"#usda", 0, "a USD file; convert it to glTF first"},
    {"BLENDER", 0, "a Blender file; export it as glTF"},
    {"#VRML", 0, "a VRML file; convert it to glTF first"},
    {"#X3D", 0, "an X3D file; convert it to glTF first"},
    {"OFF\n", 0, "an OFF mesh; convert it to PLY first"},
    {"MM\0*"sv, 0, "a TIFF picture"},
    {"II*\0"sv, 0, "a TIFF picture"},
    {"DRACO", 0, "a bare Draco mesh; pack it into a glTF first"},
    {"n+1\0"sv, 344, "a NIfTI volume; volumes are not read"},
    {"NRRD0", 0, "an NRRD volume; volumes are not read"},
    {"DICM", 128, "a DICOM picture; volumes are not read"},
    {"\xFE\xFF"sv, 0, "UTF-16 text; save it as UTF-8"},
    {"\xFF\xFE"sv, 0, "UTF-16 text; save it as UTF-8"},
    {"\x7F"
     "ELF"sv,
     0, "a program"},
};

bool holds(std::string_view bytes, std::size_t at, std::string_view magic) {
    return bytes.size() >= at && bytes.substr(at).starts_with(magic);
}

/// A 3DS file is one chunk of kind 0x4D4D, its length the file's.
bool is_3ds(std::string_view bytes) {
    std::uint32_t length = 0;
    if (bytes.size() < 6 || !bytes.starts_with("MM")) return false;
    std::memcpy(&length, bytes.data() + 2, 4);
    return length == bytes.size();
}

/// The beginning of a text, without a byte order mark and blanks.
std::string_view opening(std::string_view bytes) {
    if (bytes.starts_with("\xEF\xBB\xBF")) bytes.remove_prefix(3);
    bytes.remove_prefix(std::min(bytes.find_first_not_of(" \t\r\n"), bytes.size()));
    return bytes.substr(0, 4096);
}

/// What the file is instead of a model that is read; empty if there is no telling.
std::string foreign_kind(std::string_view bytes) {
    for (const Foreign& f : kForeign)
        if (holds(bytes, f.at, f.magic)) return f.what;
    if (is_3ds(bytes)) return "a 3DS file; convert it to glTF first";
    const std::string start = lower(opening(bytes));
    if (start.starts_with("<!doctype html") || start.starts_with("<html")) return "a web page, not the file behind it";
    if (start.find("<collada") != std::string::npos) return "a COLLADA file; convert it to glTF first";
    if (start.find("<x3d") != std::string::npos) return "an X3D file; convert it to glTF first";
    if (start.starts_with("<?xml") || start.starts_with("<")) return "an XML file";
    if (start.starts_with("iso-10303-21;")) return "a STEP or IFC file; convert it to glTF first";
    // IGES: fixed lines of 80 characters, the 73rd of the first an S and a number.
    if (bytes.size() > 80 && bytes[72] == 'S' &&
        bytes.substr(73, 7).find_first_not_of(" 0123456789") == std::string_view::npos)
        return "an IGES file; convert it to glTF first";
    return {};
}

/// Whether lines near the beginning are statements of an OBJ file.
bool looks_like_obj(std::string_view bytes) {
    std::string_view rest = bytes.substr(0, std::size_t(1) << 16);
    if (rest.starts_with("\xEF\xBB\xBF")) rest.remove_prefix(3);
    if (std::memchr(rest.data(), 0, rest.size())) return false;
    while (!rest.empty()) {
        const std::size_t end = std::min(rest.find_first_of("\r\n"), rest.size());
        std::string_view line = rest.substr(0, end);
        rest.remove_prefix(std::min(end + 1, rest.size()));
        line.remove_prefix(std::min(line.find_first_not_of(" \t"), line.size()));
        if (line.empty() || line[0] == '#') continue;
        const std::string_view word = line.substr(0, line.find_first_of(" \t"));
        if (word == "mtllib" || word == "usemtl") return true;
        if (word == "v" || word == "vn" || word == "vt" || word == "f") {
            const std::size_t value = line.find_first_not_of(" \t", word.size());
            return value != std::string_view::npos && std::strchr("+-.0123456789", line[value]) != nullptr;
        }
    }
    return false;
}

/// What the content says, without the file's name.
std::optional<Format> format_of(const FileBytes& file) {
    const std::string_view bytes = file.text();
    if (bytes.starts_with("glTF")) return Format::gltf;
    if (bytes.starts_with("ply\n") || bytes.starts_with("ply\r")) return Format::ply;
    // Before the marks of other files: the 80 bytes of its header may say anything.
    if (is_exact_binary_stl(file) && bytes.size() > 84) return Format::stl;
    const std::string_view start = opening(bytes);
    if (start.starts_with('{')) return has_scene_mark(start) ? Format::scene : Format::gltf;
    const std::string begin = lower(start);
    if (begin.starts_with("solid") &&
        (begin.find("facet") != std::string::npos || begin.find("endsolid") != std::string::npos))
        return Format::stl;
    if (looks_like_obj(bytes)) return Format::obj;
    return std::nullopt;
}

/// @throws Error E0204, E0205.
Format choose_format(const FileBytes& file, const std::string& path, const LoadParams& params, Warnings& warnings) {
    const auto refuse = [&](const std::string& what) { throw Error(ErrorKind::input, "E0204", path, what); };
    if (!params.format.empty()) {
        const std::optional<Format> asked = format_named(params.format);
        if (!asked)
            throw Error(ErrorKind::usage, "E0120", "--format",
                        "'" + escaped(params.format, 60) + "' is not glb, gltf, obj, ply, scene or stl");
        return *asked;
    }
    const std::string ending = std::filesystem::path(path).extension().string();
    const std::optional<Format> named = format_named(ending.empty() ? "" : std::string_view(ending).substr(1));
    std::optional<Format> found = format_of(file);
    // JSON without a mark: its name tells which reader explains what is missing.
    if (found == Format::gltf && named == Format::scene && file.text().find("\"asset\"") == std::string_view::npos)
        found = named;
    if (found) {
        if (named && *named != *found)
            warnings.push_back({"W0201", path,
                                std::string("named as ") + title(*named) + ", but the content is " + title(*found) +
                                    "; read as that"});
        return *found;
    }
    if (const std::string what = foreign_kind(file.text()); !what.empty()) refuse("this is " + what + "; " + kReadable);
    // The name decides which reader explains what is wrong.
    if (named) return *named;
    refuse(std::string("not a model of a known kind; ") + kReadable);
    return Format::gltf;
}

Scene read_as(Format format, const FileBytes& file, const std::filesystem::path& path, const LoadParams& params,
              const Control& control) {
    switch (format) {
    case Format::gltf: return read_gltf(file, path, params, control);
    case Format::obj: return read_obj(file, path, params, control);
    case Format::ply: return read_ply(file, path, params, control);
    case Format::scene: return read_scene_json(file, path, params, control);
    case Format::stl: break;
    }
    return read_stl(file, path, params, control);
}

/// From the file's axes and unit to y up and metres.
void convert_units(Scene& scene, const LoadParams& params) {
    const double s = params.metres_per_unit;
    if (params.up == 'y' && s == 1) return;
    const Affine3d turn = params.up == 'z' ? Affine3d{{1, 0, 0}, {0, 0, -1}, {0, 1, 0}, {}} : Affine3d{};
    const Affine3d world_from_file{turn.x * s, turn.y * s, turn.z * s, {}};
    for (Part& part : scene.parts) part.world_from_mesh = world_from_file * part.world_from_mesh;
    scene.origin = world_from_file.point(scene.origin);
    for (Light& light : scene.lights) {
        light.position = Vec3f(world_from_file.point(Vec3d(light.position)));
        light.direction = Vec3f(turn.vector(Vec3d(light.direction)));
        light.range *= float(s);
        // Candela fall off with the square of a distance that has changed.
        if (light.kind != Light::Kind::directional) light.intensity *= float(s * s);
    }
    for (FileCamera& camera : scene.cameras) {
        Affine3d& m = camera.world_from_camera;
        m = {turn.vector(m.x), turn.vector(m.y), turn.vector(m.z), world_from_file.point(m.p)};
        camera.half_height *= float(s);
    }
    for (Material& material : scene.materials) {
        material.thickness *= float(s);
        material.attenuation_distance *= float(s);
    }
    const Bounds3d box = scene_bounds(scene);
    if (!box.empty() && !(box.diagonal() <= 2 * double(kLargestCoordinate)))
        throw Error(ErrorKind::usage, "E0122", "--units", "with such units the model is more than 1e12 m large");
}

/// Parts of which no triangle was usable say nothing and would stretch the scene's box. If
/// there are no others they stay: the file is a model, if one that shows nothing.
void drop_empty_parts(Scene& scene) {
    const auto is_empty = [&](const Part& part) { return scene.meshes[part.mesh].empty(); };
    if (std::all_of(scene.parts.begin(), scene.parts.end(), is_empty)) return;
    std::erase_if(scene.parts, is_empty);
}

} // namespace

Scene load_scene(const std::string& path, const LoadParams& params, const Control& control) {
    if (params.up != 'y' && params.up != 'z')
        throw Error(ErrorKind::usage, "E0121", "--up", std::string("'") + params.up + "' is not y or z");
    if (!(params.metres_per_unit > 0) || !std::isfinite(params.metres_per_unit))
        throw Error(ErrorKind::usage, "E0122", "--units", "the length of a unit must be above 0 and finite");
    if (path == "-" && params.format.empty())
        throw Error(ErrorKind::usage, "E0120", "--format", "a model from standard input needs its format");

    const FileBytes file(std::filesystem::path(path), params.max_bytes);
    Warnings warnings;
    const Format format = choose_format(file, path, params, warnings);
    Scene scene = read_as(format, file, path, params, control);
    scene.source = path;
    scene.warnings.insert(scene.warnings.begin(), warnings.begin(), warnings.end());
    drop_empty_parts(scene);
    convert_units(scene, params);
    recentre(scene);
    build_mips(scene, control);
    return scene;
}

} // namespace porthole
