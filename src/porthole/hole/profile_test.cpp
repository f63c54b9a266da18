// The rim's profile and the smoothing of its maps.
#include "porthole/hole/profile.h"

#include <gtest/gtest.h>

#include <array>
#include <random>

#include "porthole/hole/blur.h"
#include "porthole/hole/test_pictures.h"

namespace porthole {
namespace {

using namespace porthole::testing;

// --- smooth_over ---

/// Weights of two passes of a square of 2 radius + 1.
double tent(int offset, int radius) { return std::max(0, 2 * radius + 1 - std::abs(offset)); }

TEST(SmoothOver, MeansAreWeightedByATent) {
    std::mt19937 random(1);
    for (int round = 0; round < 20; ++round) {
        const Rect w{-5, 8, -5 + 20 + pick(random, 20), 8 + 20 + pick(random, 10)};
        const Mask known = random_mask(w, kAllKinds[round % 5], random);
        Image<float> map(w);
        for (float& v : map.pixels()) v = 100 + 0.1f * float(pick(random, 1000));
        const Image<float> before = map;
        const int radius = 1 + pick(random, 7); // cells of one pixel
        smooth_over(map, known, w, radius, Fit::mean);
        // Near the edge the first pass misses what lies beyond the window.
        const Rect inner = w.grown(-2 * radius - 1);
        for (int y = inner.y0; y < inner.y1; ++y)
            for (int x = inner.x0; x < inner.x1; ++x) {
                double sum = 0, weights = 0;
                for (int dy = -2 * radius; dy <= 2 * radius; ++dy)
                    for (int dx = -2 * radius; dx <= 2 * radius; ++dx) {
                        if (!known(x + dx, y + dy)) continue;
                        const double weight = tent(dx, radius) * tent(dy, radius);
                        sum += weight * double(before(x + dx, y + dy)), weights += weight;
                    }
                if (weights > 0)
                    ASSERT_NEAR(map(x, y), sum / weights, 1e-3);
                else
                    ASSERT_EQ(map(x, y), kInfinity);
            }
    }
}

TEST(SmoothOver, APlaneStaysAsItIsAlsoAtTheEdgeOfWhatIsKnown) {
    const Rect w{0, 0, 160, 120};
    for (const int radius : {3, 9, 20}) {
        const Mask known = disc(w, 80, 60, 40);
        Image<float> map(w);
        for (int y = 0; y < 120; ++y)
            for (int x = 0; x < 160; ++x) map(x, y) = known(x, y) ? 50 + 0.2f * float(x) - 0.1f * float(y) : 1e9f;
        Image<float> mean = map;
        smooth_over(map, known, w, radius, Fit::plane);
        smooth_over(mean, known, w, radius, Fit::mean);
        double worst = 0, worst_mean = 0;
        for (int y = 0; y < 120; ++y)
            for (int x = 0; x < 160; ++x) {
                if (!known(x, y)) continue;
                const double plane = 50 + 0.2 * x - 0.1 * y;
                worst = std::max(worst, std::abs(map(x, y) - plane));
                worst_mean = std::max(worst_mean, std::abs(mean(x, y) - plane));
            }
        // Sloped by .22 a pixel: the fit is off by a fraction of a pixel, the mean by many.
        EXPECT_LT(worst, 0.015 * radius + 0.02) << "radius " << radius;
        EXPECT_GT(worst_mean, 8 * worst);
    }
}

TEST(SmoothOver, DependsOnNothingFarOff) {
    std::mt19937 random(5);
    const Rect full{0, 0, 260, 220}, inner{110, 100, 140, 120};
    for (const int radius : {2, 8, 17}) {
        const Mask known = random_mask(full, Kind::blobs, random);
        Image<float> map(full);
        for (float& v : map.pixels()) v = 0.37f * float(pick(random, 1000));
        for (const Fit fit : {Fit::mean, Fit::plane}) {
            Image<float> whole = map, part = crop(map, inner.grown(2 * radius + 16));
            smooth_over(whole, known, full, radius, fit);
            smooth_over(part, crop(known, part.window()), inner, radius, fit);
            ASSERT_EQ(crop(whole, inner), crop(part, inner)) << "radius " << radius;
        }
    }
}

// --- rim_distance and rim_levels ---

constexpr float kPixel = 0.01f, kFloor = 9;

View flat_view() {
    View view;
    view.orthographic = true;
    view.width = view.height = 200;
    view.half_height = 100 * kPixel;
    return view;
}

/// A disc-shaped target behind a sheet that covers the window, or a disc of it.
struct RimCase {
    IdBuffer targets;
    Hole hole;

