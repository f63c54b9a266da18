// The JSON of a glTF file, with checked access: a wrong type, a missing property or a
// reference to nothing is an Error that names the JSON pointer.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <string_view>

#include <nlohmann/json.hpp>

#include "porthole/base/error.h"

namespace porthole::gltf {

using Json = nlohmann::json;

/// Parses JSON text without recursion.
/// @param file       names the file in errors.
/// @param byte_base  offset of `text` in the file, added to reported byte positions.
/// @param max_bytes  most memory the values may take.
/// @throws Error E0302 with the byte of the first syntax error, or when values nest deeper
///         than 512; limit E0902.
[[nodiscard]] Json parse_json(std::string_view text, const std::string& file, std::uint64_t byte_base,
                              std::uint64_t max_bytes);

/// A parsed file and the warnings it gave rise to. Elements are referred to by the address of
/// their Json value; messages find the JSON pointer by searching for it, so that the good
/// path pays nothing.
///
/// Reading is safe from many threads, warn() is not.
class Document {
public:
    Document(std::string file, Json root) : file_(std::move(file)), root_(std::move(root)) {}
    Document(const Document&) = delete;
    Document& operator=(const Document&) = delete;

    [[nodiscard]] const Json& root() const { return root_; }
    [[nodiscard]] const std::string& file() const { return file_; }

    /// "<file>:<JSON pointer of at>", followed by "/<below>" if that is not empty; the file
    /// alone for the root.
    [[nodiscard]] std::string where(const Json& at, std::string_view below = {}) const;
    [[noreturn]] void fail(const char* code, const Json& at, std::string_view below, const std::string& reason) const;
    [[noreturn]] void fail_limit(const Json& at, std::string_view below, const std::string& reason) const;
    /// After 20 warnings of a code the others are only counted.
    void warn(const char* code, const Json& at, std::string_view below, const std::string& reason);
    /// Warnings so far, the counts of the suppressed ones last.
    [[nodiscard]] Warnings take_warnings();

    // Members of `object`. Absent ones give nullptr, nullopt, false or the default.
    /// @throws Error E0303 if the member is there and has another type.
    [[nodiscard]] static const Json* find(const Json& object, std::string_view key);
    [[nodiscard]] const Json* object(const Json& object, std::string_view key) const;
    [[nodiscard]] const Json* extension(const Json& object, std::string_view name) const;
    /// The members of the array `key`; empty if absent. list_of_objects checks their type too,
    /// which takes time linear in their number: not for loops.
    [[nodiscard]] std::span<const Json> list(const Json& object, std::string_view key) const;
    [[nodiscard]] std::span<const Json> list_of_objects(const Json& object, std::string_view key) const;
    /// Element `i`, which must be there, of the root's list `key`; an object.
    [[nodiscard]] const Json& element(std::string_view key, std::size_t i) const;
    [[nodiscard]] std::optional<std::uint64_t> uint(const Json& object, std::string_view key) const;
    [[nodiscard]] std::uint64_t uint_or(const Json& object, std::string_view key, std::uint64_t fallback) const;
    [[nodiscard]] std::uint64_t need_uint(const Json& object, std::string_view key) const;
    [[nodiscard]] double number_or(const Json& object, std::string_view key, double fallback) const;
    [[nodiscard]] bool bool_or(const Json& object, std::string_view key, bool fallback) const;
    [[nodiscard]] std::string_view string_or(const Json& object, std::string_view key,
                                             std::string_view fallback = {}) const;
    /// Fills `out` from an array of exactly out.size() numbers; false (out untouched) if absent.
    bool numbers(const Json& object, std::string_view key, std::span<double> out) const;

    // References.
    /// The index `key`, below `size`. `what` names the kind, as "mesh".
    /// @throws Error E0306 when it is not below `size`.
    [[nodiscard]] std::optional<std::uint32_t> index(const Json& object, std::string_view key, std::size_t size,
                                                     std::string_view what) const;
    [[nodiscard]] std::uint32_t need_index(const Json& object, std::string_view key, std::size_t size,
                                           std::string_view what) const;
    /// `value`, a member of an array, as an index below `size`.
    [[nodiscard]] std::uint32_t as_index(const Json& value, std::size_t size, std::string_view what) const;
    /// Its value if it is a whole number in [0, 2^53], as 7 or 7.0.
    [[nodiscard]] static std::optional<std::uint64_t> as_uint(const Json& value);

private:
    [[nodiscard]] std::string pointer_of(const Json& at) const;

    std::string file_;
    Json root_;
    Warnings warnings_;
    std::map<std::string, std::uint64_t> count_by_code_;
};

/// `text` cut to at most `limit` bytes with "..." in place of the rest.
[[nodiscard]] std::string shortened(std::string_view text, std::size_t limit = 80);

} // namespace porthole::gltf
