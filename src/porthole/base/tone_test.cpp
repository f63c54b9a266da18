#include "porthole/base/tone.h"

#include <cmath>
#include <limits>

#include <gtest/gtest.h>

namespace porthole {
namespace {

double encode(double linear) {
    return linear <= 0.0031308 ? 12.92 * linear : 1.055 * std::pow(linear, 1 / 2.4) - 0.055;
}

Image<Vec4f> grey(const std::vector<float>& values, float alpha = 1) {
    Image<Vec4f> image(std::int32_t(values.size()), 1);
    for (std::size_t i = 0; i < values.size(); ++i)
        image.pixels()[i] = {values[i] * alpha, values[i] * alpha, values[i] * alpha, alpha};
    return image;
}

TEST(Tone, EveryCodeComesBack) {
    std::vector<float> values;
    for (int code = 0; code < 256; ++code) values.push_back(float(linear_from_srgb(code / 255.0)));
    const Image<Rgba8> out = to_srgb8(grey(values), {}, false);
    for (int code = 0; code < 256; ++code) EXPECT_EQ(int(out.pixels()[std::size_t(code)].g), code);

    values.clear();
    for (int code = 0; code < 65536; ++code) values.push_back(float(linear_from_srgb(code / 65535.0)));
    const std::vector<std::uint16_t> deep = to_srgb16(grey(values), {}, false);
    for (int code = 0; code < 65536; ++code) ASSERT_EQ(int(deep[std::size_t(code) * 3]), code);
}

TEST(Tone, RoundsToNearestEverywhere) {
    std::vector<float> values;
    for (float v = 1e-7f; v < 1.0f; v *= 1.00007f) values.push_back(v);
    const Image<Rgba8> out = to_srgb8(grey(values), {}, false);
    const std::vector<std::uint16_t> deep = to_srgb16(grey(values), {}, false);
    for (std::size_t i = 0; i < values.size(); ++i) {
        const double exact = encode(double(values[i]));
        ASSERT_LE(std::abs(int(out.pixels()[i].r) - exact * 255), 0.5001) << values[i];
        // The two branches of the standard meet with a gap of 3e-8 at 0.04045.
        ASSERT_LE(std::abs(deep[3 * i] - exact * 65535), 0.51) << values[i];
    }
}

TEST(Tone, ClampsWhatIsNoColour) {
    const float nan = std::numeric_limits<float>::quiet_NaN();
    const Image<Rgba8> out = to_srgb8(grey({nan, -1.0f, -0.0f, 1e-40f, 1.0f, 7.0f, kInfinity}), {}, false);
    const int expected[] = {0, 0, 0, 0, 255, 255, 255};
    for (std::size_t i = 0; i < 7; ++i) EXPECT_EQ(int(out.pixels()[i].r), expected[i]) << i;
}

TEST(Tone, AlphaIsStraightOrLaidOnTheBackground) {
    const Image<Vec4f> half = grey({0.5f}, 0.5f);
    const Rgba8 kept = to_srgb8(half, {1, 1, 1}, true).pixels()[0];
    EXPECT_EQ(kept, (Rgba8{188, 188, 188, 128}));
    // 0.25 of its own light and half of a white background.
    const Rgba8 laid = to_srgb8(half, {1, 1, 1}, false).pixels()[0];
    EXPECT_EQ(int(laid.r), int(std::lround(encode(0.75) * 255)));
    EXPECT_EQ(int(laid.a), 255);

    const Image<Vec4f> nothing(1, 1);
    EXPECT_EQ(to_srgb8(nothing, {1, 1, 1}, true).pixels()[0], (Rgba8{0, 0, 0, 0}));
    EXPECT_EQ(to_srgb8(nothing, {1, 0, 0}, false).pixels()[0], (Rgba8{255, 0, 0, 255}));
    EXPECT_EQ(to_srgb16(nothing, {0, 1, 0}, true), (std::vector<std::uint16_t>{0, 0, 0, 0}));
}

} // namespace
} // namespace porthole