    explicit RimCase(int depth_px, double sheet_radius = 1e9, Vec2f center = {100, 100}) {
        const Rect w{0, 0, 200, 200};
        targets = id_buffer(disc(w, double(center.x), double(center.y), 30), kFloor);
        const Mask sheet = disc(w, 100, 100, sheet_radius);
        hole = grow_hole(find_contours(targets.id), targets, mask_where(w, [](int, int) { return true; }), sheet,
                         {.depth_px = depth_px, .blur_px = 0});
        hole.distance = rim_distance(hole);
    }
    [[nodiscard]] Wall wall(float front, float next) const {
        return {Image<float>(hole.window, front), Image<float>(hole.window, next)};
    }
};

TEST(RimDistance, IsTheDistanceToTheRimOfADisc) {
    const RimCase c(40);
    for (int y = 0; y < 200; ++y)
        for (int x = 0; x < 200; ++x) {
            const double d = c.hole.distance(x, y), true_d = std::hypot(x - 100, y - 100) - 70;
            ASSERT_EQ(d <= 0, c.hole.mask(x, y) != 0);
            if (true_d < 3 && true_d > -45) {
                ASSERT_NEAR(d, true_d, 0.6) << x << ',' << y;
            }
        }
    // Even right into the middle: neighbours differ by no more than a pixel and some rounding.
    for (int y = 60; y < 140; ++y)
        for (int x = 60; x < 140; ++x) EXPECT_LE(std::abs(c.hole.distance(x, y) - c.hole.distance(x + 1, y)), 1.15f);
}

TEST(RimDistance, IsEvenWhereTheBandNarrows) {
    // Off the sheet's middle the band is clamped on one side and whole on the other.
    const RimCase c(30, 80, {75, 100});
    float narrowest = kInfinity;
    for (const BandPixel& b : c.hole.band) narrowest = std::min(narrowest, b.width_px);
    ASSERT_LT(narrowest, 12);
    Mask outside = c.hole.mask;
    for (std::uint8_t& m : outside.pixels()) m = !m;
    for (int y = 30; y < 170; ++y)
        for (int x = 20; x < 150; ++x) {
            if (!c.hole.mask(x, y)) continue;
            double nearest = 1e9;
            for (int v = 0; v < 200; ++v)
                for (int u = 0; u < 200; ++u)
                    if (outside(u, v)) nearest = std::min(nearest, std::hypot(u - x, v - y));
            if (nearest > 28) continue; // the smoothing rounds the ridge in the middle
            ASSERT_NEAR(-c.hole.distance(x, y), nearest - 0.5, 0.9) << x << ',' << y;
        }
}

TEST(RimLevels, ChamferIsAsWideAsTheWallIsThickAndSinksThroughIt) {
    const RimCase c(40);
    const View view = flat_view();
    // 10 px thick: 11 px wide, down to 1.1 thicknesses, then the floor.
    const float front = 5, thick = 10 * kPixel;
    const auto levels = rim_levels(c.hole, c.targets.id, view, std::array{c.wall(front, front + thick)},
                                   {.blur_px = 24, .least_px = 5});
    ASSERT_EQ(levels.size(), 1u);
    for (int y = 0; y < 200; ++y)
        for (int x = 0; x < 200; ++x) {
            const CutProfile& p = levels[0](x, y);
            const float inside = -c.hole.distance(x, y);
            if (!c.hole.mask(x, y)) {
                ASSERT_EQ(p.floor, -kInfinity);
                continue;
            }
            const double r = 70 - std::hypot(x - 100, y - 100);
            ASSERT_FLOAT_EQ(p.start, 0);
            if (r > 12) {
                ASSERT_EQ(p.depth(inside), kFloor);
            } else if (r > 1 && r < 10) {
                ASSERT_NEAR(p.depth(inside), front + 1.1 * thick * r / 11, 0.7 * kPixel);
                ASSERT_TRUE(p.on_chamfer(inside));
            }
        }
}

TEST(RimLevels, ChamfersKeepBetweenTheLeastAndMostTheirStepHasRoomFor) {
    const RimCase c(40);
    const View view = flat_view();
    const auto width_at_rim = [&](float thick, int walls, const RimParams& params) {
        std::vector<Wall> all(std::size_t(walls), c.wall(5, 5 + thick));
        return rim_levels(c.hole, c.targets.id, view, all, params).back()(100, 35).width;
    };
    const RimParams plain{.blur_px = 24, .least_px = 7};
    EXPECT_NEAR(width_at_rim(1 * kPixel, 1, plain), 7, 1e-3);   // thin
    EXPECT_NEAR(width_at_rim(500 * kPixel, 1, plain), 24, 0.3); // .6 of the band
    EXPECT_NEAR(width_at_rim(500 * kPixel, 4, plain), 6, 0.1);  // of a step of ten
    EXPECT_NEAR(width_at_rim(1 * kPixel, 4, plain), 5, 0.1);    // half a step
    EXPECT_EQ(width_at_rim(10 * kPixel, 1, {.blur_px = 24, .least_px = 7, .bevel_px = 0.0f}), 0);
    EXPECT_NEAR(width_at_rim(10 * kPixel, 1, {.blur_px = 24, .least_px = 7, .bevel_px = 17.0f}), 17, 1e-3);
    EXPECT_NEAR(width_at_rim(10 * kPixel, 1, {.blur_px = 24, .least_px = 7, .bevel_px = 170.0f}), 40, 1);
}

TEST(RimLevels, AnAngleLeansTheWallAllTheWay) {
    const RimCase c(40);
    const float degrees = 30, slope = kPixel / std::tan(degrees * kPi / 180);
    const auto levels = rim_levels(c.hole, c.targets.id, flat_view(), std::array{c.wall(5, 6)},
                                   {.blur_px = 24, .angle = degrees * kPi / 180});
    for (const int inside : {5, 15, 30, 38}) {
        const int y = 30 + inside;
        EXPECT_NEAR(levels[0](100, y).depth(-c.hole.distance(100, y)), 5 + slope * float(inside), kPixel * 1.2f);
    }
    EXPECT_EQ(levels[0](100, 71).depth(-c.hole.distance(100, 71)), kFloor);
}

TEST(RimLevels, StepsFollowOneAnotherAndTheCoreIsAlwaysCutToTheFloor) {
    for (const double sheet : {1e9, 90.0, 60.0}) { // whole band, clamped, clamped hard
        const RimCase c(40, sheet, {90, 100});
        const std::vector<Wall> walls{c.wall(4, 4.2f), c.wall(5, 5.2f), c.wall(6, 6.2f)};
        for (const RimParams& params :
             {RimParams{.blur_px = 24}, RimParams{.blur_px = 24, .bevel_px = 100.0f}, RimParams{.angle = 0.3f}}) {
            const auto levels = rim_levels(c.hole, c.targets.id, flat_view(), walls, params);
            ASSERT_EQ(levels.size(), 3u);
            for (int y = 0; y < 200; ++y)
                for (int x = 0; x < 200; ++x) {
                    if (!c.hole.mask(x, y)) continue;
                    const float inside = -c.hole.distance(x, y);
                    const float b = 3 * levels[1](x, y).start;
                    for (std::size_t k = 0; k < 3; ++k) {
                        const CutProfile& p = levels[k](x, y);
                        ASSERT_LE(p.depth(inside), kFloor);
                        ASSERT_NEAR(p.start, float(k) * b / 3, 1e-3);
                        if (c.targets.id(x, y) != kNoPart) {
                            ASSERT_EQ(p.depth(inside), kFloor) << x << ',' << y;
                        }
                        // The next step begins behind this one's chamfer.
                        ASSERT_LE(p.start + p.width, float(k + 1) * b / 3 + 1e-3f);
                    }
                }
        }
    }
}

} // namespace
} // namespace porthole
