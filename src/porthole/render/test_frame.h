// Comparing pictures bit for bit, in tests.
#pragma once

#include <cstring>

#include "porthole/render/render.h"

namespace porthole::test {

inline bool same_color(Vec4f a, Vec4f b) { return std::memcmp(&a, &b, sizeof a) == 0; }

/// Whether colours, ids and depths are the same, bit for bit.
inline bool same_bits(const Frame& a, const Frame& b) {
    const auto equal = [](const auto& x, const auto& y) {
        return x.window() == y.window() &&
               std::memcmp(x.pixels().data(), y.pixels().data(), x.pixels().size() * sizeof(x.pixels()[0])) == 0;
    };
    return equal(a.color, b.color) && equal(a.ids.id, b.ids.id) && equal(a.ids.depth, b.ids.depth);
}

} // namespace porthole::test
