// Antialiased strokes: segments of constant width in pixels, gathered as ink per pixel.
#pragma once

#include <array>
#include <vector>

#include "porthole/base/image.h"

namespace porthole {

/// A segment with round ends, in continuous pixel positions (pixel centres at .5).
struct Stroke {
    Vec2f a, b;
    float half_width = 0.5f;              ///< pixels, > 0
    float darkness_a = 1, darkness_b = 1; ///< share of the light it takes at either end, [0, 1]; linear between
};

/// Ink on the pixels of one tile. Where strokes overlap the darkest counts, so that a chain of
/// strokes is as even as one line.
class Ink {
public:
    static constexpr int kSide = 4, kParts = kSide * kSide; ///< sub-positions of a pixel

    explicit Ink(Rect tile)
        : tile_(tile), parts_(tile.empty() ? 0 : std::size_t(tile.width()) * std::size_t(tile.height())) {}

    [[nodiscard]] Rect tile() const { return tile_; }
    /// Continuous position of sub-position `i` of pixel (x, y), row by row.
    [[nodiscard]] static Vec2f position(int x, int y, int i) {
        constexpr float kStep = 1.0f / float(kSide);
        const int row = i / kSide, column = i % kSide;
        return {float(x) + (float(column) + 0.5f) * kStep, float(y) + (float(row) + 0.5f) * kStep};
    }
    /// Lays a stroke. Cost: sixteen distances for each pixel it comes near.
    void add(const Stroke& stroke);
    /// The dashes of a stroke, `on_px` long with gaps of two thirds of that. Where they lie follows
    /// from the position along the stroke's direction, so that the pieces of a curve go on with
    /// the pattern and lines that coincide have their dashes in the same places.
    void add_dashed(const Stroke& stroke, float on_px);
    /// Lays ink on one sub-position.
    void darken(int x, int y, int i, float darkness) {
        float& part = at(x, y)[std::size_t(i)];
        part = std::max(part, darkness);
    }
    [[nodiscard]] float part(int x, int y, int i) const { return at(x, y)[std::size_t(i)]; }
    /// Mean over a pixel: the share of its light that the ink takes.
    [[nodiscard]] float darkness(int x, int y) const;

private:
    using Parts = std::array<float, kParts>;
    Parts& at(int x, int y) { return parts_[index(x, y)]; }
    [[nodiscard]] const Parts& at(int x, int y) const { return parts_[index(x, y)]; }
    [[nodiscard]] std::size_t index(int x, int y) const {
        return std::size_t(y - tile_.y0) * std::size_t(tile_.width()) + std::size_t(x - tile_.x0);
    }

    Rect tile_;
    std::vector<Parts> parts_;
};

/// How much of a sub-position a border covers that runs `inside` pixels beyond its middle:
/// a ramp as wide as the sub-position, so that sums over pixels do not depend on where it runs.
[[nodiscard]] inline float part_coverage(float inside) { return clamp01(inside * float(Ink::kSide) + 0.5f); }

/// `color` (premultiplied) under ink: darker, and opaque where it was background.
[[nodiscard]] inline Vec4f inked(Vec4f color, float darkness) {
    const float left = 1.0f - darkness;
    return {color.x * left, color.y * left, color.z * left, 1.0f - (1.0f - color.w) * left};
}

} // namespace porthole
