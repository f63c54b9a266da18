#include "porthole/base/tone.h"

#include <algorithm>
#include <bit>
#include <cmath>

namespace porthole {

double linear_from_srgb(double encoded) {
    return encoded <= 0.04045 ? encoded / 12.92 : std::pow((encoded + 0.055) / 1.055, 2.4);
}

namespace {

/// Rounds to codes 0..Max by comparing with the linear values at which the code changes, so
/// that every code is exact. Buckets over the float's leading bits say where to start.
template <int Max, int MantissaBits> class Encoder {
public:
    Encoder() : thresholds_(std::size_t(Max) + 1, 2.0f) {
        for (int code = 0; code < Max; ++code) {
            // The code changes at the first float that is not below the exact border.
            const double border = linear_from_srgb((code + 0.5) / Max);
            float f = float(border);
            if (double(f) < border) f = std::nextafter(f, 2.0f);
            thresholds_[std::size_t(code)] = f;
        }
        const std::size_t buckets = bucket_of(1.0f) + 1;
        first_code_.resize(buckets);
        std::size_t code = 0;
        for (std::size_t b = 0; b < buckets; ++b) {
            const float start = std::bit_cast<float>(std::uint32_t((b << kShift) + std::bit_cast<std::uint32_t>(kLow)));
            if (b > 0)
                while (thresholds_[code] <= start) ++code;
            first_code_[b] = std::uint16_t(code);
        }
    }

    /// Any float: NaN and negative values give 0, values above 1 give Max.
    [[nodiscard]] std::uint16_t operator()(float linear) const {
        const float v = linear > kLow ? (linear < 1.0f ? linear : 1.0f) : kLow; // NaN is not above kLow
        std::size_t code = first_code_[bucket_of(v)];
        if constexpr (kOneStep) return std::uint16_t(code + (thresholds_[code] <= v));
        while (thresholds_[code] <= v) ++code;
        return std::uint16_t(code);
    }

private:
    static constexpr unsigned kShift = 23 - MantissaBits;
    static constexpr bool kOneStep = Max <= 255;                   ///< buckets so fine that none holds two thresholds
    static constexpr float kLow = Max > 255 ? 0x1p-21f : 0x1p-13f; ///< below the first threshold

    [[nodiscard]] static std::size_t bucket_of(float v) {
        return (std::bit_cast<std::uint32_t>(v) - std::bit_cast<std::uint32_t>(kLow)) >> kShift;
    }

    std::vector<float> thresholds_; ///< [c]: least linear value whose code is above c; 2 after the last
    std::vector<std::uint16_t> first_code_;
};

template <int Max> std::uint16_t linear_code(float v) {
    return !(v > 0.0f) ? std::uint16_t(0) : v >= 1.0f ? std::uint16_t(Max) : std::uint16_t(v * float(Max) + 0.5f);
}

Vec3f straight(Vec4f c) {
    // Premultiplied colours of nearly nothing carry no information worth amplifying.
    const float inv = c.w > 1e-6f ? 1.0f / c.w : 0.0f;
    return {c.x * inv, c.y * inv, c.z * inv};
}

Vec3f over(Vec4f c, Vec3f background) {
    const float rest = c.w < 1.0f ? 1.0f - c.w : 0.0f;
    return {c.x + background.x * rest, c.y + background.y * rest, c.z + background.z * rest};
}

/// Calls body(i) for the index of every pixel, in runs of many.
template <typename Body> void for_each_pixel(const Image<Vec4f>& image, const Control& control, const Body& body) {
    constexpr std::size_t kRun = std::size_t(1) << 17;
    const std::size_t n = image.pixels().size();
    parallel_for((n + kRun - 1) / kRun, control, [&](std::size_t run) {
        const std::size_t end = std::min(n, (run + 1) * kRun);
        for (std::size_t i = run * kRun; i < end; ++i) body(i);
    });
}

} // namespace

Image<Rgba8> to_srgb8(const Image<Vec4f>& linear, Vec3f background, bool keep_alpha, const Control& control) {
    static const Encoder<255, 7> encode;
    Image<Rgba8> out(linear.window());
    for_each_pixel(linear, control, [&](std::size_t i) {
        const Vec4f c = linear.pixels()[i];
        const Vec3f v = keep_alpha ? straight(c) : over(c, background);
        out.pixels()[i] = {std::uint8_t(encode(v.x)), std::uint8_t(encode(v.y)), std::uint8_t(encode(v.z)),
                           keep_alpha ? std::uint8_t(linear_code<255>(c.w)) : std::uint8_t(255)};
    });
    return out;
}

std::vector<std::uint16_t> to_srgb16(const Image<Vec4f>& linear, Vec3f background, bool keep_alpha,
                                     const Control& control) {
    static const Encoder<65535, 12> encode;
    const std::size_t channels = keep_alpha ? 4 : 3;
    std::vector<std::uint16_t> out(linear.pixels().size() * channels);
    for_each_pixel(linear, control, [&](std::size_t i) {
        const Vec4f c = linear.pixels()[i];
        const Vec3f v = keep_alpha ? straight(c) : over(c, background);
        std::uint16_t* const p = out.data() + i * channels;
        p[0] = encode(v.x), p[1] = encode(v.y), p[2] = encode(v.z);
        if (keep_alpha) p[3] = linear_code<65535>(c.w);
    });
    return out;
}

} // namespace porthole
