#include <algorithm>
#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>
#include <set>

#include "porthole/report.h"
#include "porthole/report_fields.h"

namespace porthole {

namespace {

using Json = nlohmann::ordered_json;

constexpr std::size_t kMaxBytes = std::size_t(64) << 20;
constexpr std::size_t kMaxValues = std::size_t(4) << 20;
constexpr int kMaxDepth = 16;
constexpr double kMaxSize = 32768, kMaxMargin = 65536; ///< pixels

/// A value of the report with its place. Whatever is wrong with it names that place.
class Node {
public:
    Node(const Json& json, std::string pointer, const std::string& file)
        : json_(&json), pointer_(std::move(pointer)), file_(&file) {}

    [[noreturn]] void fail(const std::string& reason) const {
        throw Error(ErrorKind::input, "E0220", *file_ + ":" + (pointer_.empty() ? "/" : pointer_), reason);
    }
    [[noreturn]] void refuse(const std::string& expected) const {
        std::string text =
            json_->is_structured() ? json_->type_name() : json_->dump(-1, ' ', true, Json::error_handler_t::replace);
        if (text.size() > 80) text = text.substr(0, 77) + "...";
        fail(text + " is not " + expected);
    }
    [[nodiscard]] Node operator[](const char* key) const {
        if (!json_->is_object()) refuse("an object");
        const auto found = json_->find(key);
        if (found == json_->end())
            fail(std::string("\"") + key + "\" is missing; is this a report of another version?");
        return {*found, pointer_ + '/' + key, *file_};
    }
    [[nodiscard]] Node at(std::size_t i) const { return {(*json_)[i], pointer_ + '/' + std::to_string(i), *file_}; }
    /// Of an array.
    [[nodiscard]] std::size_t size() const {
        if (!json_->is_array()) refuse("a list");
        return json_->size();
    }
    [[nodiscard]] bool is_null() const { return json_->is_null(); }
    [[nodiscard]] const Json& json() const { return *json_; }

    [[nodiscard]] double number(double low, double high) const {
        const double v = json_->is_number() ? json_->get<double>() : std::numeric_limits<double>::quiet_NaN();
        if (!(v >= low && v <= high)) refuse("a number from " + Json(low).dump() + " to " + Json(high).dump());
        return v;
    }
    [[nodiscard]] std::int64_t integer(double low, double high) const {
        const double v = number(low, high);
        if (v != std::floor(v)) refuse("a whole number");
        return std::int64_t(v);
    }
    [[nodiscard]] bool boolean() const {
        if (!json_->is_boolean()) refuse("true or false");
        return json_->get<bool>();
    }
    [[nodiscard]] std::string text() const {
        if (!json_->is_string()) refuse("text");
        return json_->get<std::string>();
    }
    [[nodiscard]] std::string text_or_null() const { return is_null() ? std::string() : text(); }
    [[nodiscard]] Vec3f vector(double limit) const {
        if (size() != 3) refuse("three numbers");
        const auto at = [&](std::size_t i) { return float(this->at(i).number(-limit, limit)); };
        return {at(0), at(1), at(2)};
    }
    template <typename Enum> [[nodiscard]] Enum choice() const {
        const std::string word = text();
        std::string words;
        for (int i = 0; i < 256; ++i)
            if (const char* const name = fields::name_of(Enum(i))) {
                if (word == name) return Enum(i);
                words += (words.empty() ? "" : ", ") + std::string(name);
            }
        refuse("one of " + words);
    }

private:
    const Json* json_;
    std::string pointer_;
    const std::string* file_;
};

PartId part_of(const Node& node) { return PartId(std::uint32_t(node.integer(0, 4294967294.0))); }

/// Reads the fields of `options` and remembers their names.
struct FieldReader {
    const Node& options;
    Report& report;
    std::set<std::string, std::less<>>& known;
    template <typename T> void operator()(const char* name, T& value) const {
        known.insert(name);
        read(options[name], value);
    }

