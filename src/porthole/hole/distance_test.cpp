#include "porthole/hole/distance.h"

#include <gtest/gtest.h>

#include <opencv2/imgproc.hpp>

#include "porthole/hole/test_pictures.h"

namespace porthole {
namespace {

using namespace porthole::testing;

std::int64_t square(std::int64_t v) { return v * v; }

std::int64_t brute_force(const Mask& sites, std::int32_t px, std::int32_t py) {
    std::int64_t least = kFar;
    for (std::int32_t y = sites.window().y0; y < sites.window().y1; ++y)
        for (std::int32_t x = sites.window().x0; x < sites.window().x1; ++x)
            if (sites(x, y)) least = std::min(least, square(x - px) + square(y - py));
    return least;
}

TEST(DistanceTransform, EqualsBruteForce) {
    std::mt19937 random(1);
    for (int round = 0; round < 40; ++round) {
        const Rect window{-9, 4, -9 + 1 + pick(random, 40), 4 + 1 + pick(random, 30)};
        Mask sites = random_mask(window, kAllKinds[round % 5], random);
        // A few sites as well: most rows and columns are then without.
        if (round % 2)
            for (std::uint8_t& s : sites.pixels()) s = s && pick(random, 50) == 0;
        const Image<std::int64_t> found = distance_transform(sites);
        std::vector<Vec2i> queries;
        for (std::int32_t y = window.y0; y < window.y1; ++y)
            for (std::int32_t x = window.x0; x < window.x1; ++x) {
                ASSERT_EQ(found(x, y), brute_force(sites, x, y)) << x << ' ' << y << " round " << round;
                if (pick(random, 4) == 0) queries.push_back({x, y});
            }
        std::shuffle(queries.begin(), queries.end(), random);
        const std::vector<std::int64_t> some = squared_distances(sites, queries);
        for (std::size_t i = 0; i < queries.size(); ++i) ASSERT_EQ(some[i], found(queries[i].x, queries[i].y));
    }
}

TEST(DistanceTransform, AgreesWithOpenCv) {
    std::mt19937 random(2);
    for (int round = 0; round < 10; ++round) {
        const Mask sites = random_mask({0, 0, 320, 200}, round % 2 ? Kind::blobs : Kind::lines, random);
        cv::Mat background(200, 320, CV_8U), theirs;
        for (std::size_t i = 0; i < sites.pixels().size(); ++i) background.data[i] = !sites.pixels()[i];
        cv::distanceTransform(background, theirs, cv::DIST_L2, cv::DIST_MASK_PRECISE);
        const Image<std::int64_t> found = distance_transform(sites);
        for (std::int32_t y = 0; y < 200; ++y)
            for (std::int32_t x = 0; x < 320; ++x)
                ASSERT_NEAR(std::sqrt(double(found(x, y))), double(theirs.at<float>(y, x)), 1e-4);
    }
}

TEST(DistanceTransform, WithoutSitesEverythingIsFar) {
    const Image<std::int64_t> found = distance_transform(Mask(7, 5));
    for (const std::int64_t d2 : found.pixels()) EXPECT_EQ(d2, kFar);
    const Vec2i query{3, 3};
    EXPECT_EQ(squared_distances(Mask(7, 5), {&query, 1}), (std::vector<std::int64_t>{kFar}));
    EXPECT_TRUE(distance_transform(Mask()).empty());
}

TEST(SignedDistance, BorderRunsMidwayBetweenPixels) {
    const Image<float> d = signed_distance(disc({0, 0, 60, 60}, 30, 30, 20));
    EXPECT_FLOAT_EQ(d(30, 30), 0.5f - std::sqrt(401.0f)); // (20, 1) away is the nearest outside
    EXPECT_FLOAT_EQ(d(50, 30), -0.5f);
    EXPECT_FLOAT_EQ(d(51, 30), 0.5f);
    EXPECT_FLOAT_EQ(d(55, 30), 4.5f);
    EXPECT_EQ(signed_distance(Mask(2, 2, 1))(0, 0), -kNoBorder);
    EXPECT_EQ(signed_distance(Mask(2, 2, 0))(0, 0), kNoBorder);
}

/// The documented result at one pixel, by trying every site.
std::pair<std::int64_t, std::int32_t> brute_force(std::span<const PowerSite> sites, std::int64_t scale, Vec2i p) {
    std::int64_t least = kFar;
    std::int32_t nearest = -1;
    for (std::size_t i = 0; i < sites.size(); ++i) {
        const Vec2i c = sites[i].center;
        const std::int64_t value = scale * (square(p.x - c.x) + square(p.y - c.y)) - sites[i].weight;
        const Vec2i best = nearest < 0 ? c : sites[std::size_t(nearest)].center;
        if (value < least || (value == least && (c.x < best.x || (c.x == best.x && c.y < best.y)))) {
            least = value;
            nearest = std::int32_t(i);
        }
    }
    return {least, nearest};
}

TEST(PowerDistanceTransform, EqualsBruteForceWithItsTies) {
    std::mt19937 random(3);
    for (int round = 0; round < 60; ++round) {
        const Rect window{-20, 7, -20 + 1 + pick(random, 40), 7 + 1 + pick(random, 40)};
        // Small weights and a small grid make many ties; sites share pixels.
        std::vector<PowerSite> sites(std::size_t(pick(random, 60)));
        for (PowerSite& s : sites)
            s = {{window.x0 + pick(random, window.width()), window.y0 + pick(random, window.height())},
                 pick(random, round % 2 ? 5 : 3000) - 2};
        const std::int64_t scale = round % 3 ? 9 : 1;
        const std::int64_t limit = round % 4 ? kFar - 1 : pick(random, 400) - 100;
        const PowerDistance found = power_distance_transform(window, sites, scale, limit);
        for (std::int32_t y = window.y0; y < window.y1; ++y)
            for (std::int32_t x = window.x0; x < window.x1; ++x) {
                auto [value, nearest] = brute_force(sites, scale, {x, y});
                if (value > limit) value = kFar, nearest = -1;
                ASSERT_EQ(found.value(x, y), value) << x << ' ' << y << " round " << round;
                ASSERT_EQ(found.nearest(x, y), nearest) << x << ' ' << y << " round " << round;
            }
    }
}

TEST(PowerDistanceTransform, HeavyAndFarSitesStayExact) {
    // 16384 pixels across with the greatest weights that the hole uses.
    const Rect window{0, 0, 16384, 2};
    std::mt19937 random(4);
    std::vector<PowerSite> sites(200);
    for (PowerSite& s : sites)
        s = {{pick(random, 16384), pick(random, 2)}, std::int64_t(36) * 4096 * 4096 - pick(random, 100000)};
    const PowerDistance found = power_distance_transform(window, sites, 36);
    for (std::int32_t x = 0; x < 16384; x += 13)
        for (std::int32_t y = 0; y < 2; ++y) {
            const auto [value, nearest] = brute_force(sites, 36, {x, y});
            ASSERT_EQ(found.value(x, y), value);
            ASSERT_EQ(found.nearest(x, y), nearest);
        }
}

TEST(IntegerSqrt, IsTheFloor) {
    for (std::int64_t n = 0; n < 20000; ++n) {
        const std::int64_t r = integer_sqrt(n);
        ASSERT_TRUE(r * r <= n && n < (r + 1) * (r + 1)) << n;
    }
    for (std::int64_t r = 1; r < (1 << 26); r = r * 3 / 2 + 1) {
        EXPECT_EQ(integer_sqrt(r * r), r);
        EXPECT_EQ(integer_sqrt(r * r - 1), r - 1);
    }
}

} // namespace
} // namespace porthole
