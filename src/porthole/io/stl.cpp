#include "porthole/io/stl.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cstring>

#include "porthole/io/reader.h"
#include "porthole/io/text_cursor.h"

namespace porthole {
namespace {

constexpr std::size_t kHeaderBytes = 84, kFacetBytes = 50;
constexpr std::uint64_t kMostTriangles = 0xFFFFFFFFu / 3;

std::uint32_t facet_count(std::string_view bytes) {
    std::uint32_t count = 0;
    std::memcpy(&count, bytes.data() + 80, 4);
    return count;
}

/// Gives equal points one index: open addressing over the points themselves.
class Welder {
public:
    explicit Welder(std::size_t corners) { table_.assign(std::bit_ceil(std::max<std::size_t>(corners, 16)), kFree); }

    std::uint32_t vertex(Vec3f p, std::vector<Vec3f>& positions) {
        // -0 and 0 are one place.
        p = {p.x + 0.0f, p.y + 0.0f, p.z + 0.0f};
        if (2 * positions.size() > table_.size()) grow(positions);
        const auto key = std::bit_cast<std::array<std::uint32_t, 3>>(p);
        for (std::size_t slot = hash(key) & (table_.size() - 1);; slot = (slot + 1) & (table_.size() - 1)) {
            if (table_[slot] == kFree) {
                table_[slot] = std::uint32_t(positions.size());
                positions.push_back(p);
                return table_[slot];
            }
            // By bits, so that NaN equals itself.
            if (std::bit_cast<std::array<std::uint32_t, 3>>(positions[table_[slot]]) == key) return table_[slot];
        }
    }

private:
    static constexpr std::uint32_t kFree = 0xFFFFFFFFu;

    static std::size_t hash(const std::array<std::uint32_t, 3>& key) {
        std::uint64_t h = key[0] | std::uint64_t(key[1]) << 32;
        h = (h ^ h >> 32) * 0x9E3779B97F4A7C15u;
        h = (h ^ h >> 29 ^ key[2]) * 0xBF58476D1CE4E5B9u;
        return h ^ h >> 32;
    }
    void grow(const std::vector<Vec3f>& positions) {
        table_.assign(2 * table_.size(), kFree);
        for (std::size_t i = 0; i < positions.size(); ++i) {
            std::size_t slot = hash(std::bit_cast<std::array<std::uint32_t, 3>>(positions[i])) & (table_.size() - 1);
            while (table_[slot] != kFree) slot = (slot + 1) & (table_.size() - 1);
            table_[slot] = std::uint32_t(i);
        }
    }

    std::vector<std::uint32_t> table_;
};

/// What both kinds end with.
struct Output {
    Scene scene;
    WarningLog log;
    MeshRepair dropped;
    std::vector<std::vector<std::string>> chains;
    std::uint64_t facets = 0;

