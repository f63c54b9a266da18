#include "porthole/io/obj_parse.h"

#include <algorithm>
#include <limits>
#include <unordered_map>

#include "porthole/io/files.h"
#include "porthole/io/text_cursor.h"

namespace porthole {

std::uint64_t ObjData::bytes() const {
    return positions.capacity() * sizeof(Vec3f) + colors.capacity() * sizeof(Vec4f) + uvs.capacity() * sizeof(Vec2f) +
           normals.capacity() * sizeof(Vec3f) + corners.capacity() * sizeof(ObjCorner) +
           face_end.capacity() * sizeof(std::uint32_t) + runs.capacity() * sizeof(ObjRun) +
           early.capacity() * sizeof(early[0]) + parts.capacity() * sizeof(ObjPart) +
           objects.capacity() * sizeof(std::string);
}

std::uint64_t ObjData::line_of(std::uint32_t face) const {
    const auto found = std::lower_bound(early.begin(), early.end(), std::pair{face, std::uint64_t(0)});
    return found != early.end() && found->first == face ? found->second : 0;
}

namespace {

constexpr float kUnreadable = std::numeric_limits<float>::quiet_NaN();
constexpr Vec4f kUncolored{kUnreadable, kUnreadable, kUnreadable, 1}; ///< becomes white

class ObjParser {
public:
    ObjParser(std::string_view text, const std::string& path, const LoadParams& params, const Control& control)
        : text_(text), cursor_(text, true), path_(path), params_(params), control_(control) {
        data_.materials.emplace_back();
        data_.material_line.push_back(0);
    }
    ObjData parse();

private:
    void statement(std::string_view keyword);
    void vertex();
    void normal();
    void texture_coordinate();
    void face();
    /// One index of a face's corner, from 0; `count` are known so far.
    bool index(std::size_t count, std::int32_t& out, std::string& fault);
    bool corner(ObjCorner& out, std::string& fault);
    std::uint32_t current_part();
    void use_material(std::string_view name);
    void check();
    std::string quoted_line(const char* first);

