// Bytes in and out: memory-mapped input, atomic output, paths that stay in their folder.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <span>
#include <stop_token>
#include <string>
#include <string_view>

namespace porthole {

/// A whole file, mapped read-only (regular files) or read into memory (pipes). Move-only.
class FileBytes {
public:
    /// "-" is standard input. Files up to 64 MB are copied, larger ones mapped: who reads one that
    /// another program cuts short meanwhile gets SIGBUS.
    /// @param max_bytes  most that is read from a pipe.
    /// @throws Error input E0201 not found, E0202 unreadable, a folder or a device, E0203
    ///         empty; limit E0902 when a pipe brings more than `max_bytes`.
    explicit FileBytes(const std::filesystem::path& path, std::uint64_t max_bytes = std::uint64_t(16) << 30);
    /// Bytes already in memory.
    explicit FileBytes(std::string bytes);
    FileBytes(FileBytes&&) noexcept;
    FileBytes& operator=(FileBytes&&) noexcept;
    ~FileBytes();
    [[nodiscard]] std::span<const std::byte> bytes() const { return bytes_; }
    [[nodiscard]] std::string_view text() const {
        return {reinterpret_cast<const char*>(bytes_.data()), bytes_.size()};
    }

private:
    std::span<const std::byte> bytes_;
    std::string owned_;
    void* mapped_ = nullptr;
};

/// What tells a file apart.
struct FileDigest {
    std::uint64_t bytes = 0;
    std::string sha256;
};

/// Reads a file in small blocks, so that none of it stays in memory.
/// @throws Error input E0201, E0202 as FileBytes, also for what is not a regular file; Cancelled.
[[nodiscard]] FileDigest digest_file(const std::filesystem::path& path, const std::stop_token& stop = {});

/// The file that `reference` (a relative path or percent-encoded URI found inside `model`)
/// names, if it is an existing regular file in the model's folder or below, after resolving
/// symbolic links.
/// @throws Error input E0210 when it leaves the folder, is absolute, names a scheme or a
///         device, or the model is "-"; E0211 when it does not exist. `where` becomes the
///         error's.
[[nodiscard]] std::filesystem::path resolve_beside(const std::filesystem::path& model, std::string_view reference,
                                                   const std::string& where);

/// Writes `bytes` to a temporary name in the same folder, syncs and renames over `path`.
/// "-" writes to standard output; devices and pipes are written directly, a symbolic link
/// stays and its file is replaced. A failure leaves what was there before.
/// @param no_clobber  never replace an existing file, decided atomically with the renaming.
/// @throws Error output E0801 (cannot create), E0802 (write failed, e.g. disk full), E0803
///         (rename, or the file exists and `no_clobber`).
void write_file(const std::string& path, std::span<const std::byte> bytes, bool no_clobber = false);

/// `text` with invalid UTF-8 sequences replaced by U+FFFD.
[[nodiscard]] std::string valid_utf8(std::string_view text);

/// `text` for a terminal or a log line: valid UTF-8, control and bidirectional-override
/// characters written as \n, \x1b, \u202e, at most `limit` bytes.
[[nodiscard]] std::string escaped(std::string_view text, std::size_t limit = 300);

} // namespace porthole