    void add(Mesh&& mesh, const std::string& name) {
        mesh.submeshes = {{0, std::uint32_t(mesh.triangles.size()), 0}};
        facets += mesh.triangles.size();
        add_part(scene, std::move(mesh), name, dropped);
        chains.push_back({name});
    }
};

void read_binary(std::string_view bytes, const std::filesystem::path& path, const LoadParams& params,
                 const Control& control, Output& out) {
    const std::string name = path.string();
    const std::uint32_t count = facet_count(bytes);
    const std::uint64_t needed = kHeaderBytes + std::uint64_t(count) * kFacetBytes;
    if (needed > bytes.size())
        throw Error(ErrorKind::input, "E0602", name + ":byte 80",
                    std::to_string(count) + " facets need " + std::to_string(needed) + " bytes, the file has " +
                        std::to_string(bytes.size()) + "; the file is truncated?");
    if (count > kMostTriangles) throw Error(ErrorKind::limit, "E0904", name, "more than 2^32 corners");
    if (needed < bytes.size())
        out.log.add("W0602", name + ":byte " + std::to_string(needed),
                    std::to_string(bytes.size() - needed) + " bytes after the last of " + std::to_string(count) +
                        " facets are ignored");
    if (count == 0) return;
    // Vertices are about half as many as triangles, but may be three times as many.
    check_memory(std::uint64_t(count) * (sizeof(Vec3u) + 3 * sizeof(Vec3f) + 8 * sizeof(std::uint32_t)), params, name);

    Mesh mesh;
    mesh.triangles.reserve(count);
    mesh.positions.reserve(count / 2 + 4);
    Welder welder(count);
    for (std::uint32_t i = 0; i < count; ++i) {
        if (i % 65536 == 0 && control.stop.stop_requested()) throw Cancelled{};
        std::array<Vec3f, 3> corners;
        std::memcpy(corners.data(), bytes.data() + kHeaderBytes + std::size_t(i) * kFacetBytes + 12, 36);
        Vec3u t;
        t.x = welder.vertex(corners[0], mesh.positions);
        t.y = welder.vertex(corners[1], mesh.positions);
        t.z = welder.vertex(corners[2], mesh.positions);
        mesh.triangles.push_back(t);
    }
    out.add(std::move(mesh), file_stem(path));
}

std::string lower(std::string_view text) {
    std::string out(text);
    std::transform(out.begin(), out.end(), out.begin(), [](char c) { return c >= 'A' && c <= 'Z' ? char(c + 32) : c; });
    return out;
}

class AsciiReader {
public:
    AsciiReader(std::string_view text, const std::filesystem::path& path, const LoadParams& params,
                const Control& control, Output& out)
        : cursor_(text), path_(path), name_(path.string()), params_(params), control_(control), out_(out) {}
    void read();

private:
    void keyword_line(const std::string& keyword);
    void end_facet(bool closed);
    void end_solid();

