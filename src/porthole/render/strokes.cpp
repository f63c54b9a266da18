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

float Ink::darkness(int x, int y) const {
    float sum = 0;
    for (const float part : at(x, y)) sum += part;
    return sum * (1.0f / float(kParts));
}

} // namespace porthole
