#include "porthole/render/strokes.h"

namespace porthole {

void Ink::add(const Stroke& stroke) {
    const Vec2f d = stroke.b - stroke.a;
    const float l2 = dot(d, d);
    const float per_l2 = l2 > 0 ? 1.0f / l2 : 0.0f;
    const float length = std::sqrt(l2);
    const float reach = stroke.half_width + 0.5f / float(kSide);
    const auto first = [](float v, int low) { return std::max(low, int(std::floor(std::max(v, -1e6f)))); };
    const auto last = [](float v, int high) { return std::min(high, int(std::floor(std::min(v, 1e6f))) + 1); };
    const int y0 = first(std::min(stroke.a.y, stroke.b.y) - reach, tile_.y0);
    const int y1 = last(std::max(stroke.a.y, stroke.b.y) + reach, tile_.y1);
    // Half a pixel's diagonal more: no sub-position of a pixel farther off can be reached.
    const float far = reach + 0.7072f;
    for (int y = y0; y < y1; ++y) {
        float low = std::min(stroke.a.x, stroke.b.x), high = std::max(stroke.a.x, stroke.b.x);
        if (std::abs(d.y) > 1e-3f) {
            // The part of the segment that comes near this row.
            const float s0 = (float(y) - far - stroke.a.y) / d.y, s1 = (float(y) + 1 + far - stroke.a.y) / d.y;
            const float t0 = clamp01(std::min(s0, s1)), t1 = clamp01(std::max(s0, s1));
            const float x0 = stroke.a.x + d.x * t0, x1 = stroke.a.x + d.x * t1;
            low = std::min(x0, x1), high = std::max(x0, x1);
        }
        const int x0 = first(low - far, tile_.x0), x1 = last(high + far, tile_.x1);
        for (int x = x0; x < x1; ++x) {
            const Vec2f centre{float(x) + 0.5f - stroke.a.x, float(y) + 0.5f - stroke.a.y};
            if (std::abs(centre.x * d.y - centre.y * d.x) > far * length && l2 > 0) continue;
            Parts& parts = at(x, y);
            for (int i = 0; i < kParts; ++i) {
                const Vec2f p = position(x, y, i) - stroke.a;
                const float t = clamp01(dot(p, d) * per_l2);
                const Vec2f off = p - d * t;
                const float distance = std::sqrt(dot(off, off));
                const float darkness = stroke.darkness_a + (stroke.darkness_b - stroke.darkness_a) * t;
                parts[std::size_t(i)] =
                    std::max(parts[std::size_t(i)], darkness * part_coverage(stroke.half_width - distance));
            }
        }
    }
}

void Ink::add_dashed(const Stroke& stroke, float on_px) {
    // Directions are rounded to one of eight, so that neighbouring pieces measure alike.
    constexpr int kDirections = 8;
    static constexpr Vec2f kAxis[kDirections] = {
        {1, 0}, {0.92388f, 0.38268f},  {0.70711f, 0.70711f},  {0.38268f, 0.92388f},
        {0, 1}, {-0.38268f, 0.92388f}, {-0.70711f, 0.70711f}, {-0.92388f, 0.38268f}};
    const Vec2f d = stroke.b - stroke.a;
    int best = 0;
    for (int i = 1; i < kDirections; ++i)
        if (std::abs(dot(d, kAxis[i])) > std::abs(dot(d, kAxis[best]))) best = i;
    const float from = dot(stroke.a, kAxis[best]), along = dot(d, kAxis[best]);
    const float period = on_px * (5.0f / 3.0f);
    const float low = std::min(from, from + along), high = std::max(from, from + along);
    if (!(high > low)) return;
    for (float k = std::floor(low / period); k * period < high; k += 1) {
        const float begin = std::max(low, k * period), end = std::min(high, k * period + on_px);
        if (!(end > begin)) continue;
        const auto at = [&](float v) { return (v - from) / along; };
        const float t0 = at(begin), t1 = at(end);
        const auto dark = [&](float t) {
            return stroke.darkness_a + (stroke.darkness_b - stroke.darkness_a) * clamp01(t);
        };
        add({stroke.a + d * t0, stroke.a + d * t1, stroke.half_width, dark(t0), dark(t1)});
    }
}

float Ink::darkness(int x, int y) const {
    float sum = 0;
    for (const float part : at(x, y)) sum += part;
    return sum * (1.0f / float(kParts));
}

} // namespace porthole
