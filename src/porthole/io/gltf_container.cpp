#include "porthole/io/gltf_container.h"

#include <array>
#include <bit>
#include <cstring>

namespace porthole::gltf {
namespace {

static_assert(std::endian::native == std::endian::little, "GLB and accessors are read as little-endian memory");

constexpr std::uint32_t kMagic = 0x46546C67;     // "glTF"
constexpr std::uint32_t kJsonChunk = 0x4E4F534A; // "JSON"
constexpr std::uint32_t kBinChunk = 0x004E4942;  // "BIN"

std::uint32_t word_at(std::span<const std::byte> file, std::size_t offset) {
    std::uint32_t value;
    std::memcpy(&value, file.data() + offset, sizeof value);
    return value;
}

[[noreturn]] void fail(const char* code, const std::string& name, std::size_t byte, const std::string& reason) {
    throw Error(ErrorKind::input, code, name + ":byte " + std::to_string(byte), reason);
}

Container open_glb(std::span<const std::byte> file, const std::string& name) {
    const auto num = [](std::uint64_t v) { return std::to_string(v); };
    if (file.size() < 12)
        fail("E0301", name, file.size(),
             "the GLB header ends at byte " + num(file.size()) + " of 12; the file is truncated?");
    const std::uint32_t version = word_at(file, 4), length = word_at(file, 8);
    if (version != 2)
        fail("E0304", name, 4, "GLB version " + num(version) + ", expected 2; convert the file to glTF 2.0");
    if (length > file.size())
        fail("E0301", name, file.size(),
             "the GLB header promises " + num(length) + " bytes, the file has " + num(file.size()) +
                 "; the file is truncated?");
    Container c;
    c.glb = true;
    c.trailing_bytes = length < file.size();
    bool has_json = false;
    std::size_t chunk = 0;
    for (std::size_t at = 12; at < length; ++chunk) {
        if (length - at < 8)
            fail("E0301", name, at,
                 "chunk " + num(chunk) + "'s header passes the end of the GLB at byte " + num(length) +
                     "; the file is truncated?");
        const std::uint32_t size = word_at(file, at), type = word_at(file, at + 4);
        if (size > length - at - 8)
            fail("E0301", name, at,
                 "chunk " + num(chunk) + " of " + num(size) + " bytes passes the end of the GLB at byte " +
                     num(length) + " (the file has " + num(file.size()) + "); the file is truncated?");
        const std::span<const std::byte> data = file.subspan(at + 8, size);
        if (chunk == 0 && type != kJsonChunk) fail("E0310", name, at + 4, "the first GLB chunk is not JSON");
        if (type == kJsonChunk) {
            if (has_json) fail("E0310", name, at + 4, "a second JSON chunk; a GLB has one");
            if (size == 0) fail("E0310", name, at, "the JSON chunk is empty");
            has_json = true;
            c.json = {reinterpret_cast<const char*>(data.data()), data.size()};
            c.json_offset = at + 8;
        } else if (type == kBinChunk) {
            if (chunk != 1)
                fail("E0310", name, at + 4, "the BIN chunk must be the second one, this is number " + num(chunk));
            c.has_bin = true;
            c.bin = data;
        } // Other kinds are for extensions: glTF says to skip them.
        at += 8 + std::size_t(size);
    }
    if (!has_json) fail("E0310", name, 12, "the GLB has no JSON chunk");
    // Chunks are padded to 4 bytes, with spaces by the book but with zeros by some writers.
    while (!c.json.empty() && c.json.back() == '\0') c.json.remove_suffix(1);
    return c;
}

std::optional<std::vector<std::byte>> decode_percent(std::string_view text) {
    const auto digit = [](char c) {
        return c >= '0' && c <= '9'   ? c - '0'
               : c >= 'a' && c <= 'f' ? c - 'a' + 10
               : c >= 'A' && c <= 'F' ? c - 'A' + 10
                                      : -1;
    };
    std::vector<std::byte> out;
    for (std::size_t i = 0; i < text.size(); ++i) {
        if (text[i] != '%') {
            out.push_back(std::byte(text[i]));
            continue;
        }
        if (i + 2 >= text.size() || digit(text[i + 1]) < 0 || digit(text[i + 2]) < 0) return std::nullopt;
        out.push_back(std::byte(digit(text[i + 1]) * 16 + digit(text[i + 2])));
        i += 2;
    }
    return out;
}

} // namespace

Container open_container(std::span<const std::byte> file, const std::string& name) {
    if (file.size() >= 4 && word_at(file, 0) == kMagic) return open_glb(file, name);
    Container c;
    c.json = {reinterpret_cast<const char*>(file.data()), file.size()};
    return c;
}

std::optional<std::vector<std::byte>> decode_base64(std::string_view text) {
    static constexpr auto kValue = [] {
        std::array<std::uint8_t, 256> t{};
        t.fill(0xFF);
        constexpr std::string_view digits = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
        for (std::size_t i = 0; i < digits.size(); ++i) t[static_cast<unsigned char>(digits[i])] = std::uint8_t(i);
        return t;
    }();
    if (text.size() % 4 == 0 && text.ends_with('=')) text.remove_suffix(text.ends_with("==") ? 2 : 1);
    if (text.size() % 4 == 1) return std::nullopt;

    std::vector<std::byte> out(text.size() / 4 * 3 + (text.size() % 4 == 0 ? 0 : text.size() % 4 - 1));
    std::uint32_t bad = 0;
    std::size_t o = 0, i = 0;
    const auto value = [&](std::size_t k) -> std::uint32_t { return kValue[static_cast<unsigned char>(text[k])]; };
    for (; i + 4 <= text.size(); i += 4) {
        const std::uint32_t a = value(i), b = value(i + 1), c = value(i + 2), d = value(i + 3);
        bad |= a | b | c | d;
        const std::uint32_t word = a << 18 | b << 12 | c << 6 | d;
        out[o++] = std::byte(word >> 16 & 0xFF);
        out[o++] = std::byte(word >> 8 & 0xFF);
        out[o++] = std::byte(word & 0xFF);
    }
    if (i < text.size()) {
        const std::uint32_t a = value(i), b = value(i + 1), c = i + 2 < text.size() ? value(i + 2) : 0;
        bad |= a | b | c;
        const std::uint32_t word = a << 18 | b << 12 | c << 6;
        out[o++] = std::byte(word >> 16 & 0xFF);
        if (i + 2 < text.size()) out[o++] = std::byte(word >> 8 & 0xFF);
    }
    if (bad & 0xC0) return std::nullopt; // digits are below 64, strangers are 255
    return out;
}

Bytes UriReader::read(std::string_view uri, const std::string& where) {
    if (uri.starts_with("data:")) {
        const auto comma = uri.find(',');
        if (comma == uri.npos)
            throw Error(ErrorKind::input, "E0307", where, "data URI without a comma: " + shortened(uri));
        const std::string_view text = uri.substr(comma + 1);
        auto decoded = uri.substr(0, comma).ends_with(";base64") ? decode_base64(text) : decode_percent(text);
        if (!decoded)
            throw Error(ErrorKind::input, "E0307", where, "the data URI cannot be decoded: " + shortened(uri));
        auto owner = std::make_shared<std::vector<std::byte>>(std::move(*decoded));
        return {*owner, owner};
    }
    if (model_ == "-")
        throw Error(ErrorKind::input, "E0307", where,
                    "a model from standard input cannot name other files: " + shortened(uri) + "; use a GLB file");
    const std::filesystem::path path = resolve_beside(model_, uri, where);
    if (const auto known = files_.find(path); known != files_.end()) return known->second;
    std::error_code ignored;
    if (std::filesystem::equivalent(path, model_, ignored))
        throw Error(ErrorKind::input, "E0307", where, "the URI names the model file itself: " + shortened(uri));
    auto owner = std::make_shared<FileBytes>(path);
    return files_[path] = {owner->bytes(), owner};
}

std::vector<Buffer> read_buffers(Document& doc, const Container& container, UriReader& uris) {
    std::vector<Buffer> buffers;
    const std::span<const Json> list = doc.list_of_objects(doc.root(), "buffers");
    buffers.reserve(list.size());
    for (std::size_t i = 0; i < list.size(); ++i) {
        const Json& json = list[i];
        Buffer buffer;
        const std::uint64_t length = doc.need_uint(json, "byteLength");
        const Json* meshopt = doc.extension(json, "EXT_meshopt_compression");
        if (!meshopt) meshopt = doc.extension(json, "KHR_meshopt_compression");
        const bool fallback = meshopt && doc.bool_or(*meshopt, "fallback", false);
        const Json* uri = Document::find(json, "uri");
        const std::string_view text = doc.string_or(json, "uri");

        if (fallback)
            buffer.undefined = true; // its views are decoded from another buffer
        else if (uri)
            buffer.bytes = uris.read(text, doc.where(*uri));
        else if (i == 0 && container.has_bin)
            buffer.bytes.data = container.bin;
        else if (i == 0 && container.glb && length > 0)
            doc.fail("E0307", json, {}, "has no URI, and the GLB has no BIN chunk; the file is truncated?");
        else {
            buffer.undefined = true;
            doc.warn("W0307", json, {}, "has neither URI nor data; zeros are read from it");
        }
        if (!buffer.undefined) {
            if (length > buffer.bytes.data.size())
                doc.fail("E0301", json, "byteLength",
                         "promises " + std::to_string(length) + " bytes, there are " +
                             std::to_string(buffer.bytes.data.size()) + "; the file is truncated?");
            buffer.bytes.data = buffer.bytes.data.first(length);
        }
        buffers.push_back(std::move(buffer));
    }
    return buffers;
}

} // namespace porthole::gltf
