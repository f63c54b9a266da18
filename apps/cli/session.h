// What the subcommands share: reading the model, limits, times.
#pragma once

#include <chrono>
#include <future>
#include <optional>

#include "options.h"
#include "output.h"
#include "porthole/base/parallel.h"
#include "porthole/io/files.h"

namespace porthole::cli {

/// Exit codes, see DESIGN: errors of a kind, then outcomes.
inline constexpr int kExitDone = 0, kExitBug = 1, kExitUsage = 2, kExitInput = 3, kExitOutput = 4, kExitLimit = 5,
                     kExitNothingRevealed = 8, kExitDifferences = 9;
[[nodiscard]] int exit_code(ErrorKind kind);

/// Seconds since it was made.
class Stopwatch {
public:
    [[nodiscard]] double seconds() const {
        return std::chrono::duration<double>(std::chrono::steady_clock::now() - start_).count();
    }

private:
    std::chrono::steady_clock::time_point start_ = std::chrono::steady_clock::now();
};

/// Bytes that a command may take: --max-memory, else most of what the machine has.
[[nodiscard]] std::uint64_t memory_limit(const CommonOptions& options);

/// Makes the process fail cleanly when it would take more than --max-memory, if that is given.
void limit_memory(const CommonOptions& options);

/// Reads the model and says so: its warnings go to `out` too.
[[nodiscard]] Scene load(const CommonOptions& options, Output& out, const Control& control);

/// @throws Error input E0206 when there is nothing to draw.
void require_parts(const Scene& scene);

/// The model file's digest, taken beside other work; unset if no report asks for it, or if the
/// model is no file that can be read again.
using ModelDigest = std::future<std::optional<FileDigest>>;
[[nodiscard]] ModelDigest digest_model(const CommonOptions& common, const PictureOptions& picture,
                                       const Control& control);

/// What every report says of the program, the model and the run.
void fill_report(Report& report, const char* command, const Scene& scene, const CommonOptions& common,
                 const PictureOptions& picture, ModelDigest digest);

/// The subcommands. Each returns an exit code or throws Error or Cancelled.
int run_reveal(const RevealOptions& options, Output& out, const Control& control);
int run_render(const RenderOptions& options, Output& out, const Control& control);
int run_parts(const PartsOptions& options, Output& out, const Control& control);
int run_check(const CheckOptions& options, Output& out, const Control& control);

} // namespace porthole::cli
