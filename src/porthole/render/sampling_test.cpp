#include "porthole/render/sampling.h"

#include <gtest/gtest.h>

#include <cmath>
#include <set>
#include <utility>

namespace porthole {
namespace {

TEST(CellRank, CountsEveryPixelOfACellOnceWhateverItsPlace) {
    for (const int ox : {0, 4, -8})
        for (const int oy : {0, 12, -4}) {
            std::set<int> seen;
            for (int y = 0; y < 4; ++y)
                for (int x = 0; x < 4; ++x) {
                    const int r = cell_rank(ox + x, oy + y);
                    EXPECT_EQ(r, cell_rank(x, y));
                    EXPECT_GE(r, 0);
                    EXPECT_LT(r, 16);
                    seen.insert(r);
                }
            EXPECT_EQ(seen.size(), 16u);
        }
}

TEST(PixelSample, StartsAtTheCentreAndSpreads) {
    EXPECT_EQ(pixel_sample(0), (Vec2f{0.5f, 0.5f}));
    // Any 8 first samples: every eighth of the pixel, in x and in y, gets one or two.
    for (const bool vertical : {false, true}) {
        int count[8] = {};
        for (int i = 0; i < 8; ++i) {
            const Vec2f s = pixel_sample(i);
            ASSERT_GE(s.x, 0.0f);
            ASSERT_LT(s.x, 1.0f);
            ASSERT_GE(s.y, 0.0f);
            ASSERT_LT(s.y, 1.0f);
            ++count[int((vertical ? s.y : s.x) * 8)];
        }
        for (const int c : count) EXPECT_LE(c, 2);
    }
    double mx = 0, my = 0;
    for (int i = 0; i < 64; ++i) mx += double(pixel_sample(i).x), my += double(pixel_sample(i).y);
    EXPECT_NEAR(mx / 64, 0.5, 0.02);
    EXPECT_NEAR(my / 64, 0.5, 0.02);
}

TEST(PixelSample, MeasuresWhatEdgesCoverAsWellAsItSays) {
    // The share of a unit square on one side of a line at `offset` from its middle.
    const auto covered = [](double c, double s, double offset) {
        const double a = std::max(std::abs(c), std::abs(s)), b = std::min(std::abs(c), std::abs(s));
        const double t = offset + 0.5 * (a + b);
        const auto square = [](double v) { return v > 0 ? v * v : 0.0; };
        return (square(t) - square(t - a) - square(t - b) + square(t - a - b)) / (2 * a * b);
    };
    const std::pair<int, double> expected[] = {{4, 0.10},   {8, 0.06},   {16, 0.034},
                                               {32, 0.020}, {64, 0.012}, {256, 0.008}};
    for (const auto& [n, most] : expected) {
        double sum = 0;
        int edges = 0;
        for (int i = 0; i < 90; ++i) {
            const double angle = 2 * 3.14159265358979 * (i + 0.37) / 90, c = std::cos(angle), s = std::sin(angle);
            for (int k = 0; k < 40; ++k, ++edges) {
                const double offset = ((k + 0.5) / 40 - 0.5) * (std::abs(c) + std::abs(s));
                int inside = 0;
                for (int j = 0; j < n; ++j) {
                    const Vec2f p = pixel_sample(j);
                    inside += (double(p.x) - 0.5) * c + (double(p.y) - 0.5) * s < offset;
                }
                const double error = double(inside) / n - covered(c, s, offset);
                sum += error * error;
            }
        }
        EXPECT_LT(std::sqrt(sum / edges), most) << n;
    }
}

TEST(DiscPoint, FillsTheDiscEvenly) {
    int inner = 0;
    Vec2f mean{0, 0};
    for (int i = 0; i < 16; ++i) {
        const Vec2f p = disc_point(i, 16);
        EXPECT_LE(dot(p, p), 1.0f);
        inner += dot(p, p) < 0.5f;
        mean = mean + p;
    }
    EXPECT_EQ(inner, 8); // half of the area
    EXPECT_LT(std::hypot(mean.x, mean.y) / 16, 0.1f);
}

TEST(AmbientPattern, IsEvenForEveryNormalAndForEachPixel) {
    for (const int per_pixel : {1, 2, 4, 8}) {
        const auto rays = ambient_pattern(per_pixel);
        ASSERT_EQ(rays.size(), std::size_t(16 * per_pixel));
        for (const AmbientRay& r : rays) {
            EXPECT_NEAR(length(r.axis), 1.0f, 1e-5f);
            EXPECT_GT(r.reach, 0.0f);
            EXPECT_LE(r.reach, 1.0f);
        }
        // The mean cosine over a hemisphere is one half, whatever the normal.
        for (int k = 0; k < 50; ++k) {
            const float z = -1 + 2 * (float(k) + 0.5f) / 50, phi = float(k) * 2.4f, s = std::sqrt(1 - z * z);
            const Vec3f n{s * std::cos(phi), z, s * std::sin(phi)};
            float sum = 0;
            for (const AmbientRay& r : rays) sum += std::abs(dot(n, r.axis));
            EXPECT_NEAR(sum / float(rays.size()), 0.5f, per_pixel == 1 ? 0.05f : 0.02f);
        }
    }
    EXPECT_TRUE(ambient_pattern(0).empty());
}

} // namespace
} // namespace porthole
