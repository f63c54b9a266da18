#include "porthole/io/ply.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstring>
#include <optional>

#include "porthole/io/polygon.h"
#include "porthole/io/reader.h"
#include "porthole/io/text_cursor.h"

namespace porthole {
namespace {

enum class Type : std::uint8_t { int8, uint8, int16, uint16, int32, uint32, float32, float64 };
enum class Encoding : std::uint8_t { ascii, little, big };

constexpr std::array<std::size_t, 8> kTypeBytes{1, 1, 2, 2, 4, 4, 4, 8};
std::size_t bytes_of(Type type) { return kTypeBytes[std::size_t(type)]; }

std::optional<Type> type_named(std::string_view name) {
    static constexpr std::array<std::array<std::string_view, 2>, 8> names{{{"char", "int8"},
                                                                           {"uchar", "uint8"},
                                                                           {"short", "int16"},
                                                                           {"ushort", "uint16"},
                                                                           {"int", "int32"},
                                                                           {"uint", "uint32"},
                                                                           {"float", "float32"},
                                                                           {"double", "float64"}}};
    for (std::size_t i = 0; i < names.size(); ++i)
        if (name == names[i][0] || name == names[i][1]) return static_cast<Type>(i);
    return std::nullopt;
}

struct Property {
    std::string name;
    Type type = Type::float32;
    std::optional<Type> count_type; ///< lists only
};

struct Element {
    std::string name;
    std::uint64_t count = 0;
    std::vector<Property> properties;

    [[nodiscard]] std::ptrdiff_t find(std::initializer_list<std::string_view> names) const {
        for (const std::string_view n : names)
            for (std::size_t i = 0; i < properties.size(); ++i)
                if (properties[i].name == n) return std::ptrdiff_t(i);
        return -1;
    }
};

struct Header {
    Encoding encoding = Encoding::ascii;
    std::vector<Element> elements;
    std::string texture_file;
    std::size_t texture_line = 0;
    std::size_t data = 0;        ///< where the data begin, bytes
    std::uint64_t data_line = 1; ///< and on which line
};

// ---------------------------------------------------------------- header

class HeaderReader {
public:
    HeaderReader(std::string_view text, const std::string& path) : text_(text), path_(path) {}
    Header read();

private:
    [[noreturn]] void refuse(const std::string& reason) const {
        throw Error(ErrorKind::input, "E0501", at_line(path_, line_), reason);
    }
    std::string_view next_line();
    void element(TextCursor& words);
    void property(TextCursor& words);
    Type type(std::string_view name) const;

