// Cores and rims against slow constructions of the same.
#include "porthole/hole/shape.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "porthole/hole/masks.h"
#include "porthole/hole/test_pictures.h"

namespace porthole {
namespace {

using namespace porthole::testing;

/// 1 within `radius` of a pixel of `mask`, over `window`.
Mask dilated(const Mask& mask, Rect window, int radius) {
    const Rect w = mask.window();
    Mask out(window, 0);
    for (int y = w.y0; y < w.y1; ++y)
        for (int x = w.x0; x < w.x1; ++x) {
            if (!mask(x, y)) continue;
            for (int dy = -radius; dy <= radius; ++dy)
                for (int dx = -radius; dx <= radius; ++dx)
                    if (dx * dx + dy * dy <= radius * radius && window.contains(x + dx, y + dy))
                        out(x + dx, y + dy) = 1;
        }
    return out;
}

TEST(ClosedMask, EqualsDilationThenErosion) {
    std::mt19937 random(31);
    for (int round = 0; round < 60; ++round) {
        const Rect w{-3, 5, 30 + pick(random, 20), 35 + pick(random, 20)};
        const Mask mask = random_mask(w, round % 2 ? Kind::lines : Kind::blobs, random);
        const int radius = pick(random, 9);
        Mask outside = dilated(mask, w.grown(2 * radius + 1), radius);
        for (std::uint8_t& m : outside.pixels()) m = !m;
        const Mask open = dilated(outside, w, radius);
        Mask expected(w, 0);
        for (std::size_t i = 0; i < expected.pixels().size(); ++i)
            // An empty mask stays empty; all else is what the erosion leaves.
            expected.pixels()[i] = !open.pixels()[i] && !bounds_of(mask).empty();
        ASSERT_EQ(closed_mask(mask, radius), expected) << "radius " << radius;
    }
}

TEST(ClosedMask, CropWithTwiceTheRadiusEqualsTheFullPicture) {
    std::mt19937 random(32);
    for (int round = 0; round < 30; ++round) {
        const Rect whole{0, 0, 120, 100};
        const Mask mask = random_mask(whole, Kind::blobs, random);
        const int radius = 1 + pick(random, 9);
        const Rect picture{50, 40, 51 + pick(random, 20), 41 + pick(random, 20)};
        const Mask part = crop(mask, picture.grown(2 * radius));
        ASSERT_EQ(crop(closed_mask(part, radius), picture), crop(closed_mask(mask, radius), picture));
    }
}

std::int64_t turn(Vec2i a, Vec2i b, Vec2i c) {
    return std::int64_t(b.x - a.x) * (c.y - a.y) - std::int64_t(b.y - a.y) * (c.x - a.x);
}

/// Whether p is a convex combination of the points: on no line through two of them, or beside
/// their ends, do all of them lie on the other side.
bool in_hull(const std::vector<Vec2i>& points, Vec2i p) {
    const auto dot = [](Vec2i a, Vec2i b, Vec2i c) {
        return std::int64_t(b.x - a.x) * (c.x - a.x) + std::int64_t(b.y - a.y) * (c.y - a.y);
    };
    for (const Vec2i a : points)
        if (a.x == p.x && a.y == p.y) return true;
    // A line through p and a point that has all points on one side, none of them beyond p.
    for (const Vec2i a : points) {
        bool left = false, right = false, ahead = false, behind = false;
        for (const Vec2i b : points) {
            const std::int64_t side = turn(p, a, b);
            left |= side > 0, right |= side < 0;
            if (side == 0) (dot(p, a, b) > 0 ? ahead : behind) = true;
        }
        if (!(left && right) && ahead && !behind) return false;
    }
    return true;
}

TEST(HullMask, HoldsTheConvexCombinationsOfEachGroup) {
    std::mt19937 random(33);
    for (int round = 0; round < 40; ++round) {
        const Rect w{-4, -6, 24, 20};
        Mask mask(w, 0);
        // Some pixels far apart, or in a line; every tenth time one alone.
        const int n = round % 10 == 0 ? 1 : 2 + pick(random, 6);
        for (int i = 0; i < n; ++i)
            mask(w.x0 + pick(random, w.width()), round % 4 ? w.y0 + pick(random, w.height()) : 3) = 1;
        const Components one{Image<std::int32_t>(w, 0), 1};
        std::vector<Vec2i> points;
        for (int y = w.y0; y < w.y1; ++y)
            for (int x = w.x0; x < w.x1; ++x)
                if (mask(x, y)) points.push_back({x, y});
        const Mask hull = hull_mask(mask, one);
        const Rect box = bounds_of(mask);
        for (int y = w.y0; y < w.y1; ++y)
            for (int x = w.x0; x < w.x1; ++x)
                ASSERT_EQ(hull(x, y) != 0, in_hull(points, {x, y})) << x << ',' << y << " in round " << round;
        ASSERT_EQ(box_mask(mask, one), mask_where(w, [&](int x, int y) { return box.contains(x, y); }));
    }
}

TEST(HullMask, GroupsStayApart) {
    const Mask mask = mask_from_text({"##.......#", "#.......##", "..........", "##........"});
    const Components groups = connected_components(mask);
    EXPECT_EQ(groups.count, 3);
    EXPECT_EQ(hull_mask(mask, groups), mask);
    EXPECT_EQ(box_mask(mask, groups), mask_from_text({"##......##", "##......##", "..........", "##........"}));
}

TEST(FillCore, TakesTheNearestTargetPixel) {
    std::mt19937 random(34);
    for (int round = 0; round < 20; ++round) {
        const Rect w{0, 0, 40, 30};
        IdBuffer targets(w);
        const Mask mask = random_mask(w, Kind::blobs, random);
        if (bounds_of(mask).empty()) continue;
        for (std::size_t i = 0; i < mask.pixels().size(); ++i)
            if (mask.pixels()[i]) {
                targets.id.pixels()[i] = PartId(std::uint32_t(pick(random, 4)));
                targets.depth.pixels()[i] = float(i);
            }
        const Mask core = closed_mask(mask, 6);
        const IdBuffer filled = fill_core(targets, core);
        for (int y = w.y0; y < w.y1; ++y)
            for (int x = w.x0; x < w.x1; ++x) {
                Vec2i nearest{x, y};
                int best = 1 << 30;
                for (int nx = w.x0; nx < w.x1 && core(x, y) && !mask(x, y); ++nx) // columns first: the leftmost
                    for (int ny = w.y0; ny < w.y1; ++ny) {
                        const int d2 = (nx - x) * (nx - x) + (ny - y) * (ny - y);
                        if (mask(nx, ny) && d2 < best) best = d2, nearest = {nx, ny};
                    }
                ASSERT_EQ(filled.id(x, y), targets.id(nearest.x, nearest.y)) << x << ',' << y;
                ASSERT_EQ(filled.depth(x, y), targets.depth(nearest.x, nearest.y));
            }
    }
}

} // namespace
} // namespace porthole
