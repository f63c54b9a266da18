#include "porthole/io/gltf_json.h"

#include <cmath>
#include <cstring>
#include <vector>

namespace porthole::gltf {
namespace {

constexpr std::size_t kMaxDepth = 512;
constexpr std::size_t kWarningsPerCode = 20;
// A value in an array or object costs this much on the average, name and tree node included.
constexpr std::uint64_t kBytesPerValue = 48;

// Builds the tree from parser events. A stack of its own instead of recursion, and a bound on
// it, because destroying and searching the tree must stay cheap as well.
class TreeBuilder : public nlohmann::json_sax<Json> {
public:
    TreeBuilder(const std::string& file, std::uint64_t byte_base, std::uint64_t max_bytes)
        : file_(file), byte_base_(byte_base), max_values_(max_bytes / kBytesPerValue) {}

    Json take() { return std::move(root_); }

    bool null() override { return add(nullptr) != nullptr; }
    bool boolean(bool value) override { return add(value) != nullptr; }
    bool number_integer(number_integer_t value) override { return add(value) != nullptr; }
    bool number_unsigned(number_unsigned_t value) override { return add(value) != nullptr; }
    bool number_float(number_float_t value, const string_t&) override { return add(value) != nullptr; }
    bool string(string_t& value) override { return add(std::move(value)) != nullptr; }
    bool binary(binary_t&) override { return false; }
    bool start_object(std::size_t) override { return open(Json::value_t::object); }
    bool start_array(std::size_t) override { return open(Json::value_t::array); }
    bool end_object() override { return close(); }
    bool end_array() override { return close(); }
    bool key(string_t& name) override {
        slot_ = &(*open_.back())[std::move(name)];
        return true;
    }
    bool parse_error(std::size_t position, const std::string&, const nlohmann::detail::exception& e) override {
        // The library's text is "[json.exception...] parse error at line 1, column 2: ..."
        std::string_view text = e.what();
        if (const auto bracket = text.find("] "); bracket != text.npos) text.remove_prefix(bracket + 2);
        const std::uint64_t byte = byte_base_ + (position > 0 ? position - 1 : 0);
        throw Error(ErrorKind::input, "E0302", file_ + ":byte " + std::to_string(byte),
                    "not valid JSON: " + shortened(text, 200) + "; is the file truncated or of another kind?");
    }

private:
    template <typename T> Json* add(T&& value) {
        if (++values_ > max_values_)
            throw Error(ErrorKind::limit, "E0902", file_,
                        "the JSON has more than " + std::to_string(max_values_) +
                            " values; raise the memory limit to read it");
        if (open_.empty()) return &(root_ = Json(std::forward<T>(value)));
        if (open_.back()->is_array())
            return &open_.back()->get_ref<Json::array_t&>().emplace_back(std::forward<T>(value));
        return &(*slot_ = Json(std::forward<T>(value)));
    }
    bool open(Json::value_t kind) {
        if (open_.size() == kMaxDepth)
            throw Error(ErrorKind::input, "E0302", file_,
                        "JSON values nest deeper than " + std::to_string(kMaxDepth) + "; no model needs that");
        open_.push_back(add(kind));
        return true;
    }
    bool close() {
        open_.pop_back();
        return true;
    }

