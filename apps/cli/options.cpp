#include "options.h"

#include <charconv>
#include <cmath>
#include <optional>
#include <string_view>

#include "porthole/base/tone.h"

namespace porthole::cli {

namespace {

[[noreturn]] void refuse(const std::string& option, const std::string& text, const std::string& expected) {
    throw Error(ErrorKind::usage, "E0105", option, "\"" + text.substr(0, 80) + "\" is not " + expected);
}

/// The finite number that `text` starts with, which is cut off; empty if there is none.
std::optional<double> take_number(std::string_view& text) {
    double value = 0;
    const auto [stop, code] = std::from_chars(text.data(), text.data() + text.size(), value);
    if (code != std::errc{} || !std::isfinite(value)) return std::nullopt;
    text.remove_prefix(std::size_t(stop - text.data()));
    return value;
}

std::string lowered(std::string text) {
    for (char& c : text)
        if (c >= 'A' && c <= 'Z') c = char(c - 'A' + 'a');
    return text;
}

} // namespace

Vec2i parse_size(const std::string& text, const std::string& option) {
    const std::string expected = "a size such as 1920x1080, from 1x1 to 32768x32768";
    Vec2i size;
    const char* const end = text.data() + text.size();
    const auto [x, code] = std::from_chars(text.data(), end, size.x);
    if (code != std::errc{} || x == end || (*x != 'x' && *x != 'X' && *x != ',')) refuse(option, text, expected);
    const auto [stop, code2] = std::from_chars(x + 1, end, size.y);
    if (code2 != std::errc{} || stop != end) refuse(option, text, expected);
    if (size.x < 1 || size.y < 1 || size.x > 32768 || size.y > 32768) refuse(option, text, expected);
    return size;
}

Vec3f parse_color(const std::string& text, const std::string& option) {
    if (text == "white") return {1, 1, 1};
    if (text == "black") return {0, 0, 0};
    std::uint32_t rgb = 0;
    const char* const end = text.data() + text.size();
    if (text.size() != 7 || text[0] != '#') refuse(option, text, "a colour such as #20a0ff, white or black");
    if (const auto [stop, code] = std::from_chars(text.data() + 1, end, rgb, 16); code != std::errc{} || stop != end)
        refuse(option, text, "a colour such as #20a0ff, white or black");
    const auto channel = [&](unsigned shift) { return float(linear_from_srgb(((rgb >> shift) & 255u) / 255.0)); };
    return {channel(16), channel(8), channel(0)};
}

Length parse_length(const std::string& text, const std::string& option, bool zero) {
    const std::string expected = "a length such as 54px, 5% (of the picture's height) or 3mm";
    std::string_view rest = text;
    const std::optional<double> value = take_number(rest);
    if (!value || *value < 0 || (*value == 0 && !zero)) refuse(option, text, expected);
    if (rest.empty() || rest == "px") return {Length::Unit::pixel, *value};
    if (rest == "%") return {Length::Unit::percent, *value};
    if (rest == "mm") return {Length::Unit::millimetre, *value};
    refuse(option, text, expected);
}

double parse_units(const std::string& text, const std::string& option) {
    static constexpr struct {
        std::string_view name;
        double metres;
    } kUnits[] = {{"m", 1}, {"cm", 0.01}, {"mm", 0.001}, {"um", 1e-6}, {"km", 1000}, {"in", 0.0254}, {"ft", 0.3048}};
    for (const auto& unit : kUnits)
        if (text == unit.name) return unit.metres;
    std::string_view rest = text;
    const std::optional<double> value = take_number(rest);
    if (!value || !rest.empty() || *value < 1e-12 || *value > 1e12)
        refuse(option, text, "m, cm, mm, um, km, in, ft, or the metres in one unit of the file");
    return *value;
}

std::uint64_t parse_bytes(const std::string& text, const std::string& option) {
    std::string_view rest = text;
    const std::optional<double> value = take_number(rest);
    if (!value) refuse(option, text, "an amount of memory such as 512M or 4G");
    std::string unit = lowered(std::string(rest));
    if (unit.ends_with("ib"))
        unit.resize(unit.size() - 2);
    else if (unit.ends_with('b'))
        unit.pop_back();
    const int shift = unit.empty() ? 0 : unit == "k" ? 10 : unit == "m" ? 20 : unit == "g" ? 30 : unit == "t" ? 40 : -1;
    if (shift < 0) refuse(option, text, "an amount of memory such as 512M or 4G");
    const double bytes = *value * double(std::uint64_t(1) << shift);
    if (bytes < double(1 << 24) || bytes > double(std::uint64_t(1) << 50))
        refuse(option, text, "between 16M and 1024T");
    return std::uint64_t(bytes);
}

Vec3d parse_vector(const std::string& text, const std::string& option) {
    std::string_view rest = text;
    Vec3d v;
    for (int i = 0; i < 3; ++i) {
        if (i > 0) {
            if (!rest.starts_with(',')) refuse(option, text, "three numbers such as 1,0.5,-2");
            rest.remove_prefix(1);
        }
        if (rest.starts_with('+')) rest.remove_prefix(1);
        const std::optional<double> value = take_number(rest);
        if (!value) refuse(option, text, "three numbers such as 1,0.5,-2");
        v[i] = *value;
    }
    if (!rest.empty()) refuse(option, text, "three numbers such as 1,0.5,-2");
    return v;
}

std::vector<Vec2f> parse_guides(const std::string& text, const std::string& option) {
    const std::string expected = "3 to 64 positions such as \"0,0 1,0 0.5,1\", from 0 to 1, not all on one line";
    std::string_view rest = text;
    std::vector<Vec2f> guides;
    while (!rest.empty()) {
        const std::optional<double> x = take_number(rest);
        if (!x || !rest.starts_with(',')) refuse(option, text, expected);
        rest.remove_prefix(1);
        const std::optional<double> y = take_number(rest);
        if (!y) refuse(option, text, expected);
        guides.push_back({float(*x), float(*y)});
        if (!rest.empty() && !rest.starts_with(' ')) refuse(option, text, expected);
        while (rest.starts_with(' ')) rest.remove_prefix(1);
    }
    return guides;
}

char parse_up(const std::string& text, const std::string& option) {
    const std::string axis = lowered(text.starts_with('+') ? text.substr(1) : text);
    if (axis != "y" && axis != "z") refuse(option, text, "y or z");
    return axis[0];
}

} // namespace porthole::cli
