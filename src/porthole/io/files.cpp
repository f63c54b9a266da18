#include "porthole/io/files.h"

#include <fcntl.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <new>
#include <random>
#include <system_error>
#include <utility>
#include <vector>

#include "porthole/base/error.h"
#include "porthole/base/parallel.h"
#include "porthole/base/sha256.h"

namespace porthole {
namespace fs = std::filesystem;

namespace {

// Files up to this size are copied into memory: a mapped file that another program cuts short
// kills the reader with SIGBUS, and the copy costs about 0.2 ms per MB. Larger ones are mapped.
constexpr std::uint64_t kCopyLimit = std::uint64_t(64) << 20;

std::string system_reason(int error) { return std::generic_category().message(error); }

/// Closes on scope exit; close() gives up ownership and reports.
class Descriptor {
public:
    explicit Descriptor(int fd) : fd_(fd) {}
    ~Descriptor() {
        if (fd_ >= 0) ::close(fd_);
    }
    Descriptor(const Descriptor&) = delete;
    Descriptor& operator=(const Descriptor&) = delete;
    [[nodiscard]] int get() const { return fd_; }
    /// 0 or errno. Linux frees the descriptor even when close() reports EINTR.
    int close() {
        const int result = ::close(std::exchange(fd_, -1));
        return result == 0 || errno == EINTR ? 0 : errno;
    }

private:
    int fd_;
};

int open_retrying(const char* path, int flags, mode_t mode = 0) {
    int fd;
    do fd = ::open(path, flags | O_CLOEXEC, mode);
    while (fd < 0 && errno == EINTR);
    return fd;
}

/// Up to `size` bytes, fewer only at the end of the input; -1 with errno set on failure.
ssize_t read_fully(int fd, char* out, std::size_t size) {
    std::size_t done = 0;
    while (done < size) {
        const ssize_t n = ::read(fd, out + done, size - done);
        if (n == 0) break;
        if (n < 0) {
            if (errno == EINTR) continue;
            return -1;
        }
        done += std::size_t(n);
    }
    return ssize_t(done);
}

/// 0 or errno.
int write_fully(int fd, std::span<const std::byte> bytes) {
    std::size_t done = 0;
    while (done < bytes.size()) {
        const ssize_t n = ::write(fd, bytes.data() + done, bytes.size() - done);
        if (n < 0) {
            if (errno == EINTR) continue;
            return errno;
        }
        done += std::size_t(n);
    }
    return 0;
}

std::string read_stream(int fd, const std::string& where, std::uint64_t max_bytes) {
    std::string all;
    std::vector<char> block(std::size_t(1) << 20);
    for (;;) {
        const ssize_t n = read_fully(fd, block.data(), block.size());
        if (n < 0) throw Error(ErrorKind::input, "E0202", where, "cannot be read: " + system_reason(errno));
        if (all.size() + std::size_t(n) > max_bytes)
            throw Error(ErrorKind::limit, "E0902", where,
                        "more than " + std::to_string(max_bytes) + " bytes of input; --max-memory allows more");
        all.append(block.data(), std::size_t(n));
        if (std::size_t(n) < block.size()) return all;
    }
}

/// Of a descriptor that was just opened for reading.
void require_open(const Descriptor& file, const std::string& where) {
    if (file.get() >= 0) return;
    const int error = errno;
    if (error == ENOENT || error == ENOTDIR) throw Error(ErrorKind::input, "E0201", where, "there is no such file");
    throw Error(ErrorKind::input, "E0202", where, "cannot be opened: " + system_reason(error));
}

} // namespace

FileBytes::FileBytes(const fs::path& path, std::uint64_t max_bytes) {
    const bool standard_input = path == "-";
    const std::string where = standard_input ? std::string("standard input") : path.string();
    const Descriptor file(standard_input ? ::fcntl(STDIN_FILENO, F_DUPFD_CLOEXEC, 0)
                                         : open_retrying(path.c_str(), O_RDONLY | O_NOCTTY));
    require_open(file, where);
    struct stat status {};
    if (::fstat(file.get(), &status) != 0)
        throw Error(ErrorKind::input, "E0202", where, "cannot be read: " + system_reason(errno));
    if (S_ISDIR(status.st_mode))
        throw Error(ErrorKind::input, "E0202", where, "is a folder; name a model file inside it");
    if (!standard_input && (S_ISBLK(status.st_mode) || S_ISCHR(status.st_mode)))
        throw Error(ErrorKind::input, "E0202", where, "is a device, not a file");

    if (S_ISREG(status.st_mode) && ::lseek(file.get(), 0, SEEK_CUR) == 0) {
        const std::size_t size = std::size_t(status.st_size);
        if (size == 0) throw Error(ErrorKind::input, "E0203", where, "the file is empty");
        const bool copy = size <= kCopyLimit;
        void* memory = ::mmap(nullptr, size, copy ? PROT_READ | PROT_WRITE : PROT_READ,
                              copy ? MAP_PRIVATE | MAP_ANONYMOUS : MAP_PRIVATE, copy ? -1 : file.get(), 0);
        if (memory == MAP_FAILED) {
            if (errno == ENOMEM) throw std::bad_alloc();
            throw Error(ErrorKind::input, "E0202", where, "cannot be mapped: " + system_reason(errno));
        }
        mapped_ = memory;
        bytes_ = {static_cast<const std::byte*>(memory), size};
        if (copy) {
            const ssize_t n = read_fully(file.get(), static_cast<char*>(memory), size);
            if (n != ssize_t(size)) {
                const std::string reason = n < 0 ? system_reason(errno) : std::string("it shrank while being read");
                ::munmap(memory, size);
                throw Error(ErrorKind::input, "E0202", where, "cannot be read: " + reason);
            }
        } else {
            ::madvise(memory, size, MADV_SEQUENTIAL);
        }
        return;
    }
    owned_ = read_stream(file.get(), where, max_bytes);
    if (owned_.empty()) throw Error(ErrorKind::input, "E0203", where, "the input is empty");
    bytes_ = std::as_bytes(std::span(owned_));
}

FileBytes::FileBytes(std::string bytes) : owned_(std::move(bytes)) { bytes_ = std::as_bytes(std::span(owned_)); }

FileBytes::FileBytes(FileBytes&& other) noexcept
    : bytes_(std::exchange(other.bytes_, {})), owned_(std::move(other.owned_)),
      mapped_(std::exchange(other.mapped_, nullptr)) {
    // A short string lives inside the object, so its bytes have moved.
    if (!mapped_) bytes_ = std::as_bytes(std::span(owned_));
}

FileBytes& FileBytes::operator=(FileBytes&& other) noexcept {
    std::swap(owned_, other.owned_);
    std::swap(mapped_, other.mapped_);
    std::swap(bytes_, other.bytes_);
    if (!mapped_) bytes_ = std::as_bytes(std::span(owned_));
    if (!other.mapped_) other.bytes_ = std::as_bytes(std::span(other.owned_));
    return *this;
}

FileBytes::~FileBytes() {
    if (mapped_) ::munmap(mapped_, bytes_.size());
}

FileDigest digest_file(const fs::path& path, const std::stop_token& stop) {
    const std::string where = path.string();
    // Without waiting for somebody to write, should it be a pipe.
    const Descriptor file(open_retrying(path.c_str(), O_RDONLY | O_NOCTTY | O_NONBLOCK));
    require_open(file, where);
    struct stat status {};
    if (::fstat(file.get(), &status) != 0 || !S_ISREG(status.st_mode))
        throw Error(ErrorKind::input, "E0202", where, "is not a regular file");
    FileDigest out;
    Sha256 sum;
    std::vector<char> block(std::size_t(1) << 18);
    for (;;) {
        if (stop.stop_requested()) throw Cancelled{};
        const ssize_t n = read_fully(file.get(), block.data(), block.size());
        if (n < 0) throw Error(ErrorKind::input, "E0202", where, "cannot be read: " + system_reason(errno));
        if (n == 0) break;
        sum.add(std::as_bytes(std::span(block).first(std::size_t(n))));
        out.bytes += std::uint64_t(n);
    }
    out.sha256 = sum.digest();
    return out;
}

// ---------------------------------------------------------------- files beside the model

namespace {

int hex_digit(char c) {
    if (c >= '0' && c <= '9') return c - '0';
    if (c >= 'a' && c <= 'f') return c - 'a' + 10;
    if (c >= 'A' && c <= 'F') return c - 'A' + 10;
    return -1;
}

std::string percent_decoded(std::string_view text) {
    std::string out;
    out.reserve(text.size());
    for (std::size_t i = 0; i < text.size(); ++i) {
        const int high = text[i] == '%' && i + 2 < text.size() ? hex_digit(text[i + 1]) : -1;
        const int low = high >= 0 ? hex_digit(text[i + 2]) : -1;
        if (low >= 0) {
            out.push_back(char(high * 16 + low));
            i += 2;
        } else {
            out.push_back(text[i]);
        }
    }
    return out;
}

/// "http:", "file:", "data:" and drive letters.
bool has_scheme(std::string_view text) {
    const std::size_t colon = text.find(':');
    if (colon == std::string_view::npos || colon == 0) return false;
    const auto letter = [](char c) { return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z'); };
    if (!letter(text[0])) return false;
    return std::all_of(text.begin(), text.begin() + std::ptrdiff_t(colon),
                       [&](char c) { return letter(c) || (c >= '0' && c <= '9') || c == '+' || c == '-' || c == '.'; });
}

bool lies_in(const fs::path& file, const fs::path& folder) {
    const auto [end_of_folder, in_file] = std::mismatch(folder.begin(), folder.end(), file.begin(), file.end());
    return end_of_folder == folder.end() && in_file != file.end();
}

[[noreturn]] void refuse_reference(const std::string& where, const std::string& reason) {
    throw Error(ErrorKind::input, "E0210", where, reason);
}

} // namespace

fs::path resolve_beside(const fs::path& model, std::string_view reference, const std::string& where) {
    const std::string shown = "'" + escaped(reference, 120) + "'";
    if (model == "-")
        refuse_reference(where, shown + " is not read: a model from standard input has no folder to look in");
    std::error_code failure;
    const fs::path folder = fs::canonical(model.has_parent_path() ? model.parent_path() : fs::path("."), failure);
    if (failure) refuse_reference(where, "the model's folder cannot be resolved: " + failure.message());

    // As a URI, as a plain name, and as Windows programs write it: the first that exists.
    const std::string decoded = percent_decoded(reference);
    std::string slashes = decoded;
    std::replace(slashes.begin(), slashes.end(), '\\', '/');
    for (const std::string& name : {decoded, std::string(reference), slashes}) {
        if (name.empty()) continue;
        if (name.find('\0') != std::string::npos) refuse_reference(where, shown + " has a zero byte in its name");
        if (name.front() == '/' || has_scheme(name))
            refuse_reference(where, shown + " is not read: only files in the model's own folder are; put it there "
                                            "and name it without a path");
        const fs::path wanted = (folder / name).lexically_normal();
        if (!lies_in(wanted, folder)) refuse_reference(where, shown + " leaves the model's folder and is not read");
        fs::path real = fs::canonical(wanted, failure);
        if (failure) continue;
        if (!lies_in(real, folder))
            refuse_reference(where, shown + " is a link that leaves the model's folder and is not read");
        const fs::file_status status = fs::status(real, failure);
        if (failure || !fs::is_regular_file(status)) refuse_reference(where, shown + " is not a regular file");
        return real;
    }
    throw Error(ErrorKind::input, "E0211", where, shown + " does not exist beside the model");
}

// ---------------------------------------------------------------- writing

namespace {

/// The file to replace: a symbolic link stays, what it points to is written.
fs::path real_target(const fs::path& path) {
    std::error_code failure;
    if (!fs::is_symlink(fs::symlink_status(path, failure))) return path;
    const fs::path real = fs::canonical(path, failure);
    return failure ? path : real;
}

void write_in_place(int fd, std::span<const std::byte> bytes, const std::string& where) {
    if (const int error = write_fully(fd, bytes))
        throw Error(ErrorKind::output, "E0802", where, "cannot be written: " + system_reason(error));
}

/// A new file with an unused name in `folder`, its permissions those that the umask gives.
struct Temporary {
    fs::path path;
    int fd = -1;
};

Temporary create_temporary(const fs::path& folder, const std::string& where) {
    std::random_device random;
    for (int attempt = 0; attempt < 100; ++attempt) {
        static constexpr char digits[] = "0123456789abcdefghijklmnopqrstuv";
        std::string name = ".porthole-";
        for (int i = 0; i < 10; ++i) name += digits[random() & 31u];
        Temporary temporary{folder / (name + ".tmp"), -1};
        temporary.fd = open_retrying(temporary.path.c_str(), O_WRONLY | O_CREAT | O_EXCL, 0666);
        if (temporary.fd >= 0) return temporary;
        if (errno == EEXIST) continue;
        const int error = errno;
        const bool no_folder = error == ENOENT || error == ENOTDIR;
        throw Error(ErrorKind::output, "E0801", where,
                    no_folder ? "its folder does not exist" : "cannot be created: " + system_reason(error));
    }
    throw Error(ErrorKind::output, "E0801", where, "no unused temporary name in its folder");
}

/// Renames without replacing; 0 or errno. Falls back to link() where the file system has no
/// RENAME_NOREPLACE; both are atomic.
int rename_new(const fs::path& from, const fs::path& to) {
    if (::renameat2(AT_FDCWD, from.c_str(), AT_FDCWD, to.c_str(), RENAME_NOREPLACE) == 0) return 0;
    if (errno != EINVAL && errno != ENOSYS) return errno;
    if (::link(from.c_str(), to.c_str()) != 0) return errno;
    ::unlink(from.c_str());
    return 0;
}

} // namespace

void write_file(const std::string& path, std::span<const std::byte> bytes, bool no_clobber) {
    if (path == "-") return write_in_place(STDOUT_FILENO, bytes, "standard output");

    const fs::path target = real_target(path);
    struct stat old {};
    const bool exists = ::stat(target.c_str(), &old) == 0;
    if (exists && S_ISDIR(old.st_mode))
        throw Error(ErrorKind::output, "E0801", path, "is a folder; name a file inside it");
    if (exists && !S_ISREG(old.st_mode)) {
        // /dev/null, a pipe: renaming over it would replace it.
        Descriptor device(open_retrying(target.c_str(), O_WRONLY | O_NOCTTY));
        if (device.get() < 0)
            throw Error(ErrorKind::output, "E0801", path, "cannot be opened: " + system_reason(errno));
        return write_in_place(device.get(), bytes, path);
    }
    const char* const in_the_way = "exists already and is not replaced (--no-clobber)";
    if (exists && no_clobber) throw Error(ErrorKind::output, "E0803", path, in_the_way);

    const fs::path folder = target.has_parent_path() ? target.parent_path() : fs::path(".");
    const Temporary temporary = create_temporary(folder, path);
    Descriptor file(temporary.fd);
    try {
        if (exists) (void)::fchmod(file.get(), old.st_mode & 07777u);
        int error = write_fully(file.get(), bytes);
        while (!error && ::fsync(file.get()) != 0) {
            if (errno == EINTR) continue;
            if (errno == EINVAL || errno == EROFS) break; // a file system without fsync
            error = errno;
        }
        if (const int close_error = file.close(); !error) error = close_error;
        if (error) throw Error(ErrorKind::output, "E0802", path, "cannot be written: " + system_reason(error));

        if (no_clobber)
            error = rename_new(temporary.path, target);
        else if (::rename(temporary.path.c_str(), target.c_str()) != 0)
            error = errno;
        if (error == EEXIST && no_clobber) throw Error(ErrorKind::output, "E0803", path, in_the_way);
        if (error) throw Error(ErrorKind::output, "E0803", path, "cannot be put in place: " + system_reason(error));
    } catch (...) {
        ::unlink(temporary.path.c_str());
        throw;
    }
    // The name is on disk only once its folder is; a failure here no longer loses anything.
    const Descriptor directory(open_retrying(folder.c_str(), O_RDONLY | O_DIRECTORY));
    if (directory.get() >= 0) (void)::fsync(directory.get());
}

} // namespace porthole