    std::string_view text_;
    const std::string& path_;
    std::size_t at_ = 0;
    std::uint64_t line_ = 0;
    bool lone_returns_ = false; ///< lines end with "\r" alone, so that a "\n" after it is data
    Header header_;
};

/// Up to the line's end, which may be "\n", "\r\n" or "\r".
std::string_view HeaderReader::next_line() {
    ++line_;
    const std::size_t end = text_.find_first_of("\r\n", at_);
    if (end == std::string_view::npos) refuse("the header has no end_header");
    const std::string_view line = text_.substr(at_, end - at_);
    at_ = end + 1;
    if (text_[end] == '\r') {
        if (!lone_returns_ && at_ < text_.size() && text_[at_] == '\n')
            ++at_;
        else
            lone_returns_ = true;
    }
    return line;
}

Header HeaderReader::read() {
    if (next_line() != "ply") refuse("a PLY file begins with a line \"ply\"");
    bool has_format = false;
    for (;;) {
        const std::string_view line = next_line();
        TextCursor words(line);
        const std::string_view keyword = words.word();
        if (keyword == "end_header") break;
        if (keyword == "format") {
            const std::string_view name = words.word(), version = words.word();
            if (name == "ascii")
                header_.encoding = Encoding::ascii;
            else if (name == "binary_little_endian")
                header_.encoding = Encoding::little;
            else if (name == "binary_big_endian")
                header_.encoding = Encoding::big;
            else
                refuse("format '" + escaped(name, 60) + "' is not ascii, binary_little_endian or binary_big_endian");
            if (version != "1.0") refuse("version '" + escaped(version, 60) + "' is not 1.0");
            has_format = true;
        } else if (keyword == "element") {
            element(words);
        } else if (keyword == "property") {
            property(words);
        } else if (keyword == "comment") {
            if (words.word() == "TextureFile" && header_.texture_file.empty()) {
                header_.texture_file = std::string(words.rest_of_line());
                header_.texture_line = line_;
            }
        } else if (!keyword.empty() && keyword != "obj_info") {
            refuse("'" + escaped(keyword, 60) + "' is not a PLY keyword");
        }
    }
    if (!has_format) refuse("the header has no format");
    header_.data = at_;
    header_.data_line = line_ + 1;
    return std::move(header_);
}

void HeaderReader::element(TextCursor& words) {
    Element element;
    element.name = std::string(words.word());
    const std::string count(words.word());
    const auto [end, fault] = std::from_chars(count.data(), count.data() + count.size(), element.count);
    if (element.name.empty() || count.empty() || fault != std::errc{} || end != count.data() + count.size())
        refuse("element '" + escaped(element.name, 60) + "' has the count '" + escaped(count, 60) + "'");
    for (const Element& other : header_.elements)
        if (other.name == element.name) refuse("element '" + escaped(element.name, 60) + "' appears twice");
    header_.elements.push_back(std::move(element));
    if (header_.elements.size() > 1000) refuse("more than 1000 elements");
}

Type HeaderReader::type(std::string_view name) const {
    if (const std::optional<Type> found = type_named(name)) return *found;
    refuse("'" + escaped(name, 60) + "' is not a property type");
}

void HeaderReader::property(TextCursor& words) {
    if (header_.elements.empty()) refuse("a property before the first element");
    Property property;
    std::string_view word = words.word();
    if (word == "list") {
        property.count_type = type(words.word());
        if (*property.count_type >= Type::float32) refuse("a list's length has a floating-point type");
        word = words.word();
    }
    property.type = type(word);
    property.name = std::string(words.word());
    if (property.name.empty()) refuse("a property without a name");
    Element& element = header_.elements.back();
    if (element.find({property.name}) >= 0) refuse("property '" + escaped(property.name, 60) + "' appears twice");
    element.properties.push_back(std::move(property));
    if (element.properties.size() > 10000) refuse("more than 10000 properties");
}

// ---------------------------------------------------------------- data

/// What the file holds, before it becomes a mesh.
struct Contents {
    std::vector<Vec3f> positions, normals;
    std::vector<Vec4f> colors;          ///< sRGB
    std::vector<Vec2f> uvs;             ///< v upwards
    std::vector<std::uint32_t> corners; ///< vertex indices of all polygons
    std::vector<std::uint32_t> face_end;
    std::vector<std::uint32_t> strips; ///< kRestart between strips
    Fault bad_faces;

    static constexpr std::uint32_t kRestart = 0xFFFFFFFFu;
};

class DataReader {
public:
    DataReader(std::string_view text, const Header& header, const std::string& path, const LoadParams& params,
               const Control& control)
        : text_(text), header_(header), path_(path), params_(params), control_(control),
          words_(text.substr(header.data)), at_(header.data) {}
    Contents read(WarningLog& log);

private:
    [[nodiscard]] std::string here() const;
    [[noreturn]] void data_end(const std::string& what) const;
    double scalar(Type type);
    std::uint64_t list_length(const Property& property);
    void begin_row();
    void end_row();
    void check(std::uint64_t row) const;
    void require_room(const Element& element) const;
    void read_vertices(const Element& element);
    void read_faces(const Element& element, bool strips);
    void skip(const Element& element);
    [[nodiscard]] bool ascii() const { return header_.encoding == Encoding::ascii; }

