// Where the bytes of a glTF file are: GLB chunks, data URIs, files beside it.
#pragma once

#include <cstddef>
#include <filesystem>
#include <map>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "porthole/io/files.h"
#include "porthole/io/gltf_json.h"

namespace porthole::gltf {

struct Container {
    std::string_view json;
    std::uint64_t json_offset = 0; ///< in the file
    bool glb = false, has_bin = false;
    bool trailing_bytes = false; ///< after the end that the GLB header states
    std::span<const std::byte> bin;
};

/// Splits a file into JSON and binary chunk; a file that does not begin with "glTF" is JSON.
/// @throws Error E0301 (a chunk passes the end), E0304 (GLB version), E0310 (chunks missing,
///         repeated or out of order).
[[nodiscard]] Container open_container(std::span<const std::byte> file, const std::string& name);

/// Bytes that may be borrowed from the model file or owned.
struct Bytes {
    std::span<const std::byte> data;
    std::shared_ptr<const void> owner; ///< keeps `data` alive; null when borrowed
};

/// One glTF buffer. `undefined`: the file gives it no bytes (a meshopt fallback, or no URI);
/// what reads it gets zeros.
struct Buffer {
    Bytes bytes;
    bool undefined = false;
};

/// What URIs in a model name: data URIs, and files beside it, each read once.
class UriReader {
public:
    explicit UriReader(std::filesystem::path model) : model_(std::move(model)) {}
    /// @throws Error E0307 for a broken data URI or the model itself; E02xx from resolve_beside.
    [[nodiscard]] Bytes read(std::string_view uri, const std::string& where);

private:
    std::filesystem::path model_;
    std::map<std::filesystem::path, Bytes> files_;
};

/// All buffers, each cut to its byteLength.
/// @throws Error E0301 when one is shorter than its byteLength says, and as UriReader.
[[nodiscard]] std::vector<Buffer> read_buffers(Document& doc, const Container& container, UriReader& uris);

/// RFC 4648 base64, padded or not, without white space; nullopt when broken.
[[nodiscard]] std::optional<std::vector<std::byte>> decode_base64(std::string_view text);

} // namespace porthole::gltf
