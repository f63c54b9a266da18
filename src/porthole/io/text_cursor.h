// Walks the lines and words of a text file in memory: the scanner of the OBJ, MTL, ASCII PLY
// and ASCII STL readers. Needs no terminating zero and never reads past the end.
#pragma once

#include <charconv>
#include <cstdint>
#include <limits>
#include <string_view>

#include "porthole/base/math.h"

namespace porthole {

class TextCursor {
public:
    /// @param continuations  a backslash before the line's end joins it with the next (OBJ, MTL).
    explicit TextCursor(std::string_view text, bool continuations = false)
        : at_(text.data()), end_(text.data() + text.size()), continuations_(continuations) {}

    [[nodiscard]] bool at_end() const { return at_ == end_; }
    [[nodiscard]] std::uint64_t line() const { return line_; } ///< from 1
    [[nodiscard]] const char* position() const { return at_; }

    void skip_blanks() {
        while (at_ != end_) {
            if (*at_ == ' ' || *at_ == '\t' || *at_ == '\v' || *at_ == '\f')
                ++at_;
            else if (*at_ != '\\' || !continuations_ || !skip_joint())
                return;
        }
    }
    /// Skips blanks, then tells whether the line ends here (or a comment begins).
    [[nodiscard]] bool at_line_end() {
        skip_blanks();
        return at_ == end_ || *at_ == '\n' || *at_ == '\r' || *at_ == '#';
    }
    /// To the start of the next line, past "\n", "\r\n" or "\r".
    void next_line() {
        while (at_ != end_ && *at_ != '\n' && *at_ != '\r') ++at_;
        if (at_ == end_) return;
        end_line();
    }
    /// The next word of the line, empty at its end.
    [[nodiscard]] std::string_view word() {
        skip_blanks();
        const char* const first = at_;
        while (at_ != end_ && !ends_word(at_)) ++at_;
        return {first, std::size_t(at_ - first)};
    }
    /// What is left of the line, blanks trimmed at both ends.
    [[nodiscard]] std::string_view rest_of_line() {
        skip_blanks();
        const char* const first = at_;
        while (at_ != end_ && *at_ != '\n' && *at_ != '\r') ++at_;
        const char* last = at_;
        while (last != first && (last[-1] == ' ' || last[-1] == '\t')) --last;
        return {first, std::size_t(last - first)};
    }

    /// Reads a number (float or double) that fills a word. A value beyond T's range becomes
    /// infinite.
    /// @return false, with the cursor at the word, when the next word is not a number.
    template <typename T> [[nodiscard]] bool number(T& value) {
        skip_blanks();
        const char* const first = at_;
        const char* p = at_ != end_ && *at_ == '+' ? at_ + 1 : at_;
        if (p != at_ && p != end_ && *p == '-') return false;
        const auto [after, fault] = std::from_chars(p, end_, value);
        if (fault == std::errc::invalid_argument) return false;
        if (fault == std::errc::result_out_of_range) {
            long double wide = 0; // tells too small from too large
            const bool tiny = std::from_chars(p, end_, wide).ec == std::errc{} && std::abs(wide) < 1;
            value = tiny ? T(0) : std::numeric_limits<T>::infinity();
        }
        at_ = after;
        if (at_ == end_ || ends_word(at_)) return true;
        at_ = first;
        return false;
    }

    /// Reads digits with an optional sign, up to whatever follows them. Values that do not fit
    /// become the largest or smallest that does.
    /// @return false, with the cursor unmoved, when there are none.
    [[nodiscard]] bool integer(std::int64_t& value) {
        const char* const p = at_ != end_ && *at_ == '+' ? at_ + 1 : at_;
        if (p != at_ && p != end_ && *p == '-') return false;
        const auto [after, fault] = std::from_chars(p, end_, value);
        if (fault == std::errc::invalid_argument) return false;
        if (fault == std::errc::result_out_of_range)
            value = *p == '-' ? std::numeric_limits<std::int64_t>::min() : std::numeric_limits<std::int64_t>::max();
        at_ = after;
        return true;
    }
    /// Steps over `c` if it comes next.
    [[nodiscard]] bool accept(char c) {
        if (at_ == end_ || *at_ != c) return false;
        ++at_;
        return true;
    }
    /// Whether a word ends here.
    [[nodiscard]] bool at_word_end() const { return at_ == end_ || ends_word(at_); }

private:
    [[nodiscard]] bool ends_word(const char* p) const {
        return *p == ' ' || *p == '\t' || *p == '\n' || *p == '\r' || *p == '\v' || *p == '\f' ||
               (*p == '\\' && continuations_ && (p + 1 == end_ || p[1] == '\n' || p[1] == '\r'));
    }
    void end_line() {
        if (*at_ == '\r' && at_ + 1 != end_ && at_[1] == '\n') ++at_;
        ++at_;
        ++line_;
    }
    bool skip_joint() {
        if (at_ + 1 == end_) {
            ++at_;
            return true;
        }
        if (at_[1] != '\n' && at_[1] != '\r') return false;
        ++at_;
        end_line();
        return true;
    }

    const char* at_;
    const char* end_;
    std::uint64_t line_ = 1;
    bool continuations_;
};

} // namespace porthole
