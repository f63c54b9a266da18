// Small helpers on masks and pixel sets.
#pragma once

#include <algorithm>
#include <cstring>
#include <span>

#include "porthole/base/image.h"

namespace porthole {

/// Smallest box of the pixels with mask = 1; empty if there are none.
inline Rect bounds_of(const Mask& mask) {
    const Rect w = mask.window();
    Rect r{w.x1, w.y1, w.x0, w.y0};
    for (std::int32_t y = w.y0; y < w.y1; ++y) {
        const std::uint8_t* row = mask.row(y) - w.x0;
        const void* first = std::memchr(row + w.x0, 1, std::size_t(w.width()));
        if (!first) continue;
        r.x0 = std::min(r.x0, std::int32_t(static_cast<const std::uint8_t*>(first) - row));
        std::int32_t end = w.x1; // only beyond what is known can there be something new
        while (end > r.x1 && row[end - 1] != 1) --end;
        r.x1 = std::max(r.x1, end);
        r.y0 = std::min(r.y0, y);
        r.y1 = y + 1;
    }
    return r.empty() ? Rect{} : r;
}

inline Rect bounds_of(std::span<const Vec2i> pixels) {
    if (pixels.empty()) return {};
    Rect r{pixels[0].x, pixels[0].y, pixels[0].x + 1, pixels[0].y + 1};
    for (const Vec2i p : pixels)
        r = {std::min(r.x0, p.x), std::min(r.y0, p.y), std::max(r.x1, p.x + 1), std::max(r.y1, p.y + 1)};
    return r;
}

/// 1 where mask = 0, else 0.
inline Mask complement(const Mask& mask) {
    Mask result(mask.window());
    std::transform(mask.pixels().begin(), mask.pixels().end(), result.pixels().begin(),
                   [](std::uint8_t m) { return std::uint8_t(m == 0); });
    return result;
}

} // namespace porthole
