// Pictures for the tests of this folder: drawn as text, by formula or by chance.
#pragma once

#include <cmath>
#include <cstdint>
#include <random>
#include <string>
#include <vector>

#include "porthole/base/ids.h"

namespace porthole::testing {

/// 'A' is part 0, 'B' part 1, ...; anything else is no part. Top left pixel at (x0, y0).
inline Image<PartId> ids_from_text(const std::vector<std::string>& rows, std::int32_t x0 = 0, std::int32_t y0 = 0) {
    const auto width = std::int32_t(rows.at(0).size()), height = std::int32_t(rows.size());
    Image<PartId> ids(Rect{x0, y0, x0 + width, y0 + height}, kNoPart);
    for (std::int32_t y = 0; y < height; ++y)
        for (std::int32_t x = 0; x < width; ++x) {
            const char c = rows[std::size_t(y)].at(std::size_t(x));
            if (c >= 'A' && c <= 'Z') ids(x0 + x, y0 + y) = PartId(std::uint32_t(c - 'A'));
        }
    return ids;
}

/// 1 where the text has '#'.
inline Mask mask_from_text(const std::vector<std::string>& rows) {
    Mask mask(std::int32_t(rows.at(0).size()), std::int32_t(rows.size()));
    for (std::int32_t y = 0; y < mask.height(); ++y)
        for (std::int32_t x = 0; x < mask.width(); ++x) mask(x, y) = rows[std::size_t(y)].at(std::size_t(x)) == '#';
    return mask;
}

/// 1 where f(x, y).
template <typename F> Mask mask_where(Rect window, const F& f) {
    Mask mask(window);
    for (std::int32_t y = window.y0; y < window.y1; ++y)
        for (std::int32_t x = window.x0; x < window.x1; ++x) mask(x, y) = f(x, y) ? 1 : 0;
    return mask;
}

/// Pixels whose centre lies within `radius` of the centre of pixel (cx, cy).
inline Mask disc(Rect window, double cx, double cy, double radius) {
    return mask_where(window, [&](int x, int y) { return std::hypot(x - cx, y - cy) <= radius; });
}

inline Image<PartId> ids_of(const Mask& mask, PartId id = PartId{0}) {
    Image<PartId> ids(mask.window(), kNoPart);
    for (std::size_t i = 0; i < mask.pixels().size(); ++i)
        if (mask.pixels()[i]) ids.pixels()[i] = id;
    return ids;
}

/// Ids of `mask` as one part, all at `depth`.
inline IdBuffer id_buffer(const Mask& mask, float depth = 1, PartId id = PartId{0}) {
    IdBuffer buffer(mask.window());
    buffer.id = ids_of(mask, id);
    for (std::size_t i = 0; i < mask.pixels().size(); ++i)
        if (mask.pixels()[i]) buffer.depth.pixels()[i] = depth;
    return buffer;
}

template <typename T> Image<T> crop(const Image<T>& image, Rect window) {
    Image<T> result(window);
    for (std::int32_t y = window.y0; y < window.y1; ++y)
        for (std::int32_t x = window.x0; x < window.x1; ++x) result(x, y) = image(x, y);
    return result;
}

/// A random number in [0, n), the same on every machine.
inline std::int32_t pick(std::mt19937& random, std::int32_t n) { return std::int32_t(random() % std::uint32_t(n)); }

enum class Kind { noise, blobs, lines, rings, checkerboard };
inline constexpr Kind kAllKinds[] = {Kind::noise, Kind::blobs, Kind::lines, Kind::rings, Kind::checkerboard};

inline Mask random_mask(Rect window, Kind kind, std::mt19937& random) {
    const auto near_by = [&] {
        return Vec2i{window.x0 + pick(random, window.width()), window.y0 + pick(random, window.height())};
    };
    switch (kind) {
    case Kind::noise: {
        const int share = 10 + pick(random, 80);
        return mask_where(window, [&](int, int) { return pick(random, 100) < share; });
    }
    case Kind::blobs: {
        Mask mask(window);
        for (int n = 12; n > 0; --n) {
            const Vec2i c = near_by();
            const int r = 1 + pick(random, 14);
            const std::uint8_t value = n % 3 != 0;
            for (std::int32_t y = window.y0; y < window.y1; ++y)
                for (std::int32_t x = window.x0; x < window.x1; ++x)
                    if ((x - c.x) * (x - c.x) + (y - c.y) * (y - c.y) <= r * r) mask(x, y) = value;
        }
        return mask;
    }
    case Kind::lines: {
        Mask mask(window);
        for (int n = 8; n > 0; --n) {
            const Vec2i a = near_by(), b = near_by();
            const int steps = std::max({std::abs(b.x - a.x), std::abs(b.y - a.y), 1});
            for (int i = 0; i <= steps; ++i) mask(a.x + (b.x - a.x) * i / steps, a.y + (b.y - a.y) * i / steps) = 1;
        }
        return mask;
    }
    case Kind::rings: {
        const Vec2i c = near_by();
        const int period = 2 + pick(random, 6), width = 1 + pick(random, period - 1);
        return mask_where(
            window, [&](int x, int y) { return std::max(std::abs(x - c.x), std::abs(y - c.y)) % period < width; });
    }
    case Kind::checkerboard: {
        const int cell = 1 + pick(random, 3);
        return mask_where(window, [&](int x, int y) { return ((x + 64) / cell + (y + 64) / cell) % 2 == 0; });
    }
    }
    return Mask(window);
}

/// `mask` without its outermost `by` pixels.
inline Mask with_background_frame(Mask mask, std::int32_t by = 1) {
    const Rect inner = mask.window().grown(-by);
    for (std::int32_t y = mask.window().y0; y < mask.window().y1; ++y)
        for (std::int32_t x = mask.window().x0; x < mask.window().x1; ++x)
            if (!inner.contains(x, y)) mask(x, y) = 0;
    return mask;
}

} // namespace porthole::testing