    const std::string& file_;
    std::uint64_t byte_base_, max_values_, values_ = 0;
    Json root_;
    std::vector<Json*> open_;
    Json* slot_ = nullptr;
};

std::string type_error(const Json& value, std::string_view expected) {
    std::string found = value.type_name();
    if (value.is_number()) found += " (" + value.dump() + ")";
    return "is of type " + found + ", expected " + std::string(expected);
}

std::string escape_pointer(std::string_view token) {
    std::string out;
    for (const char c : token) {
        if (c == '~')
            out += "~0";
        else if (c == '/')
            out += "~1";
        else
            out += c;
    }
    return out;
}

} // namespace

std::string shortened(std::string_view text, std::size_t limit) {
    if (text.size() <= limit) return std::string(text);
    while (limit > 0 && (static_cast<unsigned char>(text[limit]) & 0xC0u) == 0x80u) --limit; // no half character
    return std::string(text.substr(0, limit)) + "...";
}

Json parse_json(std::string_view text, const std::string& file, std::uint64_t byte_base, std::uint64_t max_bytes) {
    if (text.starts_with("\xEF\xBB\xBF"))
        throw Error(ErrorKind::input, "E0302", file + ":byte " + std::to_string(byte_base),
                    "the JSON begins with a byte order mark, which glTF forbids; save it as UTF-8 without one");
    TreeBuilder builder(file, byte_base, max_bytes);
    Json::sax_parse(text.begin(), text.end(), &builder);
    return builder.take();
}

std::string Document::pointer_of(const Json& at) const {
    struct Frame {
        const Json* value;
        Json::const_iterator member;
    };
    std::vector<Frame> path;
    if (&root_ != &at) path.push_back({&root_, root_.begin()});
    while (!path.empty()) {
        Frame& top = path.back();
        if (top.member == top.value->end()) {
            path.pop_back();
            if (!path.empty()) ++path.back().member;
            continue;
        }
        const Json& member = *top.member;
        if (&member == &at) break;
        if (member.is_structured())
            path.push_back({&member, member.begin()});
        else
            ++top.member;
    }
    std::string pointer;
    for (const Frame& frame : path)
        pointer += '/' + (frame.value->is_object() ? escape_pointer(frame.member.key())
                                                   : std::to_string(frame.member - frame.value->begin()));
    return pointer;
}

std::string Document::where(const Json& at, std::string_view below) const {
    std::string pointer = pointer_of(at);
    if (!below.empty()) pointer += '/' + std::string(below);
    return pointer.empty() ? file_ : file_ + ':' + pointer;
}

void Document::fail(const char* code, const Json& at, std::string_view below, const std::string& reason) const {
    throw Error(ErrorKind::input, code, where(at, below), reason);
}

void Document::fail_limit(const Json& at, std::string_view below, const std::string& reason) const {
    throw Error(ErrorKind::limit, "E0902", where(at, below), reason);
}

void Document::warn(const char* code, const Json& at, std::string_view below, const std::string& reason) {
    if (++count_by_code_[code] > kWarningsPerCode) return;
    warnings_.push_back({code, where(at, below), reason});
}

Warnings Document::take_warnings() {
    for (const auto& [code, count] : count_by_code_)
        if (count > kWarningsPerCode)
            warnings_.push_back(
                {code, file_, std::to_string(count - kWarningsPerCode) + " more warnings of this kind"});
    count_by_code_.clear();
    return std::move(warnings_);
}

const Json* Document::find(const Json& object, std::string_view key) {
    const auto member = object.find(key);
    return member == object.end() ? nullptr : &*member;
}

const Json* Document::object(const Json& object, std::string_view key) const {
    const Json* value = find(object, key);
    if (value && !value->is_object()) fail("E0303", *value, {}, type_error(*value, "object"));
    return value;
}

const Json* Document::extension(const Json& object, std::string_view name) const {
    const Json* all = this->object(object, "extensions");
    return all ? this->object(*all, name) : nullptr;
}

std::span<const Json> Document::list(const Json& object, std::string_view key) const {
    const Json* value = find(object, key);
    if (!value) return {};
    if (!value->is_array()) fail("E0303", *value, {}, type_error(*value, "array"));
    return value->get_ref<const Json::array_t&>();
}

std::span<const Json> Document::list_of_objects(const Json& object, std::string_view key) const {
    const std::span<const Json> all = list(object, key);
    for (const Json& value : all)
        if (!value.is_object()) fail("E0303", value, {}, type_error(value, "object"));
    return all;
}

const Json& Document::element(std::string_view key, std::size_t i) const {
    const Json& value = list(root_, key)[i];
    if (!value.is_object()) fail("E0303", value, {}, type_error(value, "object"));
    return value;
}

std::optional<std::uint64_t> Document::as_uint(const Json& value) {
    if (value.is_number_integer() && (value.is_number_unsigned() || value.get<std::int64_t>() >= 0)) {
        const auto v = value.get<std::uint64_t>();
        return v <= (1ull << 53) ? std::optional(v) : std::nullopt;
    }
    if (value.is_number_float()) {
        const double v = value.get<double>();
        if (v >= 0 && v <= 0x1p53 && v == std::floor(v)) return static_cast<std::uint64_t>(v);
    }
    return std::nullopt;
}

std::optional<std::uint64_t> Document::uint(const Json& object, std::string_view key) const {
    const Json* value = find(object, key);
    if (!value) return std::nullopt;
    const auto number = as_uint(*value);
    if (!number) fail("E0303", *value, {}, type_error(*value, "whole number of at least 0"));
    return number;
}

std::uint64_t Document::uint_or(const Json& object, std::string_view key, std::uint64_t fallback) const {
    return uint(object, key).value_or(fallback);
}

std::uint64_t Document::need_uint(const Json& object, std::string_view key) const {
    const auto value = uint(object, key);
    if (!value) fail("E0303", object, {}, "has no \"" + std::string(key) + "\", which glTF requires");
    return *value;
}

double Document::number_or(const Json& object, std::string_view key, double fallback) const {
    const Json* value = find(object, key);
    if (!value) return fallback;
    if (!value->is_number()) fail("E0303", *value, {}, type_error(*value, "number"));
    return value->get<double>();
}

bool Document::bool_or(const Json& object, std::string_view key, bool fallback) const {
    const Json* value = find(object, key);
    if (!value) return fallback;
    if (!value->is_boolean()) fail("E0303", *value, {}, type_error(*value, "true or false"));
    return value->get<bool>();
}

std::string_view Document::string_or(const Json& object, std::string_view key, std::string_view fallback) const {
    const Json* value = find(object, key);
    if (!value) return fallback;
    if (!value->is_string()) fail("E0303", *value, {}, type_error(*value, "string"));
    return value->get_ref<const std::string&>();
}

bool Document::numbers(const Json& object, std::string_view key, std::span<double> out) const {
    const std::span<const Json> values = list(object, key);
    if (values.data() == nullptr && !find(object, key)) return false;
    if (values.size() != out.size())
        fail("E0303", object, key,
             "has " + std::to_string(values.size()) + " values, expected " + std::to_string(out.size()));
    for (std::size_t i = 0; i < out.size(); ++i) {
        if (!values[i].is_number()) fail("E0303", values[i], {}, type_error(values[i], "number"));
        out[i] = values[i].get<double>();
    }
    return true;
}

std::uint32_t Document::as_index(const Json& value, std::size_t size, std::string_view what) const {
    const auto number = as_uint(value);
    if (!number) fail("E0303", value, {}, type_error(value, "index (a whole number of at least 0)"));
    if (*number >= size)
        fail("E0306", value, {},
             "refers to " + std::string(what) + " " + std::to_string(*number) + ", but the file has " +
                 (size == 0 ? "none" : std::to_string(size)));
    return static_cast<std::uint32_t>(*number);
}

std::optional<std::uint32_t> Document::index(const Json& object, std::string_view key, std::size_t size,
                                             std::string_view what) const {
    const Json* value = find(object, key);
    if (!value) return std::nullopt;
    return as_index(*value, size, what);
}

std::uint32_t Document::need_index(const Json& object, std::string_view key, std::size_t size,
                                   std::string_view what) const {
    const auto value = index(object, key, size, what);
    if (!value) fail("E0303", object, {}, "has no \"" + std::string(key) + "\", which glTF requires");
    return *value;
}

} // namespace porthole::gltf
