// Text from files, made safe to show: the half of files.h that opens nothing.
#include <cstdint>

#include "porthole/io/files.h"

namespace porthole {
namespace {

struct CodePoint {
    char32_t value = 0;
    int bytes = 1;
    bool valid = false; ///< if not, `bytes` is the length of the ill-formed piece
};

/// The code point at the start of `text` (not empty), by Unicode 15, table 3-7.
CodePoint next_code_point(std::string_view text) {
    const auto byte = [&](std::size_t i) { return i < text.size() ? std::uint8_t(text[i]) : std::uint8_t(0); };
    const std::uint8_t lead = byte(0);
    if (lead < 0x80) return {lead, 1, true};
    const int length = lead >= 0xC2 && lead <= 0xDF   ? 2
                       : (lead & 0xF0) == 0xE0        ? 3
                       : lead >= 0xF0 && lead <= 0xF4 ? 4
                                                      : 1;
    if (length == 1) return {};
    // The second byte's range excludes overlong forms, surrogates and values past U+10FFFF.
    const std::uint8_t low = lead == 0xE0 ? 0xA0 : lead == 0xF0 ? 0x90 : 0x80;
    const std::uint8_t high = lead == 0xED ? 0x9F : lead == 0xF4 ? 0x8F : 0xBF;
    if (byte(1) < low || byte(1) > high) return {};
    char32_t value = lead & (0x7Fu >> length);
    value = value << 6 | (byte(1) & 0x3Fu);
    for (int i = 2; i < length; ++i) {
        if ((byte(std::size_t(i)) & 0xC0) != 0x80) return {0, i, false};
        value = value << 6 | (byte(std::size_t(i)) & 0x3Fu);
    }
    return {value, length, true};
}

/// Characters that move the cursor, end the line or reorder what stands around them.
bool is_treacherous(char32_t c) {
    return c < 0x20 || (c >= 0x7F && c <= 0x9F) || c == 0x061C || c == 0x200E || c == 0x200F ||
           (c >= 0x2028 && c <= 0x202E) || (c >= 0x2066 && c <= 0x2069) || c == 0xFEFF;
}

std::string escape_of(char32_t c) {
    if (c == '\n') return "\\n";
    if (c == '\r') return "\\r";
    if (c == '\t') return "\\t";
    static constexpr char hex[] = "0123456789abcdef";
    std::string out = c < 0x80 ? "\\x" : "\\u";
    for (int shift = c < 0x80 ? 4 : 12; shift >= 0; shift -= 4) out += hex[(c >> shift) & 15u];
    return out;
}

} // namespace

std::string valid_utf8(std::string_view text) {
    std::string out;
    out.reserve(text.size());
    while (!text.empty()) {
        const CodePoint c = next_code_point(text);
        if (c.valid)
            out.append(text.substr(0, std::size_t(c.bytes)));
        else
            out += "\xEF\xBF\xBD";
        text.remove_prefix(std::size_t(c.bytes));
    }
    return out;
}

std::string escaped(std::string_view text, std::size_t limit) {
    static constexpr std::string_view kEllipsis = "...";
    std::string out;
    std::size_t fits = 0; // length of `out` that leaves room for the ellipsis
    while (!text.empty()) {
        const CodePoint c = next_code_point(text);
        if (!c.valid)
            out += "\xEF\xBF\xBD";
        else if (is_treacherous(c.value))
            out += escape_of(c.value);
        else
            out.append(text.substr(0, std::size_t(c.bytes)));
        if (out.size() > limit) {
            out.resize(fits);
            return limit >= kEllipsis.size() ? out.append(kEllipsis) : out;
        }
        if (out.size() + kEllipsis.size() <= limit) fits = out.size();
        text.remove_prefix(std::size_t(c.bytes));
    }
    return out;
}

} // namespace porthole