    std::string_view text_;
    const Header& header_;
    const std::string& path_;
    const LoadParams& params_;
    const Control& control_;
    TextCursor words_; ///< ASCII data
    std::size_t at_;   ///< binary data
    Contents contents_;
    Fault long_rows_;
};

std::string DataReader::here() const {
    return ascii() ? at_line(path_, header_.data_line + words_.line() - 1) : path_ + ":byte " + std::to_string(at_);
}

void DataReader::data_end(const std::string& what) const { throw Error(ErrorKind::input, "E0502", here(), what); }

double DataReader::scalar(Type type) {
    if (ascii()) {
        double value = 0;
        if (words_.number(value)) return value;
        if (words_.at_line_end()) data_end("the row has too few values");
        data_end("'" + escaped(words_.word(), 60) + "' is not a number");
    }
    const std::size_t size = bytes_of(type);
    if (text_.size() - at_ < size) data_end("the data end here, inside an element; the file is truncated?");
    std::uint64_t raw = 0;
    std::memcpy(&raw, text_.data() + at_, size);
    at_ += size;
    if (header_.encoding == Encoding::big) raw = __builtin_bswap64(raw) >> (64 - 8 * size);
    switch (type) {
    case Type::int8: return static_cast<std::int8_t>(raw);
    case Type::uint8: return static_cast<std::uint8_t>(raw);
    case Type::int16: return static_cast<std::int16_t>(raw);
    case Type::uint16: return static_cast<std::uint16_t>(raw);
    case Type::int32: return static_cast<std::int32_t>(raw);
    case Type::uint32: return static_cast<std::uint32_t>(raw);
    case Type::float32: return std::bit_cast<float>(static_cast<std::uint32_t>(raw));
    case Type::float64: break;
    }
    return std::bit_cast<double>(raw);
}

std::uint64_t DataReader::list_length(const Property& property) {
    const double length = scalar(*property.count_type);
    if (!(length >= 0) || length != std::floor(length) || length > 4294967295.0)
        data_end("a list cannot have " + std::to_string(length) + " entries");
    return static_cast<std::uint64_t>(length);
}

void DataReader::begin_row() {
    if (!ascii()) return;
    // Blank lines between rows.
    while (!words_.at_end() && words_.at_line_end()) words_.next_line();
    if (words_.at_end()) data_end("the data end here; the file is truncated?");
}

void DataReader::end_row() {
    if (!ascii()) return;
    if (!words_.at_line_end())
        long_rows_.note(header_.data_line + words_.line() - 1, "'" + escaped(words_.word(), 60) + "'");
    words_.next_line();
}

void DataReader::check(std::uint64_t row) const {
    if (row % 65536 != 0) return;
    if (control_.stop.stop_requested()) throw Cancelled{};
    check_memory((contents_.positions.capacity() + contents_.normals.capacity()) * sizeof(Vec3f) +
                     contents_.colors.capacity() * sizeof(Vec4f) + contents_.uvs.capacity() * sizeof(Vec2f) +
                     (contents_.corners.capacity() + contents_.face_end.capacity() + contents_.strips.capacity()) *
                         sizeof(std::uint32_t),
                 params_, path_);
}

/// @throws Error E0502 when the rest of the file is too short for the element's rows.
void DataReader::require_room(const Element& element) const {
    std::uint64_t least = 0; // bytes of a row with empty lists
    for (const Property& p : element.properties) least += ascii() ? 2 : bytes_of(p.count_type.value_or(p.type));
    const std::uint64_t left = text_.size() - (ascii() ? std::size_t(words_.position() - text_.data()) : at_);
    // The last row of a text needs no line end.
    if (least == 0 || element.count <= (left + 1) / least) return;
    throw Error(ErrorKind::input, "E0502", here(),
                std::to_string(element.count) + " rows of '" + escaped(element.name, 60) + "' do not fit in the " +
                    std::to_string(left) + " bytes left; the file is truncated?");
}

Contents DataReader::read(WarningLog& log) {
    for (const Element& element : header_.elements) {
        if (element.properties.empty()) continue;
        require_room(element);
        if (element.name == "vertex")
            read_vertices(element);
        else if (element.name == "face")
            read_faces(element, false);
        else if (element.name == "tristrips")
            read_faces(element, true);
        else {
            if (element.count > 0) log.add("W0503", path_, "element '" + escaped(element.name, 60) + "' is not drawn");
            skip(element);
        }
    }
    if (long_rows_.count)
        log.add("W0502", at_line(path_, long_rows_.first_line), "more values than properties: " + long_rows_.first);
    if (!ascii() && text_.find_first_not_of(std::string_view(" \t\r\n\0", 5), at_) != std::string_view::npos)
        log.add("W0502", here(), std::to_string(text_.size() - at_) + " bytes after the last element are ignored");
    return std::move(contents_);
}

void DataReader::skip(const Element& element) {
    for (std::uint64_t row = 0; row < element.count; ++row) {
        check(row);
        begin_row();
        for (const Property& p : element.properties) {
            const std::uint64_t n = p.count_type ? list_length(p) : 1;
            for (std::uint64_t i = 0; i < n; ++i) (void)scalar(p.type);
        }
        end_row();
    }
}

void DataReader::read_vertices(const Element& element) {
    enum Role : std::uint8_t { x, y, z, nx, ny, nz, red, green, blue, alpha, u, v, kRoles };
    std::array<std::ptrdiff_t, kRoles> column{
        element.find({"x"}),
        element.find({"y"}),
        element.find({"z"}),
        element.find({"nx", "normal_x"}),
        element.find({"ny", "normal_y"}),
        element.find({"nz", "normal_z"}),
        element.find({"red", "r", "diffuse_red"}),
        element.find({"green", "g", "diffuse_green"}),
        element.find({"blue", "b", "diffuse_blue"}),
        element.find({"alpha", "a", "diffuse_alpha"}),
        element.find({"u", "s", "texture_u", "texture_s"}),
        element.find({"v", "t", "texture_v", "texture_t"}),
    };
    for (std::ptrdiff_t& c : column)
        if (c >= 0 && element.properties[std::size_t(c)].count_type) c = -1;
    for (const Role role : {x, y, z})
        if (column[role] < 0)
            throw Error(ErrorKind::input, "E0503", path_,
                        std::string("the vertices have no property '") + "xyz"[role] + "'");
    if (element.count > Contents::kRestart - 1)
        throw Error(ErrorKind::limit, "E0904", path_, "more than 2^32 vertices");
    const bool has_normals = column[nx] >= 0 && column[ny] >= 0 && column[nz] >= 0;
    const bool has_colors = column[red] >= 0 && column[green] >= 0 && column[blue] >= 0;
    const bool has_uvs = column[u] >= 0 && column[v] >= 0;

    // role_of and scale are looked up per value: properties stand in any order.
    std::vector<std::uint8_t> role_of(element.properties.size(), kRoles);
    for (std::uint8_t role = 0; role < kRoles; ++role)
        if (column[role] >= 0) role_of[std::size_t(column[role])] = role;
    const auto unit = [&](Role role) { // what stands for 1 in a colour
        if (column[role] < 0) return 1.0f;
        const Type type = element.properties[std::size_t(column[role])].type;
        return type == Type::uint8 ? 255.0f : type == Type::uint16 ? 65535.0f : type >= Type::float32 ? 1.0f : 255.0f;
    };
    const std::array<float, 4> units{unit(red), unit(green), unit(blue), unit(alpha)};

    const std::uint64_t row_bytes =
        sizeof(Vec3f) * (has_normals ? 2 : 1) + (has_colors ? sizeof(Vec4f) : 0) + (has_uvs ? sizeof(Vec2f) : 0);
    check_memory(element.count * row_bytes, params_, path_);
    const auto count = static_cast<std::size_t>(element.count);
    contents_.positions.reserve(count + 1);
    if (has_normals) contents_.normals.reserve(count);
    if (has_colors) contents_.colors.reserve(count);
    if (has_uvs) contents_.uvs.reserve(count);

    std::array<float, kRoles + 1> value{};
    value[alpha] = 1;
    for (std::uint64_t row = 0; row < element.count; ++row) {
        check(row);
        begin_row();
        for (std::size_t i = 0; i < role_of.size(); ++i) {
            const Property& p = element.properties[i];
            if (p.count_type)
                for (std::uint64_t n = list_length(p); n > 0; --n) (void)scalar(p.type);
            else
                value[role_of[i]] = static_cast<float>(scalar(p.type));
        }
        end_row();
        contents_.positions.push_back({value[x], value[y], value[z]});
        if (has_normals) contents_.normals.push_back(normalize(Vec3f{value[nx], value[ny], value[nz]}, Vec3f{}));
        if (has_colors)
            contents_.colors.push_back({value[red] / units[0], value[green] / units[1], value[blue] / units[2],
                                        column[alpha] < 0 ? 1.0f : value[alpha] / units[3]});
        if (has_uvs) contents_.uvs.push_back({value[u], value[v]});
    }
}

void DataReader::read_faces(const Element& element, bool strips) {
    const std::ptrdiff_t list = element.find({"vertex_indices", "vertex_index"});
    if (list < 0 || !element.properties[std::size_t(list)].count_type) {
        if (element.count > 0) contents_.bad_faces.note(0, "the faces have no list vertex_indices");
        return skip(element);
    }
    std::vector<std::uint32_t>& out = strips ? contents_.strips : contents_.corners;
    for (std::uint64_t row = 0; row < element.count; ++row) {
        check(row);
        begin_row();
        std::string fault;
        const std::size_t first = out.size();
        for (std::size_t i = 0; i < element.properties.size(); ++i) {
            const Property& p = element.properties[i];
            const std::uint64_t n = p.count_type ? list_length(p) : 1;
            for (std::uint64_t k = 0; k < n; ++k) {
                const double value = scalar(p.type);
                if (i != std::size_t(list)) continue;
                if (value == -1 && strips) {
                    out.push_back(Contents::kRestart);
                } else if (!(value >= 0) || value > 4294967294.0 || value != std::floor(value)) {
                    if (fault.empty()) fault = "vertex " + std::to_string(value) + " does not exist";
                    out.push_back(Contents::kRestart);
                } else {
                    out.push_back(static_cast<std::uint32_t>(value));
                }
            }
        }
        end_row();
        if (out.size() > 0xFFFFFFF0u) throw Error(ErrorKind::limit, "E0904", path_, "more than 2^32 corners");
        if (strips) {
            out.push_back(Contents::kRestart);
        } else if (!fault.empty() || out.size() - first < 3) {
            if (fault.empty()) fault = std::to_string(out.size() - first) + " corners";
            contents_.bad_faces.note(0, "face " + std::to_string(row) + ": " + fault);
            out.resize(first);
        } else {
            contents_.face_end.push_back(static_cast<std::uint32_t>(out.size()));
        }
    }
}

// ---------------------------------------------------------------- the mesh

void add_polygons(Mesh& mesh, Contents& contents, WarningLog& log, const std::string& path) {
    Triangulator triangulator;
    std::vector<Vec3f> points;
    mesh.triangles.reserve(contents.face_end.size());
    const std::size_t vertices = mesh.positions.size();
    for (std::size_t face = 0, first = 0; face < contents.face_end.size(); first = contents.face_end[face++]) {
        const std::span corners(contents.corners.data() + first, contents.face_end[face] - first);
        const auto beyond =
            std::find_if(corners.begin(), corners.end(), [&](std::uint32_t v) { return v >= vertices; });
        if (beyond != corners.end()) {
            contents.bad_faces.note(0, "face " + std::to_string(face) + ": vertex " + std::to_string(*beyond) + " of " +
                                           std::to_string(vertices));
        } else if (corners.size() == 3) {
            mesh.triangles.push_back({corners[0], corners[1], corners[2]});
        } else {
            points.clear();
            for (const std::uint32_t v : corners) points.push_back(mesh.positions[v]);
            for (const Vec3u t : triangulator.triangulate(points))
                mesh.triangles.push_back({corners[t.x], corners[t.y], corners[t.z]});
        }
    }
    if (triangulator.gave_up())
        log.add("W0505", path,
                std::to_string(triangulator.gave_up()) + " concave polygons are too large and cut roughly");
}

/// Every other triangle of a strip is turned round.
void add_strips(Mesh& mesh, Contents& contents) {
    const std::vector<std::uint32_t>& strip = contents.strips;
    bool turned = false;
    for (std::size_t i = 0; i + 2 < strip.size(); ++i) {
        if (strip[i] == Contents::kRestart) {
            turned = false;
            continue;
        }
        if (strip[i + 1] == Contents::kRestart || strip[i + 2] == Contents::kRestart) continue;
        const Vec3u t =
            turned ? Vec3u{strip[i + 1], strip[i], strip[i + 2]} : Vec3u{strip[i], strip[i + 1], strip[i + 2]};
        turned = !turned;
        if (std::max({t.x, t.y, t.z}) < mesh.positions.size())
            mesh.triangles.push_back(t);
        else
            contents.bad_faces.note(0, "strip: vertex " + std::to_string(std::max({t.x, t.y, t.z})) + " of " +
                                           std::to_string(mesh.positions.size()));
    }
}

Mesh make_mesh(Contents& contents, WarningLog& log, const std::string& path) {
    Mesh mesh;
    mesh.positions = std::move(contents.positions);
    mesh.normals = std::move(contents.normals);
    mesh.colors = std::move(contents.colors);
    mesh.uv[0] = std::move(contents.uvs);
    add_polygons(mesh, contents, log, path);
    add_strips(mesh, contents);
    mesh.submeshes = {{0, std::uint32_t(mesh.triangles.size()), 0}};
    fill_missing_normals(mesh);
    const auto sane = [](float v) { return std::isfinite(v) ? clamp01(v) : 1.0f; };
    for (Vec4f& c : mesh.colors) {
        const Vec3f linear = linear_color({sane(c.x), sane(c.y), sane(c.z)});
        c = {linear.x, linear.y, linear.z, sane(c.w)};
    }
    for (Vec2f& uv : mesh.uv[0]) {
        uv.y = 1.0f - uv.y; // images have their first row on top
        if (!std::isfinite(uv.x) || !std::isfinite(uv.y)) uv = {};
    }
    return mesh;
}

} // namespace

Scene read_ply(const FileBytes& file, const std::filesystem::path& path, const LoadParams& params,
               const Control& control) {
    const std::string name = path.string();
    const Header header = HeaderReader(file.text(), name).read();
    WarningLog log;
    Contents contents = DataReader(file.text(), header, name, params, control).read(log);
    const bool has_points = !contents.positions.empty();

    Scene scene;
    scene.format = "PLY";
    Mesh mesh = make_mesh(contents, log, name);
    if (contents.bad_faces.count) {
        const std::string what = contents.bad_faces.first;
        if (mesh.triangles.empty()) throw Error(ErrorKind::input, "E0504", name, "no face can be used: " + what);
        log.add("W0501", name,
                std::to_string(contents.bad_faces.count) + (contents.bad_faces.count > 1 ? " faces" : " face") +
                    " left out; the first: " + what);
    }
    if (mesh.triangles.empty()) {
        if (has_points) log.add("W0503", name, "the file has points but no faces; points are not drawn");
        scene.warnings = log.take(name);
        return scene;
    }

    const bool colored = !mesh.colors.empty();
    const bool blended = std::any_of(mesh.colors.begin(), mesh.colors.end(), [](Vec4f c) { return c.w < 1; });
    const bool textured = !mesh.uv[0].empty();
    MeshRepair dropped;
    add_part(scene, std::move(mesh), file_stem(path), dropped);
    assign_paths(scene, {{scene.parts[0].name}});
    report_dropped(dropped, "W0504", name, log);

    Material material = plain_material();
    if (blended) material.alpha_mode = AlphaMode::blend;
    if (textured && !header.texture_file.empty()) {
        TextureFiles files(path, params);
        if (files.find(header.texture_file, at_line(name, header.texture_line), log) != kNone) {
            scene.images = files.decode(control, log);
            scene.textures.push_back({0, Wrap::repeat, Wrap::repeat, false});
            material.base_color_texture.texture = 0;
        }
    }
    if (colored || material.base_color_texture.texture != kNone) material.base_color = {1, 1, 1, 1};
    scene.materials.push_back(material);
    scene.warnings = log.take(name);
    return scene;
}

} // namespace porthole
