#include "porthole/hole/contour.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <opencv2/imgproc.hpp>
#include <random>
#include <tuple>

#include "porthole/hole/test_pictures.h"

namespace porthole {
namespace {

using namespace porthole::testing;
using Chain = std::vector<std::pair<int, int>>;

bool before(Vec2i a, Vec2i b) { return std::tie(a.y, a.x) < std::tie(b.y, b.x); }

/// Target pixels with a 4-neighbour, inside the window, outside all targets.
std::vector<Vec2i> expected_pixels(const Mask& mask) {
    std::vector<Vec2i> pixels;
    const Rect w = mask.window();
    for (std::int32_t y = w.y0; y < w.y1; ++y)
        for (std::int32_t x = w.x0; x < w.x1; ++x)
            if (mask(x, y) && !(mask.at_or(x - 1, y, 1) && mask.at_or(x + 1, y, 1) && mask.at_or(x, y - 1, 1) &&
                                mask.at_or(x, y + 1, 1)))
                pixels.push_back({x, y});
    return pixels;
}

bool adjacent(Vec2i a, Vec2i b) { return a != b && std::abs(a.x - b.x) <= 1 && std::abs(a.y - b.y) <= 1; }

/// Twice the area that a chain encloses; positive counter-clockwise as seen on the picture.
std::int64_t area2(const std::vector<Vec2i>& chain) {
    std::int64_t sum = 0;
    for (std::size_t i = 0; i < chain.size(); ++i) {
        const Vec2i a = chain[i], b = chain[(i + 1) % chain.size()];
        sum += std::int64_t(b.x) * a.y - std::int64_t(a.x) * b.y;
    }
    return sum;
}

/// A closed chain whatever pixel it starts at.
Chain cyclic(Chain chain) {
    Chain least = chain;
    for (std::size_t i = 1; i < chain.size(); ++i) {
        std::rotate(chain.begin(), chain.begin() + 1, chain.end());
        least = std::min(least, chain);
    }
    return least;
}

TEST(FindContours, SquareIsFollowedOnceAround) {
    const auto contours = find_contours(ids_from_text({".....", //
                                                       ".AAA.", //
                                                       ".AAA.", //
                                                       ".AAA.", //
                                                       "....."}));
    ASSERT_EQ(contours.size(), 1u);
    EXPECT_TRUE(contours[0].outer);
    EXPECT_TRUE(contours[0].closed);
    const std::vector<Vec2i> around = {{1, 1}, {1, 2}, {1, 3}, {2, 3}, {3, 3}, {3, 2}, {3, 1}, {2, 1}};
    EXPECT_EQ(contours[0].pixels, around);
}

TEST(FindContours, RingHasAnOuterAndAnInnerBorder) {
    const auto contours = find_contours(ids_from_text({".......", //
                                                       ".AAAAA.", //
                                                       ".A...A.", //
                                                       ".A.B.A.", //
                                                       ".A...A.", //
                                                       ".AAAAA.", //
                                                       "......."}));
    ASSERT_EQ(contours.size(), 3u);
    EXPECT_TRUE(contours[0].outer);
    EXPECT_EQ(contours[0].pixels.size(), 16u);
    EXPECT_FALSE(contours[1].outer);
    EXPECT_TRUE(contours[1].closed);
    EXPECT_EQ(contours[1].pixels.front(), (Vec2i{1, 2})); // left of the region's first pixel
    // An inner border cuts the corners: they touch the region with a corner only.
    EXPECT_EQ(contours[1].pixels.size(), 12u);
    EXPECT_TRUE(contours[2].outer);
    EXPECT_EQ(contours[2].pixels, (std::vector<Vec2i>{{3, 3}}));
}

TEST(FindContours, TargetsTouchingEachOtherShareOneContour) {
    const auto contours = find_contours(ids_from_text({"....", //
                                                       ".AB.", //
                                                       "...C", //
                                                       "...."}));
    ASSERT_EQ(contours.size(), 1u);
    EXPECT_EQ(contour_pixels(contours), (std::vector<Vec2i>{{1, 1}, {2, 1}, {3, 2}}));
}

TEST(FindContours, EdgeOfTheWindowIsNoContour) {
    EXPECT_TRUE(find_contours(ids_from_text({"AAA", "AAA"})).empty());
    EXPECT_TRUE(find_contours(ids_from_text({"...", "..."})).empty());
    EXPECT_TRUE(find_contours(Image<PartId>()).empty());

    const auto contours = find_contours(ids_from_text({"AA...", //
                                                       "AA..B", //
                                                       "AA...", //
                                                       "A.A.."},
                                                      -7, 20));
    // The background reaches the edge, so its border is cut into what the parts show of it.
    ASSERT_EQ(contours.size(), 3u);
    for (const Contour& c : contours) {
        EXPECT_FALSE(c.closed);
        EXPECT_TRUE(c.outer);
    }
    const std::vector<Vec2i> pixels = {{-6, 20}, {-6, 21}, {-3, 21}, {-6, 22}, {-7, 23}, {-5, 23}};
    EXPECT_EQ(contour_pixels(contours), pixels);
}

TEST(FindContours, PixelsAreExactlyThoseBesideTheOutside) {
    std::mt19937 random(1);
    for (int round = 0; round < 200; ++round) {
        const Rect window{-5, 3, -5 + 1 + pick(random, 70), 3 + 1 + pick(random, 50)};
        const Mask mask = random_mask(window, kAllKinds[round % 5], random);
        const auto contours = find_contours(ids_of(mask));
        ASSERT_EQ(contour_pixels(contours), expected_pixels(mask)) << "round " << round;
        for (const Contour& c : contours) {
            ASSERT_FALSE(c.pixels.empty());
            for (std::size_t i = 1; i < c.pixels.size(); ++i) ASSERT_TRUE(adjacent(c.pixels[i - 1], c.pixels[i]));
            if (!c.closed || c.pixels.size() == 1) continue;
            ASSERT_TRUE(adjacent(c.pixels.back(), c.pixels.front()));
            // Outer borders run counter-clockwise, inner ones clockwise.
            if (c.outer) {
                ASSERT_GE(area2(c.pixels), 0);
            } else {
                ASSERT_LT(area2(c.pixels), 0);
            }
        }
    }
}

TEST(FindContours, AgreesWithOpenCv) {
    std::mt19937 random(2);
    for (int round = 0; round < 200; ++round) {
        const Mask mask = with_background_frame(
            random_mask({0, 0, 3 + pick(random, 90), 3 + pick(random, 60)}, kAllKinds[round % 5], random));
        cv::Mat picture(mask.height(), mask.width(), CV_8U);
        std::copy(mask.pixels().begin(), mask.pixels().end(), picture.data);
        std::vector<std::vector<cv::Point>> theirs;
        std::vector<cv::Vec4i> hierarchy;
        cv::findContours(picture, theirs, hierarchy, cv::RETR_CCOMP, cv::CHAIN_APPROX_NONE);

        std::vector<std::pair<bool, Chain>> expected, found;
        for (std::size_t i = 0; i < theirs.size(); ++i) {
            Chain chain;
            for (const cv::Point p : theirs[i]) chain.emplace_back(p.x, p.y);
            expected.emplace_back(hierarchy[i][3] < 0, cyclic(chain));
        }
        for (const Contour& c : find_contours(ids_of(mask))) {
            EXPECT_TRUE(c.closed);
            Chain chain;
            for (const Vec2i p : c.pixels) chain.emplace_back(p.x, p.y);
            found.emplace_back(c.outer, cyclic(chain));
        }
        std::sort(expected.begin(), expected.end());
        std::sort(found.begin(), found.end());
        ASSERT_EQ(found, expected) << "round " << round;
    }
}

TEST(FindContours, BitsAreFollowedLikeIds) {
    std::mt19937 random(11);
    for (const Rect window : {Rect{-13, -5, 190, 77}, Rect{0, 0, 64, 64}, Rect{3, 2, 4, 9}, Rect{-8, 0, 120, 40}})
        for (const unsigned share : {2u, 9u, 40u}) {
            // Rectangles, and around the window pixels that must not matter.
            Bits bits({window.x0 & ~7, window.y0, window.x1, window.y1});
            Image<PartId> ids(window, kNoPart);
            for (int y = window.y0; y < window.y1; ++y)
                for (int x = bits.window().x0; x < window.x1; ++x)
                    if (x < window.x0 || random() % share == 0) {
                        bits.set(x, x + 1, y);
                        if (x >= window.x0) ids(x, y) = PartId{1};
                    }
            bits.set(Rect{window.x0, window.y0, (window.x0 + window.x1) / 2, (window.y0 + window.y1) / 2});
            for (int y = window.y0; y < (window.y0 + window.y1) / 2; ++y)
                for (int x = window.x0; x < (window.x0 + window.x1) / 2; ++x) ids(x, y) = PartId{2};
            const std::vector<Contour> a = find_contours(ids), b = find_contours(bits, window);
            ASSERT_EQ(a.size(), b.size());
            for (std::size_t i = 0; i < a.size(); ++i) {
                EXPECT_EQ(a[i].pixels, b[i].pixels);
                EXPECT_EQ(a[i].outer, b[i].outer);
                EXPECT_EQ(a[i].closed, b[i].closed);
            }
        }
}

TEST(Bits, WholeRectanglesAreFoundWhole) {
    Bits bits({-16, -2, 301, 5});
    const Rect set{-11, -1, 205, 4};
    bits.set(set);
    for (int x0 = -16; x0 < 301; x0 += 3)
        for (int x1 = x0 + 1; x1 <= 301; x1 += 7)
            EXPECT_EQ(bits.all({x0, 0, x1, 3}), x0 >= set.x0 && x1 <= set.x1) << x0 << ' ' << x1;
    EXPECT_FALSE(bits.all({0, -2, 3, 1}));
    for (int y = -2; y < 5; ++y)
        for (int x = -16; x < 301; ++x) ASSERT_EQ(bits(x, y), set.contains(x, y));
}

TEST(FindContours, ChainsComeInScanOrderOfTheirFirstPixel) {
    std::mt19937 random(3);
    for (int round = 0; round < 50; ++round) {
        const Mask mask = with_background_frame(random_mask({0, 0, 60, 40}, kAllKinds[round % 5], random));
        const auto contours = find_contours(ids_of(mask));
        for (std::size_t i = 1; i < contours.size(); ++i)
            ASSERT_FALSE(before(contours[i].pixels[0], contours[i - 1].pixels[0]));
    }
}

} // namespace
} // namespace porthole
