// Everything that the program says: errors, warnings and progress on standard error, results
// on standard output.
#pragma once

#include <chrono>
#include <map>
#include <mutex>
#include <string>
#include <string_view>

#include "porthole/base/error.h"

namespace porthole::cli {

/// Says things on standard error: as lines, as JSON lines (--log json), and on a terminal
/// with a progress bar. Thread-safe.
class Output {
public:
    Output();
    ~Output(); ///< ends the stage under way

    Output(const Output&) = delete;
    Output& operator=(const Output&) = delete;

    /// Warnings and errors are always said; `quiet` leaves out the rest, `verbose` adds to it.
    void configure(bool quiet, bool verbose, bool json_lines);

    /// `porthole: error[E0301]: where: reason`, escaped.
    void error(const Error& e);
    /// The same with `warning`. After 20 of one code the rest are only counted.
    void warning(const Warning& w);
    /// Something worth knowing.
    void info(std::string_view text);
    /// Something for those who asked with --verbose.
    void detail(std::string_view text);

    /// `stage` is under way, `share` of it done. A new name ends the stage before, which
    /// prints its name and seconds.
    void progress(std::string_view stage, double share);
    /// Ends the stage under way; `note` says what came of it.
    void done(std::string_view note = {});

private:
    void line(std::string_view level, std::string_view text);
    void message(std::string_view level, std::string_view code, std::string_view where, std::string_view reason);
    void finish_stage(std::string_view note);
    void clear_bar();

    std::mutex mutex_;
    bool quiet_ = false, verbose_ = false, json_ = false;
    bool terminal_ = false;
    bool bar_shown_ = false;
    std::string stage_; ///< empty: none
    std::chrono::steady_clock::time_point stage_start_, last_bar_;
    std::map<std::string, int, std::less<>> warned_; ///< by code
};

/// Writes all of `text` to standard output. @throws Error output E0802.
void print(std::string_view text);

/// "1,234,567"
[[nodiscard]] std::string with_commas(std::int64_t n);
/// "0.42 s"
[[nodiscard]] std::string in_seconds(double seconds);

} // namespace porthole::cli