    static void read(const Node& node, int& v) { v = int(node.integer(-2147483648.0, 2147483647.0)); }
    static void read(const Node& node, float& v) { v = float(node.number(-1e30, 1e30)); }
    static void read(const Node& node, double& v) { v = node.number(-1e300, 1e300); }
    static void read(const Node& node, bool& v) { v = node.boolean(); }
    static void read(const Node& node, Vec3f& v) { v = node.vector(1e30); }
    template <typename T>
    requires std::is_enum_v<T>
    static void read(const Node& node, T& v) { v = node.choice<T>(); }
    static void read(const Node& node, std::optional<Length>& v) {
        v.reset();
        if (node.is_null()) return;
        if (node.size() != 2) node.refuse("a number and a unit");
        v = Length{node.at(1).choice<Length::Unit>(), node.at(0).number(0, 1e300)};
    }
    static void read(const Node& node, std::optional<double>& v) {
        v.reset();
        if (!node.is_null()) v = node.number(-1e300, 1e300);
    }
    static void read(const Node& node, std::vector<Vec2f>& v) {
        v.clear();
        for (std::size_t i = 0; i < node.size(); ++i) {
            const Node pair = node.at(i);
            if (pair.size() != 2) pair.refuse("two numbers");
            v.push_back({float(pair.at(0).number(-1e30, 1e30)), float(pair.at(1).number(-1e30, 1e30))});
        }
    }
    void read(const Node& node, std::vector<PartId>& v) const {
        v.clear();
        for (std::size_t i = 0; i < node.size(); ++i) {
            v.push_back(part_of(node.at(i)["id"]));
            report.option_paths[v.back()] = node.at(i)["path"].text();
        }
    }
};

void read_options(const Node& node, Report& report) {
    std::set<std::string, std::less<>> known{"isa"};
    report.run.isa = node["isa"].text();
    if (report.run.isa != "avx2" && report.run.isa != "native") node["isa"].refuse("one of avx2, native");
    fields::for_each(report.options, FieldReader{node, report, known});
    // An option that is not known cannot be honoured, and would change the picture.
    for (const auto& [key, value] : node.json().items())
        if (!known.contains(key)) node[key.c_str()].fail("not an option; is this a report of another version?");
}

PixelRuns read_runs(const Node& node) {
    PixelRuns runs;
    const Node window = node["window"];
    if (window.size() != 4) window.refuse("four numbers");
    const auto at = [&](std::size_t i) {
        return std::int32_t(window.at(i).integer(-kMaxMargin, kMaxSize + kMaxMargin));
    };
    runs.window = {at(0), at(1), at(2), at(3)};
    runs.runs = node["runs"].text();
    return runs;
}

View read_view(const Node& camera, const Node& size) {
    View view;
    view.orthographic = camera["orthographic"].boolean();
    view.world_from_camera = {camera["right"].vector(2), camera["up"].vector(2), -camera["forward"].vector(2),
                              camera["position"].vector(1e15)};
    const Affine3f& a = view.world_from_camera;
    const float wrong = std::max({std::abs(dot(a.x, a.x) - 1), std::abs(dot(a.y, a.y) - 1), std::abs(dot(a.z, a.z) - 1),
                                  std::abs(dot(a.x, a.y)), std::abs(dot(a.y, a.z)), std::abs(dot(a.z, a.x))});
    if (!(wrong < 1e-3f)) camera.fail("right, up and forward are not unit vectors at right angles");
    view.half_height = float(
        camera[view.orthographic ? "half_height" : "tan_half_fov_y"].number(1e-12, view.orthographic ? 1e15 : 1e6));
    if (size.size() != 2) size.refuse("two numbers");
    view.width = std::int32_t(size.at(0).integer(1, kMaxSize));
    view.height = std::int32_t(size.at(1).integer(1, kMaxSize));
    return view;
}

Json parse(std::string_view text, const std::string& where) {
    if (text.size() > kMaxBytes)
        throw Error(ErrorKind::limit, "E0902", where, "a report of more than 64 MB is not read");
    std::size_t values = 0;
    const auto limit = [&](int depth, Json::parse_event_t, const Json&) {
        if (depth > kMaxDepth)
            throw Error(ErrorKind::input, "E0220", where, "the JSON is nested too deeply for a report");
        if (++values > 4 * kMaxValues)
            throw Error(ErrorKind::limit, "E0902", where, "a report of more than 4 million values is not read");
        return true;
    };
    try {
        return Json::parse(text, limit);
    } catch (const Json::exception& e) {
        std::string_view reason = e.what();
        if (const auto bracket = reason.find("] "); bracket != reason.npos) reason.remove_prefix(bracket + 2);
        throw Error(ErrorKind::input, "E0220", where, "not valid JSON: " + std::string(reason.substr(0, 200)));
    }
}

} // namespace

Report read_report(std::string_view text, const std::string& where) {
    const Json json = parse(text, where);
    const Node root(json, "", where);
    Report report;
    report.version = root["version"].text();
    report.command = root["command"].text();
    if (report.command != "reveal" && report.command != "render") root["command"].refuse("one of reveal, render");

    const Node model = root["model"];
    report.model.path = model["path"].text();
    report.model.bytes = std::uint64_t(model["bytes"].integer(0, 9e15));
    report.model.sha256 = model["sha256"].text_or_null();
    report.model.format = model["format"].text_or_null();
    report.model.time = model["time"].number(-1, 1e6);
    const std::string up = model["up"].text();
    if (up != "y" && up != "z") model["up"].refuse("one of y, z");
    report.model.up = up[0];
    report.model.metres_per_unit = model["metres_per_unit"].number(1e-9, 1e9);

    report.camera = root["camera"]["name"].text();
    report.view = read_view(root["camera"], root["size"]);
    read_options(root["options"], report);
    report.options.view = report.view;

    const Node targets = root["targets"];
    for (std::size_t i = 0; i < targets.size(); ++i) {
        TargetReport target;
        target.part = part_of(targets.at(i)["id"]);
        target.path = targets.at(i)["path"].text();
        target.thin = targets.at(i)["thin"].boolean();
        target.refused = targets.at(i)["refused"].text_or_null();
        target.alone = read_runs(targets.at(i)["alone"]);
        target.mask = read_runs(targets.at(i)["mask"]);
        report.targets.push_back(std::move(target));
    }
    const Node picture = root["picture"];
    report.picture.mask = read_runs(picture["mask"]);
    report.picture.file = picture["file"].text_or_null();
    report.picture.sha256 = picture["sha256"].text_or_null();
    report.picture.bits = int(picture["bits"].integer(8, 16));
    if (report.picture.bits != 8 && report.picture.bits != 16) picture["bits"].refuse("8 or 16");
    report.picture.no_background = picture["no_background"].boolean();
    return report;
}

} // namespace porthole