    TextCursor cursor_;
    const std::filesystem::path& path_;
    std::string name_;
    const LoadParams& params_;
    const Control& control_;
    Output& out_;
    std::string solid_;
    Mesh mesh_;
    Welder welder_{16};
    bool in_facet_ = false, readable_ = true;
    std::uint64_t facet_line_ = 0;
    std::vector<Vec3f> corners_;
    Fault bad_facets_, unknown_, capitals_;
};

void AsciiReader::read() {
    for (std::uint64_t n = 0; !cursor_.at_end(); ++n, cursor_.next_line()) {
        if (n % 65536 == 0) {
            if (control_.stop.stop_requested()) throw Cancelled{};
            check_memory(mesh_.positions.capacity() * (sizeof(Vec3f) + 8) + mesh_.triangles.capacity() * sizeof(Vec3u),
                         params_, name_);
        }
        cursor_.skip_blanks();
        const std::string_view word = cursor_.word().substr(0, 32);
        if (word.empty()) continue;
        const std::string keyword = lower(word);
        if (keyword != word) capitals_.note(cursor_.line(), escaped(word));
        keyword_line(keyword);
    }
    if (in_facet_) {
        end_facet(false);
        out_.log.add("W0603", at_line(name_, cursor_.line()), "the text ends inside a facet; the file is cut short?");
    }
    end_solid();
    const auto tell = [&](const char* code, const Fault& fault, const char* what) {
        if (fault.count == 0) return;
        const std::string more = fault.count > 1 ? " (and " + std::to_string(fault.count - 1) + " more)" : "";
        out_.log.add(code, at_line(name_, fault.first_line), what + fault.first + more);
    };
    if (out_.facets == 0 && bad_facets_.count)
        throw Error(ErrorKind::input, "E0603", at_line(name_, bad_facets_.first_line),
                    "no facet can be used: " + bad_facets_.first);
    if (out_.facets == 0 && unknown_.count)
        throw Error(ErrorKind::input, "E0601", at_line(name_, unknown_.first_line),
                    "no facets found, and '" + unknown_.first + "' is not STL");
    tell("W0601", bad_facets_, "facet left out: ");
    tell("W0603", unknown_, "not STL: ");
    tell("W0605", capitals_, "keywords are written small in STL, read all the same: ");
}

void AsciiReader::keyword_line(const std::string& keyword) {
    if (keyword == "vertex") {
        Vec3f p;
        const bool readable = cursor_.number(p.x) && cursor_.number(p.y) && cursor_.number(p.z);
        if (!readable && readable_) {
            readable_ = false;
            bad_facets_.note(cursor_.line(), "'" + escaped(cursor_.rest_of_line(), 60) + "' is not a coordinate");
        }
        if (!in_facet_) return unknown_.note(cursor_.line(), "vertex outside a facet");
        if (corners_.size() < 64) corners_.push_back(p);
    } else if (keyword == "facet") {
        if (in_facet_) end_facet(false);
        in_facet_ = true;
        readable_ = true;
        facet_line_ = cursor_.line();
        corners_.clear();
    } else if (keyword == "endfacet") {
        end_facet(true);
    } else if (keyword == "solid") {
        if (in_facet_) end_facet(false);
        end_solid();
        solid_ = valid_utf8(cursor_.rest_of_line());
    } else if (keyword == "endsolid") {
        if (in_facet_) end_facet(false);
        end_solid();
    } else if (keyword != "outer" && keyword != "endloop" && keyword != "color") {
        unknown_.note(cursor_.line(), escaped(keyword, 40));
    }
}

void AsciiReader::end_facet(bool closed) {
    if (!in_facet_) return unknown_.note(cursor_.line(), "endfacet without facet");
    in_facet_ = false;
    if (!readable_) return; // told already
    if (!closed) unknown_.note(facet_line_, "a facet without endfacet");
    if (corners_.size() != 3)
        return bad_facets_.note(facet_line_, "a facet with " + std::to_string(corners_.size()) + " vertices");
    if (mesh_.triangles.size() >= kMostTriangles)
        throw Error(ErrorKind::limit, "E0904", at_line(name_, cursor_.line()), "more than 2^32 corners");
    Vec3u t;
    t.x = welder_.vertex(corners_[0], mesh_.positions);
    t.y = welder_.vertex(corners_[1], mesh_.positions);
    t.z = welder_.vertex(corners_[2], mesh_.positions);
    mesh_.triangles.push_back(t);
}

void AsciiReader::end_solid() {
    if (!mesh_.triangles.empty()) out_.add(std::move(mesh_), solid_.empty() ? file_stem(path_) : solid_);
    mesh_ = {};
    welder_ = Welder(16);
    solid_.clear();
}

} // namespace

bool is_exact_binary_stl(const FileBytes& file) {
    const std::string_view bytes = file.text();
    return bytes.size() >= kHeaderBytes &&
           bytes.size() == kHeaderBytes + std::uint64_t(facet_count(bytes)) * kFacetBytes;
}

Scene read_stl(const FileBytes& file, const std::filesystem::path& path, const LoadParams& params,
               const Control& control) {
    const std::string name = path.string();
    const std::string_view bytes = file.text();
    const std::size_t first = std::min(bytes.find_first_not_of(" \t\r\n"), bytes.size());
    const bool solid = lower(bytes.substr(first, 5)) == "solid";
    // Some programs begin binary files with "solid", and some text files are cut short.
    const bool text = solid && !is_exact_binary_stl(file) &&
                      std::memchr(bytes.data(), 0, std::min<std::size_t>(bytes.size(), 1024)) == nullptr;
    Output out;
    if (text) {
        AsciiReader(bytes, path, params, control, out).read();
    } else {
        if (bytes.size() < kHeaderBytes)
            throw Error(ErrorKind::input, "E0601", name,
                        std::to_string(bytes.size()) + " bytes are too few for a binary STL and it does not begin with "
                                                       "\"solid\"");
        read_binary(bytes, path, params, control, out);
    }
    assign_paths(out.scene, out.chains);
    report_dropped(out.dropped, "W0604", name, out.log);
    if (!out.scene.parts.empty()) out.scene.materials.push_back(plain_material());
    out.scene.format = "STL";
    out.scene.warnings = out.log.take(name);
    return std::move(out.scene);
}

} // namespace porthole
