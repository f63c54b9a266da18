// A rectangle of pixels and a row-major image. Pixel (0,0) is top-left, its centre (0.5, 0.5).
#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cassert>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <memory>
#include <new>
#include <span>
#include <type_traits>
#include <utility>

#include "porthole/base/math.h"

namespace porthole {

/// Half-open pixel rectangle [x0, x1) x [y0, y1).
struct Rect {
    std::int32_t x0 = 0, y0 = 0, x1 = 0, y1 = 0;
    [[nodiscard]] constexpr std::int32_t width() const { return x1 - x0; }
    [[nodiscard]] constexpr std::int32_t height() const { return y1 - y0; }
    [[nodiscard]] constexpr bool empty() const { return x0 >= x1 || y0 >= y1; }
    [[nodiscard]] constexpr bool contains(std::int32_t x, std::int32_t y) const {
        return x >= x0 && x < x1 && y >= y0 && y < y1;
    }
    [[nodiscard]] constexpr Rect grown(std::int32_t by) const { return {x0 - by, y0 - by, x1 + by, y1 + by}; }
    [[nodiscard]] constexpr Rect intersected(Rect r) const {
        return {x0 > r.x0 ? x0 : r.x0, y0 > r.y0 ? y0 : r.y0, x1 < r.x1 ? x1 : r.x1, y1 < r.y1 ? y1 : r.y1};
    }
    friend constexpr bool operator==(const Rect&, const Rect&) = default;
};

/// Tells the system that memory not yet touched will all be: it then comes in large pages, which
/// takes a fraction of the time of small ones. Small blocks are left alone.
void expect_use(void* memory, std::size_t bytes);

/// Row-major pixels of `window`; coordinates are absolute, so that a crop and the
/// full picture share them. Pixels whose bytes are all zero cost nothing to create: the system
/// hands out their memory so, where and when it is first touched.
template <typename T> class Image {
    static_assert(std::is_trivially_copyable_v<T> && std::is_trivially_destructible_v<T>);

public:
    Image() = default;
    explicit Image(Rect window, T fill = T{}) : window_(window) {
        if (window.empty()) return;
        const bool zeros = is_zeros(fill);
        allocate(std::size_t(window.width()) * std::size_t(window.height()), zeros);
        expect_use(pixels_.get(), size_ * sizeof(T));
        if (!zeros) std::uninitialized_fill_n(pixels_.get(), size_, fill);
    }
    Image(std::int32_t width, std::int32_t height, T fill = T{}) : Image(Rect{0, 0, width, height}, fill) {}
    Image(const Image& other) : window_(other.window_) {
        if (other.empty()) return;
        allocate(other.size_, false);
        expect_use(pixels_.get(), size_ * sizeof(T));
        std::uninitialized_copy_n(other.pixels_.get(), size_, pixels_.get());
    }
    Image(Image&& other) noexcept { swap(other); }
    Image& operator=(Image other) noexcept {
        swap(other);
        return *this;
    }
    ~Image() = default;

    [[nodiscard]] Rect window() const { return window_; }
    [[nodiscard]] std::int32_t width() const { return window_.width(); }
    [[nodiscard]] std::int32_t height() const { return window_.height(); }
    [[nodiscard]] bool empty() const { return size_ == 0; }
    [[nodiscard]] bool contains(std::int32_t x, std::int32_t y) const { return window_.contains(x, y); }

    T& operator()(std::int32_t x, std::int32_t y) { return pixels_.get()[index(x, y)]; }
    const T& operator()(std::int32_t x, std::int32_t y) const { return pixels_.get()[index(x, y)]; }
    /// The pixel at (x, y), or `outside` beyond the window.
    [[nodiscard]] T at_or(std::int32_t x, std::int32_t y, T outside) const {
        return contains(x, y) ? (*this)(x, y) : outside;
    }
    T* row(std::int32_t y) { return pixels_.get() + index(window_.x0, y); }
    const T* row(std::int32_t y) const { return pixels_.get() + index(window_.x0, y); }
    std::span<T> pixels() { return {pixels_.get(), size_}; }
    [[nodiscard]] std::span<const T> pixels() const { return {pixels_.get(), size_}; }

    [[nodiscard]] std::size_t index(std::int32_t x, std::int32_t y) const {
        assert(contains(x, y));
        return std::size_t(y - window_.y0) * std::size_t(window_.width()) + std::size_t(x - window_.x0);
    }
    friend bool operator==(const Image& a, const Image& b) {
        return a.window_ == b.window_ && std::ranges::equal(a.pixels(), b.pixels());
    }

private:
    struct Free {
        void operator()(T* p) const { std::free(p); }
    };
    static bool is_zeros(const T& value) {
        const auto bytes = std::bit_cast<std::array<unsigned char, sizeof(T)>>(value);
        return std::ranges::all_of(bytes, [](unsigned char b) { return b == 0; });
    }
    void allocate(std::size_t n, bool zeros) {
        if (n > std::size_t(PTRDIFF_MAX) / sizeof(T)) throw std::bad_alloc();
        pixels_.reset(static_cast<T*>(zeros ? std::calloc(n, sizeof(T)) : std::malloc(n * sizeof(T))));
        if (!pixels_) throw std::bad_alloc();
        size_ = n;
    }
    void swap(Image& other) noexcept {
        std::swap(window_, other.window_);
        std::swap(pixels_, other.pixels_);
        std::swap(size_, other.size_);
    }

    Rect window_;
    std::unique_ptr<T[], Free> pixels_;
    std::size_t size_ = 0;
};

/// Pixels that start as zeros and of which most may never be touched: memory is taken a page at a
/// time as they are. T is of those whose bytes may all be zero.
template <typename T> class SparseImage {
public:
    explicit SparseImage(Rect window) : window_(window) {
        if (window.empty()) return;
        pixels_.reset(
            static_cast<T*>(std::calloc(std::size_t(window.width()) * std::size_t(window.height()), sizeof(T))));
        if (!pixels_) throw std::bad_alloc();
    }
    [[nodiscard]] Rect window() const { return window_; }
    [[nodiscard]] bool contains(std::int32_t x, std::int32_t y) const { return window_.contains(x, y); }
    T& operator()(std::int32_t x, std::int32_t y) { return pixels_.get()[index(x, y)]; }
    const T& operator()(std::int32_t x, std::int32_t y) const { return pixels_.get()[index(x, y)]; }
    /// All of them will be touched.
    void expect_all() {
        if (!window_.empty())
            expect_use(pixels_.get(), std::size_t(window_.width()) * std::size_t(window_.height()) * sizeof(T));
    }

private:
    static_assert(std::is_trivially_copyable_v<T> && std::is_trivially_destructible_v<T>);
    struct Free {
        void operator()(T* p) const { std::free(p); }
    };
    [[nodiscard]] std::size_t index(std::int32_t x, std::int32_t y) const {
        assert(contains(x, y));
        return std::size_t(y - window_.y0) * std::size_t(window_.width()) + std::size_t(x - window_.x0);
    }
    Rect window_;
    std::unique_ptr<T[], Free> pixels_;
};

struct Rgba8 {
    std::uint8_t r = 0, g = 0, b = 0, a = 255;
    friend constexpr bool operator==(const Rgba8&, const Rgba8&) = default;
};

/// Values of a file's channels, of 8 or 16 bits.
struct Rgba16 {
    std::uint16_t r = 0, g = 0, b = 0, a = 0;
    friend constexpr bool operator==(const Rgba16&, const Rgba16&) = default;
};

/// Yes/no per pixel (std::vector<bool> is not thread-safe per element).
using Mask = Image<std::uint8_t>;

} // namespace porthole
