// What pixel centres see and what light reaches them, kept between the passes of a picture.
#pragma once

#include <cmath>
#include <cstdint>

#include "porthole/base/ids.h"
#include "porthole/render/occlusion.h"

namespace porthole {

/// A unit vector in 32 bits, within 1e-4 (octahedral map).
[[nodiscard]] inline std::uint32_t pack_normal(Vec3f n) {
    const float s = 1.0f / (std::abs(n.x) + std::abs(n.y) + std::abs(n.z));
    float x = n.x * s, y = n.y * s;
    if (n.z < 0) {
        const float fx = (1.0f - std::abs(y)) * (x < 0 ? -1.0f : 1.0f);
        y = (1.0f - std::abs(x)) * (y < 0 ? -1.0f : 1.0f);
        x = fx;
    }
    const auto quantised = [](float v) {
        return static_cast<std::uint32_t>(std::lround((v * 0.5f + 0.5f) * 65535.0f));
    };
    return quantised(x) | quantised(y) << 16;
}
[[nodiscard]] inline Vec3f unpack_normal(std::uint32_t packed) {
    float x = float(packed & 0xFFFFu) * (2.0f / 65535.0f) - 1.0f, y = float(packed >> 16) * (2.0f / 65535.0f) - 1.0f;
    const float z = 1.0f - std::abs(x) - std::abs(y);
    if (z < 0) {
        const float fx = (1.0f - std::abs(y)) * (x < 0 ? -1.0f : 1.0f);
        y = (1.0f - std::abs(x)) * (y < 0 ? -1.0f : 1.0f);
        x = fx;
    }
    const float inv = 1.0f / std::sqrt(x * x + y * y + z * z);
    return {x * inv, y * inv, z * inv};
}

/// One pixel's first sample. Part and depth are in the frame's ids.
struct Pixel {
    enum Flag : std::uint8_t {
        traced = 1,
        in_hole = 2,    ///< its sample obeys the cut
        on_target = 4,  ///< and sees an opened target
        may_open = 8,   ///< some sample of the pixel may be in the hole
        inferred = 32,  ///< taken from pixels around: with `traced` its light, without it all
        rim = 16,       ///< the rim may pass through the pixel: every sample is needed
        cap = 64,       ///< and sees the cut through solid material
        open_back = 128 ///< or the back of a cut part that has no caps
    };
    std::uint32_t triangle = 0;
    float u = 0, v = 0;
    std::uint32_t normal = 0;                        ///< smooth, packed
    std::uint16_t ambient_open = 0, ambient_all = 0; ///< of Occlusion::Ambient, 65535 / rays a unit
    std::uint8_t lamps[3] = {0, 0, 0};               ///< share of the lamps' light, one ray a lamp
    std::uint8_t flags = 0;

    [[nodiscard]] bool has(Flag f) const { return (flags & f) != 0; }
    /// Its own light, unfiltered.
    [[nodiscard]] Reach reach() const {
        constexpr float k = 1.0f / 255.0f;
        return {{float(lamps[0]) * k, float(lamps[1]) * k, float(lamps[2]) * k},
                ambient_all > 0 ? float(ambient_open) / float(ambient_all) : 1.0f};
    }
};

/// Light that reaches a pixel's first sample, after the filter. 65535 is all of it.
struct PixelLight {
    std::uint16_t lamps[3] = {0, 0, 0};
    std::uint16_t ambient = 0;

    PixelLight() = default;
    explicit PixelLight(const Reach& reach) {
        const auto packed = [](float v) { return static_cast<std::uint16_t>(std::lround(clamp01(v) * 65535.0f)); };
        for (int c = 0; c < 3; ++c) lamps[c] = packed(reach.lamps[c]);
        ambient = packed(reach.ambient);
    }
    [[nodiscard]] Reach reach() const {
        constexpr float k = 1.0f / 65535.0f;
        return {{float(lamps[0]) * k, float(lamps[1]) * k, float(lamps[2]) * k}, float(ambient) * k};
    }
};

struct GBuffer {
    SparseImage<Pixel> pixels;
    IdBuffer ids;
    SparseImage<PixelLight> light; ///< of pixels that are shaded

    explicit GBuffer(Rect window) : pixels(window), ids(window), light(window) {}
    [[nodiscard]] Rect window() const { return pixels.window(); }
    [[nodiscard]] Hit hit(int x, int y) const {
        const Pixel& p = pixels(x, y);
        return {ids.id(x, y), p.triangle, p.u, p.v, p.has(Pixel::cap)};
    }
    /// Pixels with the same key may share light: same part, same side of the rim, both of its
    /// surface or both of the cut through it.
    [[nodiscard]] std::uint32_t key(int x, int y) const {
        return key(ids.id(x, y), pixels(x, y).has(Pixel::in_hole), pixels(x, y).has(Pixel::cap));
    }
    [[nodiscard]] static std::uint32_t key(PartId part, bool in_hole, bool cap) {
        return part == kNoPart ? kNoKey : index(part) * 4 + (cap ? 2u : 0u) + (in_hole ? 1u : 0u);
    }
    static constexpr std::uint32_t kNoKey = 0xFFFFFFFFu;
};

} // namespace porthole
