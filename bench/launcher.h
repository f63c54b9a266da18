// Runs programs and tells what they took.
#pragma once

#include <sys/types.h>

#include <cstdint>
#include <string>
#include <vector>

namespace porthole::bench {

struct Finished {
    int status = 0; ///< as waitpid() has it
    double wall_s = 0, cpu_s = 0;
    std::int64_t peak_bytes = 0; ///< largest resident size
};

/// A small process of its own that starts the programs. Linux counts the memory of whoever starts
/// a program towards that program's peak, and the benchmarks hold gigabytes: make it first of all.
class Launcher {
public:
    /// @throws std::system_error when no process can be made.
    Launcher();
    ~Launcher();
    Launcher(const Launcher&) = delete;
    Launcher& operator=(const Launcher&) = delete;

    /// Waits for the end of the program. @param arguments  the first one is the program's path.
    /// @throws std::system_error when it cannot be started.
    [[nodiscard]] Finished run(const std::vector<std::string>& arguments);

private:
    int socket_ = -1;
    pid_t pid_ = -1;
};

} // namespace porthole::bench
