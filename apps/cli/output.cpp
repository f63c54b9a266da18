#include "output.h"

#include <cstdio>
#include <cstring>
#include <unistd.h>

#include <nlohmann/json.hpp>

#include "porthole/io/files.h"

namespace porthole::cli {

namespace {

constexpr int kShownWarnings = 20;        ///< of one code
constexpr std::size_t kShownBytes = 1000; ///< of a place or a reason

std::string json_line(const nlohmann::ordered_json& j) {
    return j.dump(-1, ' ', false, nlohmann::ordered_json::error_handler_t::replace) + "\n";
}

void write_stderr(std::string_view text) {
    // Nobody is left to tell if this fails.
    while (!text.empty()) {
        const ssize_t n = ::write(STDERR_FILENO, text.data(), text.size());
        if (n <= 0) return;
        text.remove_prefix(std::size_t(n));
    }
}

} // namespace

Output::Output() : terminal_(::isatty(STDERR_FILENO) == 1) {}

Output::~Output() { done(); }

void Output::configure(bool quiet, bool verbose, bool json_lines) {
    quiet_ = quiet, verbose_ = verbose, json_ = json_lines;
    const char* const term = std::getenv("TERM");
    terminal_ = ::isatty(STDERR_FILENO) == 1 && !json_ && !(term && std::strcmp(term, "dumb") == 0);
}

void Output::message(std::string_view level, std::string_view code, std::string_view where, std::string_view reason) {
    while (where.ends_with(':')) where.remove_suffix(1); // the file as a whole
    const std::string place = escaped(where, kShownBytes), why = escaped(reason, kShownBytes);
    if (json_) {
        write_stderr(json_line({{"level", level}, {"code", code}, {"where", place}, {"message", why}}));
        return;
    }
    clear_bar();
    write_stderr("porthole: " + std::string(level) + '[' + std::string(code) + "]: " + place +
                 (place.empty() ? "" : ": ") + why + '\n');
}

void Output::error(const Error& e) {
    const std::lock_guard lock(mutex_);
    clear_bar();
    stage_.clear();
    message("error", e.code, e.where, e.what());
}

void Output::warning(const Warning& w) {
    const std::lock_guard lock(mutex_);
    const int n = ++warned_[w.code];
    if (n <= kShownWarnings) message("warning", w.code, w.where, w.reason);
    if (n == kShownWarnings + 1)
        message("warning", w.code, "", "more of these follow; the report lists all (--report FILE)");
}

void Output::line(std::string_view level, std::string_view text) {
    if (json_) {
        write_stderr(json_line({{"level", level}, {"message", text}}));
        return;
    }
    clear_bar();
    write_stderr("porthole: " + std::string(text) + '\n');
}

void Output::info(std::string_view text) {
    const std::lock_guard lock(mutex_);
    if (!quiet_) line("info", text);
}

void Output::detail(std::string_view text) {
    const std::lock_guard lock(mutex_);
    if (!quiet_ && verbose_) line("detail", text);
}

void Output::clear_bar() {
    if (bar_shown_) write_stderr("\r\x1b[K");
    bar_shown_ = false;
}

void Output::progress(std::string_view stage, double share) {
    const std::lock_guard lock(mutex_);
    const auto now = std::chrono::steady_clock::now();
    if (stage != stage_) {
        finish_stage({});
        stage_ = stage;
        stage_start_ = last_bar_ = now;
    }
    if (quiet_ || now - last_bar_ < std::chrono::milliseconds(json_ ? 500 : 80)) return;
    if (!terminal_ && !json_) return;
    last_bar_ = now;
    share = share >= 0 && share <= 1 ? share : 0;
    if (json_) {
        write_stderr(json_line({{"level", "progress"}, {"stage", stage_}, {"share", share}}));
        return;
    }
    constexpr int kWidth = 28;
    std::string bar(std::size_t(share * kWidth), '#');
    bar.resize(kWidth, '.');
    char text[128];
    std::snprintf(text, sizeof text, "\r\x1b[Kporthole: %-7s [%s] %3d %%  %.1f s", stage_.c_str(), bar.c_str(),
                  int(share * 100), std::chrono::duration<double>(now - stage_start_).count());
    write_stderr(text);
    bar_shown_ = true;
}

void Output::finish_stage(std::string_view note) {
    if (stage_.empty()) return;
    const double seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - stage_start_).count();
    if (!quiet_) {
        if (json_) {
            nlohmann::ordered_json j{{"level", "stage"}, {"stage", stage_}, {"seconds", seconds}};
            if (!note.empty()) j["message"] = note;
            write_stderr(json_line(j));
        } else {
            char text[64];
            std::snprintf(text, sizeof text, "%-7s %7.2f s", stage_.c_str(), seconds);
            line("stage", std::string(text) + (note.empty() ? "" : "  ") + std::string(note));
        }
    }
    stage_.clear();
}

void Output::done(std::string_view note) {
    const std::lock_guard lock(mutex_);
    finish_stage(note);
    clear_bar();
}

void print(std::string_view text) { write_file("-", std::as_bytes(std::span(text))); }

std::string with_commas(std::int64_t n) {
    std::string digits = std::to_string(n);
    for (auto i = std::ptrdiff_t(digits.size()) - 3; i > (n < 0 ? 1 : 0); i -= 3) digits.insert(std::size_t(i), ",");
    return digits;
}

std::string in_seconds(double seconds) {
    char text[32];
    std::snprintf(text, sizeof text, "%.2f s", seconds);
    return text;
}

} // namespace porthole::cli