    std::string_view text_;
    TextCursor cursor_;
    const std::string& path_;
    const LoadParams& params_;
    const Control& control_;
    ObjData data_;
    std::string group_;
    std::uint32_t material_ = 0;
    bool regrouped_ = true; ///< the next face looks its part up again
    bool names_later_vertex_ = false;
    std::unordered_map<std::string, std::uint32_t> part_of_group_;
    std::unordered_map<std::string, std::uint32_t> material_of_name_;
    std::vector<ObjCorner> face_;
};

ObjData ObjParser::parse() {
    if (text_.starts_with("\xEF\xBB\xBF")) cursor_ = TextCursor(text_.substr(3), true);
    for (std::uint64_t n = 0; !cursor_.at_end(); ++n) {
        if (n % 65536 == 0) check();
        if (!cursor_.at_line_end()) statement(cursor_.word());
        cursor_.next_line();
    }
    check();
    // Colours are written as 0..1, by some programs as 0..255.
    const bool bytes = std::any_of(data_.colors.begin(), data_.colors.end(), [](Vec4f c) {
        return std::max({c.x, c.y, c.z}) > 1.0f;
    });
    for (Vec4f& c : data_.colors) {
        const float scale = bytes ? 1.0f / 255.0f : 1.0f;
        const auto sane = [&](float v) { return std::isfinite(v) ? clamp01(v * scale) : 1.0f; };
        const Vec3f linear = linear_color({sane(c.x), sane(c.y), sane(c.z)});
        c = {linear.x, linear.y, linear.z, std::isfinite(c.w) ? clamp01(c.w) : 1.0f};
    }
    return std::move(data_);
}

void ObjParser::check() {
    if (control_.stop.stop_requested()) throw Cancelled{};
    if (control_.progress)
        control_.progress("load", double(cursor_.position() - text_.data()) / double(text_.size() + 1));
    check_memory(data_.bytes(), params_, path_);
    constexpr std::size_t kMost = std::size_t(std::numeric_limits<std::int32_t>::max()) - 65536;
    if (std::max({data_.positions.size(), data_.uvs.size(), data_.normals.size()}) > kMost ||
        data_.corners.size() > 2 * kMost)
        throw Error(ErrorKind::limit, "E0904", at_line(path_, cursor_.line()),
                    "more than 2^31 vertices or 2^32 corners");
}

/// The line's text from its keyword on, for a message.
std::string ObjParser::quoted_line(const char* first) {
    const char* const end = text_.data() + text_.size();
    const char* const last =
        std::find_if(first, std::min(end, first + 200), [](char c) { return c == '\n' || c == '\r'; });
    return "'" + escaped({first, std::size_t(last - first)}, 80) + "'";
}

void ObjParser::statement(std::string_view keyword) {
    const auto known = [&] { ++data_.known_statements; };
    if (keyword == "v") return known(), vertex();
    if (keyword == "f" || keyword == "fo") return known(), face(); // "fo": an old spelling
    if (keyword == "vt") return known(), texture_coordinate();
    if (keyword == "vn") return known(), normal();
    if (keyword == "usemtl") return known(), use_material(cursor_.rest_of_line());
    if (keyword == "g") {
        known();
        group_ = std::string(cursor_.rest_of_line());
        regrouped_ = true;
        return;
    }
    if (keyword == "o") {
        known();
        data_.objects.emplace_back(cursor_.rest_of_line());
        group_.clear();
        part_of_group_.clear();
        regrouped_ = true;
        return;
    }
    if (keyword == "mtllib") {
        known();
        data_.libraries.emplace_back(std::string(cursor_.rest_of_line()), cursor_.line());
        return;
    }
    static constexpr std::string_view looks[] = {"s",        "mg",       "lod",    "shadow_obj", "trace_obj", "bevel",
                                                 "c_interp", "d_interp", "usemap", "maplib",     "stech",     "ctech"};
    static constexpr std::string_view shapes[] = {"p",     "l",    "vp",   "cstype", "deg",  "bmat", "step", "curv",
                                                  "curv2", "surf", "parm", "trim",   "hole", "scrv", "sp",   "end",
                                                  "con",   "bzp",  "bsp",  "res",    "cdc",  "cdp"};
    static constexpr std::string_view commands[] = {"csh", "call", "scmp"};
    const auto among = [&](const auto& list) {
        return std::find(std::begin(list), std::end(list), keyword) != std::end(list);
    };
    if (among(looks)) return known();
    if (among(shapes)) return known(), data_.not_drawn.note(cursor_.line(), keyword);
    if (among(commands)) return known(), data_.commands.note(cursor_.line(), quoted_line(keyword.data()));
    data_.unknown.note(cursor_.line(), quoted_line(keyword.data()));
}

void ObjParser::vertex() {
    const char* const first = cursor_.position();
    const std::uint64_t line = cursor_.line();
    float values[7];
    int count = 0;
    bool readable = true;
    while (count < 7 && !cursor_.at_line_end()) {
        if (!cursor_.number(values[count])) {
            readable = false;
            break;
        }
        ++count;
    }
    Vec3f position{kUnreadable, kUnreadable, kUnreadable};
    if (readable && count >= 3) position = {values[0], values[1], values[2]};
    if (!is_finite(position)) data_.bad_vertices.note(line, quoted_line(first - 1));
    data_.positions.push_back(position);
    if (count >= 6) {
        // Vertices before the first coloured one are white.
        data_.colors.resize(data_.positions.size() - 1, kUncolored);
        data_.colors.push_back({values[3], values[4], values[5], count == 7 ? values[6] : 1.0f});
    } else if (!data_.colors.empty()) {
        data_.colors.push_back(kUncolored);
    }
}

void ObjParser::normal() {
    Vec3f n;
    const char* const first = cursor_.position();
    if (!cursor_.number(n.x) || !cursor_.number(n.y) || !cursor_.number(n.z)) {
        data_.bad_references.note(cursor_.line(), quoted_line(first - 2));
        n = {kUnreadable, kUnreadable, kUnreadable};
    }
    data_.normals.push_back(n);
}

void ObjParser::texture_coordinate() {
    Vec2f t;
    const char* const first = cursor_.position();
    if (!cursor_.number(t.x) || (!cursor_.at_line_end() && !cursor_.number(t.y)) || !std::isfinite(t.x) ||
        !std::isfinite(t.y)) {
        data_.bad_references.note(cursor_.line(), quoted_line(first - 2));
        t = {};
    }
    data_.uvs.push_back(t);
}

bool ObjParser::index(std::size_t count, std::int32_t& out, std::string& fault) {
    std::int64_t value = 0;
    if (!cursor_.integer(value)) {
        fault = "a corner is not a number";
        return false;
    }
    const std::int64_t from_zero = value > 0 ? value - 1 : value + std::int64_t(count);
    if (value == 0)
        fault = "index 0 (the first is 1)";
    else if (from_zero < 0 || from_zero > std::numeric_limits<std::int32_t>::max() - 1)
        fault = "index " + std::to_string(value) + " where " + std::to_string(count) + " are defined";
    else
        out = std::int32_t(from_zero);
    return fault.empty();
}

bool ObjParser::corner(ObjCorner& out, std::string& fault) {
    cursor_.skip_blanks();
    if (!index(data_.positions.size(), out.v, fault)) return false;
    if (std::size_t(out.v) >= data_.positions.size()) names_later_vertex_ = true;
    if (!cursor_.accept('/')) return cursor_.at_word_end() || (fault = "a corner is not a number", false);
    // A bad texture or normal index costs only itself.
    const auto extra = [&](std::size_t count, std::int32_t& index_out) {
        std::string extra_fault;
        if (index(count, index_out, extra_fault)) return;
        index_out = -1;
        data_.bad_references.note(cursor_.line(), extra_fault);
    };
    if (!cursor_.accept('/')) {
        if (!cursor_.at_word_end()) extra(data_.uvs.size(), out.vt);
        if (!cursor_.accept('/')) return cursor_.at_word_end() || (fault = "a corner is not a number", false);
    }
    if (!cursor_.at_word_end()) extra(data_.normals.size(), out.vn);
    return cursor_.at_word_end() || (fault = "a corner is not a number", false);
}

void ObjParser::face() {
    ++data_.face_statements;
    const std::uint64_t line = cursor_.line();
    face_.clear();
    names_later_vertex_ = false;
    std::string fault;
    while (!cursor_.at_line_end()) {
        ObjCorner c;
        if (!corner(c, fault)) return data_.bad_faces.note(line, fault);
        face_.push_back(c);
    }
    if (face_.size() < 3) return data_.bad_faces.note(line, "a face with " + std::to_string(face_.size()) + " corners");

    const auto face_index = static_cast<std::uint32_t>(data_.face_end.size());
    if (regrouped_) {
        const ObjRun run{face_index, current_part(), material_};
        if (data_.runs.empty() || data_.runs.back().part != run.part || data_.runs.back().material != run.material)
            data_.runs.push_back(run);
        regrouped_ = false;
    }
    if (names_later_vertex_) data_.early.emplace_back(face_index, line);
    data_.corners.insert(data_.corners.end(), face_.begin(), face_.end());
    data_.face_end.push_back(static_cast<std::uint32_t>(data_.corners.size()));
    constexpr std::size_t kHuge = 10000;
    if (face_.size() >= kHuge) data_.huge_faces.note(line, std::to_string(face_.size()) + " corners");
    // A line of any length must not pass the limits between two checks.
    if (face_.size() > 65536) check();
}

std::uint32_t ObjParser::current_part() {
    const auto [entry, is_new] = part_of_group_.emplace(group_, static_cast<std::uint32_t>(data_.parts.size()));
    if (is_new) data_.parts.push_back({std::int32_t(data_.objects.size()) - 1, group_});
    return entry->second;
}

void ObjParser::use_material(std::string_view name) {
    const auto [entry, is_new] =
        material_of_name_.emplace(std::string(name), static_cast<std::uint32_t>(data_.materials.size()));
    if (is_new) {
        data_.materials.emplace_back(name);
        data_.material_line.push_back(cursor_.line());
    }
    material_ = entry->second;
    regrouped_ = true;
}

} // namespace

ObjData parse_obj(std::string_view text, const std::string& path, const LoadParams& params, const Control& control) {
    return ObjParser(text, path, params, control).parse();
}

} // namespace porthole
