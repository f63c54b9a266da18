// A yes or no for each pixel, eight to a byte.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <vector>

#include "porthole/base/image.h"

namespace porthole {

/// Pixels of a window that are in or out. Rows are whole bytes, the first pixel in the lowest bit: an
/// eighth of a Mask's memory, and sixty-four pixels at a time to look at.
class Bits {
public:
    Bits() = default;
    /// All out. @param window  x0 a multiple of 8.
    explicit Bits(Rect window)
        : window_(window), stride_(std::size_t(window.width() + 7) / 8),
          bytes_(stride_ * std::size_t(window.height()) + 8) {} // eight more: they are read eight at a time

    [[nodiscard]] Rect window() const { return window_; }
    [[nodiscard]] std::size_t bytes_a_row() const { return stride_; }
    std::uint8_t* row(int y) { return bytes_.data() + std::size_t(y - window_.y0) * stride_; }
    [[nodiscard]] const std::uint8_t* row(int y) const { return bytes_.data() + std::size_t(y - window_.y0) * stride_; }
    /// The byte of the pixels (x & ~7, y) to (x | 7, y).
    std::uint8_t& eight(int x, int y) { return row(y)[(x - window_.x0) >> 3]; }

    /// Whether all of `r` is set.
    [[nodiscard]] bool all(Rect r) const { return rows_to_go(r).empty(); }

    /// `r` without the rows at its top and its bottom that are set from end to end; empty if all are.
    [[nodiscard]] Rect rows_to_go(Rect r) const {
        while (r.y0 < r.y1 && all_of_row(r.x0, r.x1, r.y0)) ++r.y0;
        while (r.y0 < r.y1 && all_of_row(r.x0, r.x1, r.y1 - 1)) --r.y1;
        return r;
    }

    /// Sets columns [from, to) of row y.
    void set(int from, int to, int y) {
        if (from >= to) return;
        from -= window_.x0, to -= window_.x0;
        std::uint8_t* bytes = row(y) + (from >> 3);
        const int n = ((to - 1) >> 3) - (from >> 3); // bytes after the first
        if (n < 8) {
            const std::uint64_t end = ~std::uint64_t{0} >> (63 - (to - 1 - (from & ~7)));
            store(bytes, load(bytes) | (end & ~std::uint64_t{0} << (from & 7)));
            return;
        }
        bytes[0] = std::uint8_t(bytes[0] | 0xFF << (from & 7));
        int i = 1;
        for (; i + 8 <= n; i += 8) store(bytes + i, ~std::uint64_t{0});
        for (; i < n; ++i) bytes[i] = 0xFF;
        bytes[n] = std::uint8_t(bytes[n] | 0xFF >> (7 - ((to - 1) & 7)));
    }

    [[nodiscard]] bool operator()(int x, int y) const {
        return row(y)[(x - window_.x0) >> 3] >> ((x - window_.x0) & 7) & 1;
    }
    [[nodiscard]] bool empty() const { return window_.empty(); }

    void set(Rect r) {
        for (int y = r.y0; y < r.y1; ++y) set(r.x0, r.x1, y);
    }

    Bits& operator|=(const Bits& other) {
        for (std::size_t i = 0; i < bytes_.size(); ++i) bytes_[i] = std::uint8_t(bytes_[i] | other.bytes_[i]);
        return *this;
    }

private:
    static std::uint64_t load(const std::uint8_t* at) {
        std::uint64_t v;
        std::memcpy(&v, at, 8);
        return v;
    }
    static void store(std::uint8_t* at, std::uint64_t v) { std::memcpy(at, &v, 8); }

    [[nodiscard]] bool all_of_row(int x0, int x1, int y) const {
        // Fifty-seven pixels from any on are within eight bytes.
        for (int x = x0; x < x1; x += 57) {
            const int shift = (x - window_.x0) & 7, n = std::min(57, x1 - x);
            const std::uint64_t wanted = ((std::uint64_t{1} << n) - 1) << shift;
            if (wanted & ~load(row(y) + ((x - window_.x0) >> 3))) return false;
        }
        return true;
    }

    Rect window_;
    std::size_t stride_ = 0;
    std::vector<std::uint8_t> bytes_;
};

} // namespace porthole
