#include "porthole/hole/hole.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <deque>
#include <set>

#include "porthole/base/error.h"
#include "porthole/hole/distance.h"
#include "porthole/hole/test_pictures.h"

namespace porthole {
namespace {

using namespace porthole::testing;

std::int64_t distance2(Vec2i a, Vec2i b) {
    const std::int64_t dx = a.x - b.x, dy = a.y - b.y;
    return dx * dx + dy * dy;
}

/// A hole with everything it was made from.
struct Case {
    IdBuffer targets;
    Mask covered, enclosing;
    HoleParams params{.depth_px = 10, .blur_px = 0};

    [[nodiscard]] Hole grow() const {
        return grow_hole(find_contours(targets.id), targets, covered, enclosing, params);
    }
};

/// Blobs of random parts, depths, cover and enclosing object.
Case random_case(Rect window, std::mt19937& random) {
    Case c{IdBuffer(window),
           random_mask(window, Kind::blobs, random),
           fill_enclosed(random_mask(window, Kind::blobs, random)),
           {}};
    for (std::uint8_t& e : c.enclosing.pixels()) e = !e; // mostly inside, with bays and edges
    for (std::uint32_t part = 0; part < 3; ++part) {
        const Mask mask = random_mask(window, part == 2 ? Kind::lines : Kind::blobs, random);
        for (std::size_t i = 0; i < mask.pixels().size(); ++i)
            if (mask.pixels()[i]) {
                c.targets.id.pixels()[i] = PartId{part};
                c.targets.depth.pixels()[i] = 1.0f + 0.37f * float(pick(random, 9));
            }
    }
    for (std::size_t i = 0; i < c.covered.pixels().size(); ++i)
        if (c.targets.id.pixels()[i] == kNoPart) c.covered.pixels()[i] = 0;
    c.params = {.depth_px = 1 + pick(random, 12), .blur_px = 0};
    return c;
}

/// 9 |p-c|^2 - min(9 depth^2, D^2(c)): the disc of contour pixel c covers p where this is not
/// positive. kFar for pixels that grow no band.
std::int64_t disc_power(const Case& c, const Image<std::int64_t>& to_outside, const BandPixel& b, Vec2i p) {
    const std::int64_t depth2 = 9 * std::int64_t(c.params.depth_px) * c.params.depth_px;
    return b.covered ? 9 * distance2(p, b.pixel) - std::min(depth2, to_outside(b.pixel.x, b.pixel.y)) : kFar;
}

Image<std::int64_t> distance_to_outside(const Mask& enclosing) {
    Mask outside = enclosing;
    for (std::uint8_t& m : outside.pixels()) m = !m;
    return distance_transform(outside);
}

TEST(FillEnclosed, FillsVentsButNotBays) {
    const Mask hit = mask_from_text({"........", //
                                     ".#####..", //
                                     ".#...#..", //
                                     ".#.#.#..", //
                                     ".#...##.", //
                                     ".####..#", //
                                     "......#.", //
                                     "..#.#..."});
    const Mask filled = mask_from_text({"........", //
                                        ".#####..", //
                                        ".#####..", //
                                        ".#####..", //
                                        ".######.", //
                                        ".####..#", // beside: open below and to the left
                                        "......#.", //
                                        "..#.#..."});
    EXPECT_EQ(fill_enclosed(hit), filled);
}

TEST(FillEnclosed, EqualsAFloodFromTheEdge) {
    std::mt19937 random(1);
    for (int round = 0; round < 100; ++round) {
        const Rect w{3, -2, 3 + 1 + pick(random, 60), -2 + 1 + pick(random, 40)};
        Mask hit = random_mask(w, kAllKinds[round % 5], random);
        for (std::uint8_t& h : hit.pixels()) h = std::uint8_t(h * (1 + pick(random, 255))); // any nonzero counts
        Mask expected(w, 1);
        std::deque<Vec2i> open;
        const auto visit = [&](std::int32_t x, std::int32_t y) {
            if (!w.contains(x, y) || hit(x, y) || !expected(x, y)) return;
            expected(x, y) = 0;
            open.push_back({x, y});
        };
        for (std::int32_t y = w.y0; y < w.y1; ++y)
            for (std::int32_t x = w.x0; x < w.x1; ++x)
                if (!w.grown(-1).contains(x, y)) visit(x, y);
        while (!open.empty()) {
            const Vec2i p = open.front();
            open.pop_front();
            visit(p.x + 1, p.y), visit(p.x - 1, p.y), visit(p.x, p.y + 1), visit(p.x, p.y - 1);
        }
        ASSERT_EQ(fill_enclosed(hit), expected) << "round " << round;
    }
}

TEST(FillEnclosed, OfACropFollowsWhatLeavesIt) {
    std::mt19937 random(5);
    std::int64_t asked = 0, beyond = 0;
    for (int round = 0; round < 600; ++round) {
        const Rect whole{-5, 3, -5 + 4 + pick(random, 60), 3 + 4 + pick(random, 40)};
        const Mask hit = random_mask(whole, kAllKinds[round % 5], random);
        const int x0 = whole.x0 + pick(random, whole.width()), y0 = whole.y0 + pick(random, whole.height());
        const Rect crop{x0, y0, x0 + 1 + pick(random, whole.x1 - x0), y0 + 1 + pick(random, whole.y1 - y0)};
        const auto cropped = [&](const Mask& mask) {
            return mask_where(crop, [&](int x, int y) { return mask(x, y) != 0; });
        };
        const auto hit_beyond = [&](Vec2i p) {
            EXPECT_TRUE(whole.contains(p.x, p.y) && !crop.contains(p.x, p.y));
            ++asked;
            return hit(p.x, p.y) != 0;
        };
        ASSERT_EQ(fill_enclosed(cropped(hit), whole, hit_beyond), cropped(fill_enclosed(hit))) << "round " << round;
        beyond += std::int64_t(whole.width()) * whole.height() - std::int64_t(crop.width()) * crop.height();
    }
    EXPECT_LT(asked, beyond / 2);
}

TEST(GrowHole, IsTheTargetsAndTheDiscsExactly) {
    std::mt19937 random(2);
    for (int round = 0; round < 60; ++round) {
        const Rect w{-4, 2, -4 + 20 + pick(random, 50), 2 + 20 + pick(random, 40)};
        const Case c = random_case(w, random);
        const Hole hole = c.grow();
        const Image<std::int64_t> to_outside = distance_to_outside(c.enclosing);
        ASSERT_EQ(hole.window, w);
        Rect bounds;
        for (std::int32_t y = w.y0; y < w.y1; ++y)
            for (std::int32_t x = w.x0; x < w.x1; ++x) {
                const bool target = c.targets.id(x, y) != kNoPart;
                // The disc that owns the pixel; several may tie.
                std::int64_t least = kFar;
                std::set<float> owners;
                for (const BandPixel& b : hole.band) {
                    const std::int64_t power = disc_power(c, to_outside, b, {x, y});
                    if (power > least) continue;
                    if (power < least) owners.clear();
                    least = power;
                    owners.insert(c.targets.depth(b.pixel.x, b.pixel.y));
                }
                const bool inside = target || least <= 0;
                ASSERT_EQ(hole.mask(x, y), inside) << x << ' ' << y << " round " << round;
                // The floor is the targets' own depth, then the owner's, and nowhere else.
                const float floor = hole.floor_depth(x, y);
                if (target) {
                    ASSERT_EQ(floor, c.targets.depth(x, y));
                } else if (inside) {
                    ASSERT_TRUE(owners.contains(floor)) << x << ' ' << y << " round " << round;
                } else {
                    ASSERT_EQ(floor, kInfinity);
                }
                ASSERT_EQ(hole.distance(x, y) <= 0, inside) << x << ' ' << y << " round " << round;
                ASSERT_LE(hole.distance(x, y), kRimReach);
                // Inside E, or a target's own pixel.
                if (!target && inside) {
                    ASSERT_TRUE(c.enclosing(x, y));
                }
                if (inside)
                    bounds = bounds.empty() ? Rect{x, y, x + 1, y + 1}
                                            : Rect{std::min(bounds.x0, x), std::min(bounds.y0, y),
                                                   std::max(bounds.x1, x + 1), std::max(bounds.y1, y + 1)};
            }
        ASSERT_EQ(hole.bounds, bounds);
        ASSERT_EQ(hole.empty(), bounds.empty());
    }
}

TEST(GrowHole, BandTellsTheContourPixels) {
    std::mt19937 random(3);
    for (int round = 0; round < 30; ++round) {
        const Case c = random_case({0, 0, 60, 50}, random);
        const Hole hole = c.grow();
        const std::vector<Vec2i> pixels = contour_pixels(find_contours(c.targets.id));
        const Image<std::int64_t> to_outside = distance_to_outside(c.enclosing);
        ASSERT_EQ(hole.band.size(), pixels.size());
        for (std::size_t i = 0; i < pixels.size(); ++i) {
            const BandPixel& b = hole.band[i];
            const auto [x, y] = pixels[i];
            ASSERT_EQ(b.pixel, pixels[i]);
            ASSERT_EQ(b.target, c.targets.id(x, y));
            ASSERT_EQ(b.covered, c.covered(x, y) != 0);
            const double clearance = to_outside(x, y) == kFar ? kInfinity : std::sqrt(double(to_outside(x, y)));
            ASSERT_FLOAT_EQ(b.clearance_px, float(clearance));
            ASSERT_FLOAT_EQ(b.width_px, b.covered ? float(std::min(double(c.params.depth_px), clearance / 3)) : 0.0f);
        }
    }
}

TEST(GrowHole, FloorIsBlurredOverTheHole) {
    std::mt19937 random(4);
    for (int round = 0; round < 20; ++round) {
        Case c = random_case({0, 0, 40, 36}, random);
        c.params.blur_px = float(pick(random, 9)) - 0.3f;
        if (c.params.blur_px < 0) c.params.blur_px = 50; // wider than the picture
        const int radius = int(std::lround(c.params.blur_px));
        const Hole blurred = c.grow();
        c.params.blur_px = 0;
        const Hole hole = c.grow();
        Image<float> expected = hole.floor_depth;
        for (int pass = 0; pass < 2; ++pass) {
            const Image<float> from = expected;
            for (std::int32_t y = 0; y < 36; ++y)
                for (std::int32_t x = 0; x < 40; ++x) {
                    if (!hole.mask(x, y) || c.targets.id(x, y) != kNoPart) continue;
                    double sum = 0, count = 0;
                    for (std::int32_t v = std::max(y - radius, 0); v <= std::min(y + radius, 35); ++v)
                        for (std::int32_t u = std::max(x - radius, 0); u <= std::min(x + radius, 39); ++u)
                            if (hole.mask(u, v)) sum += double(from(u, v)), ++count;
                    expected(x, y) = float(sum / count);
                }
        }
        ASSERT_EQ(blurred.mask, hole.mask);
        for (std::size_t i = 0; i < expected.pixels().size(); ++i) {
            const float f = blurred.floor_depth.pixels()[i];
            if (!hole.mask.pixels()[i]) {
                ASSERT_EQ(f, kInfinity);
            } else if (c.targets.id.pixels()[i] != kNoPart) {
                ASSERT_EQ(f, c.targets.depth.pixels()[i]);
            } else {
                ASSERT_NEAR(f, expected.pixels()[i], 1e-6f);
            }
        }
    }
}

TEST(GrowHole, CropWithItsMarginEqualsTheFullPicture) {
    std::mt19937 random(5);
    for (int round = 0; round < 25; ++round) {
        const Rect whole{0, 0, 140, 120};
        Case full = random_case(whole, random);
        full.params = {.depth_px = 1 + pick(random, 6), .blur_px = float(pick(random, 4))};
        const Rect picture{60, 50, 60 + 1 + pick(random, 24), 50 + 1 + pick(random, 24)};
        const Rect window = picture.grown(hole_margin_px(full.params)).intersected(whole);
        Case part{IdBuffer(window), crop(full.covered, window), crop(full.enclosing, window), full.params};
        part.targets.id = crop(full.targets.id, window);
        part.targets.depth = crop(full.targets.depth, window);

        const Hole expected = full.grow(), found = part.grow();
        ASSERT_EQ(crop(found.mask, picture), crop(expected.mask, picture));
        ASSERT_EQ(crop(found.floor_depth, picture), crop(expected.floor_depth, picture));
        // One pixel more, as interpolation inside the picture reads it.
        const Rect read = picture.grown(1);
        ASSERT_EQ(crop(found.distance, read), crop(expected.distance, read));
    }
}

TEST(GrowHole, ClearanceCountsFourDepthsAway) {
    // The picture begins at x = 0. A contour pixel one depth to the left of it, with its nearest
    // outside pixel 17 further left, has r = 17/3 < 6: its disc ends short of the picture. A
    // window of three depths and a pixel around the picture does not show that outside pixel.
    const auto grow = [](std::int32_t margin) {
        const Rect window = Rect{0, 0, 20, 1}.grown(margin).intersected({-24, 0, 20, 1});
        const Mask target = mask_where(window, [](int x, int) { return x <= -6; });
        const Mask enclosing = mask_where(window, [](int x, int) { return x != -23; });
        return Case{id_buffer(target), target, enclosing, {.depth_px = 6, .blur_px = 0}}.grow();
    };
    EXPECT_EQ(hole_margin_px({.depth_px = 6, .blur_px = 0}), 30);
    EXPECT_FALSE(grow(30).mask(0, 0));
    EXPECT_TRUE(grow(3 * 6 + 1).mask(0, 0));
}

/// A target disc of radius r around (cx, cy) in an enclosing disc of radius R around (0, 0).
Case discs(double big_radius, double cx, double radius, int depth_px) {
    const auto size = std::int32_t(big_radius) + 6;
    const Rect window{-size, -size, size + 1, size + 1};
    const Mask target = disc(window, cx, 0, radius);
    return {id_buffer(target, 2), target, disc(window, 0, 0, big_radius), {.depth_px = depth_px, .blur_px = 5}};
}

TEST(GrowHole, NestedDiscsKeepTwiceTheDepthToTheEdge) {
    for (const double radius : {5.0, 20.0, 50.0, 70.0, 76.0}) {
        const Case c = discs(80, 0, radius, 12);
        const Hole hole = c.grow();
        const Image<std::int64_t> to_outside = distance_to_outside(c.enclosing);
        std::int64_t band = 0;
        for (std::int32_t y = hole.window.y0; y < hole.window.y1; ++y)
            for (std::int32_t x = hole.window.x0; x < hole.window.x1; ++x) {
                if (!hole.mask(x, y) || c.targets.id(x, y) != kNoPart) continue;
                ++band;
                std::int64_t k2 = kFar;
                for (const BandPixel& b : hole.band) k2 = std::min(k2, distance2(b.pixel, {x, y}));
                ASSERT_LE(4 * k2, to_outside(x, y)) << "k <= d/2 fails at " << x << ' ' << y;
                ASSERT_EQ(hole.floor_depth(x, y), 2.0f);
            }
        for (const BandPixel& b : hole.band) {
            ASSERT_TRUE(b.covered);
            ASSERT_LE(3 * b.width_px, b.clearance_px * 1.000001f);
            // D is the distance between the circles, but for the rounding of both to pixels.
            ASSERT_NEAR(b.clearance_px, 80 - radius, 2.0);
        }
        const double width = std::min(12.0, (80 - radius) / 3);
        const double ring = 3.14159265 * ((radius + width) * (radius + width) - radius * radius);
        if (width >= 2)
            EXPECT_NEAR(double(band), ring, 0.25 * ring) << radius;
        else {
            EXPECT_GT(band, 0);
        }
        EXPECT_TRUE(targets_without_room(hole).empty());
    }
}

TEST(GrowHole, WithoutAnEdgeInViewTheBandIsAsDeepAsWanted) {
    Case c = discs(40, 0, 12, 9);
    c.enclosing = Mask(c.enclosing.window(), 1);
    const Hole hole = c.grow();
    for (const BandPixel& b : hole.band) {
        EXPECT_EQ(b.clearance_px, kInfinity);
        EXPECT_EQ(b.width_px, 9.0f);
    }
    EXPECT_TRUE(hole.mask(12 + 9, 0));
    EXPECT_FALSE(hole.mask(12 + 10, 0));
    EXPECT_EQ(hole.distance(12 + 9, 0), 0.0f);
    EXPECT_EQ(hole.distance(12 + 10, 0), 1.0f);
}

TEST(GrowHole, TangentDiscsOpenACrescentWhereThereIsRoom) {
    // The target touches the edge of the enclosing disc at (100, 0).
    const Case c = discs(100, 40, 60, 20);
    const Hole hole = c.grow();
    // From a point of the inner circle at angle a to the outer circle: R - |point|.
    const auto clearance = [](double angle) {
        return 100 - std::hypot(40 + 60 * std::cos(angle), 60 * std::sin(angle));
    };
    std::size_t narrow = 0;
    for (const BandPixel& b : hole.band) {
        const double angle = std::atan2(b.pixel.y, b.pixel.x - 40);
        EXPECT_NEAR(b.width_px, std::min(20.0, std::max(clearance(angle), 0.0) / 3), 0.8);
        narrow += b.width_px < 1;
    }
    // r < 1 px where the gap is under 3 px: |angle| < 0.36, a ninth of the contour.
    EXPECT_GT(narrow, 0u);
    EXPECT_LT(narrow * 6, hole.band.size());
    EXPECT_TRUE(targets_without_room(hole).empty());
    // At the far side the band is 20 px deep, at the touching point there is none.
    EXPECT_TRUE(hole.mask(-20 - 20, 0));
    EXPECT_FALSE(hole.mask(-20 - 21, 0));
    EXPECT_FALSE(hole.mask(101, 0));

    // A target that nearly fills the disc: the gap is 1.5 (1 - cos a), at most 3 px. D counts
    // to the centre of a pixel outside, up to a pixel more; r < 1 px for most of the contour.
    const Case tight = discs(100, 1.5, 98.5, 20);
    EXPECT_EQ(targets_without_room(tight.grow()), (std::vector<PartId>{PartId{0}}));
}

TEST(GrowHole, RimIsTheCircleToASubpixel) {
    const Case c = discs(200, 0, 60, 25);
    const Hole hole = c.grow();
    const auto at = [&](double x, double y) {
        const auto ix = std::int32_t(std::floor(x)), iy = std::int32_t(std::floor(y));
        const double fx = x - ix, fy = y - iy;
        return (1 - fy) * ((1 - fx) * double(hole.distance(ix, iy)) + fx * double(hole.distance(ix + 1, iy))) +
               fy * ((1 - fx) * double(hole.distance(ix, iy + 1)) + fx * double(hole.distance(ix + 1, iy + 1)));
    };
    for (double angle = 0; angle < 6.28; angle += 0.003) {
        double r = 60;
        while (at(r * std::cos(angle), r * std::sin(angle)) <= 0) r += 0.01;
        // The contour's pixels lie up to a pixel inside the circle of radius 60.
        EXPECT_GT(r, 84.0);
        EXPECT_LT(r, 85.02);
        // What is found between the pixels is the rim of the union of the discs.
        double to_discs = 1e9;
        for (const BandPixel& b : hole.band)
            to_discs =
                std::min(to_discs, std::hypot(r * std::cos(angle) - b.pixel.x, r * std::sin(angle) - b.pixel.y) - 25);
        EXPECT_NEAR(to_discs, 0, 0.05) << angle;
    }
}

TEST(GrowHole, UncoveredContourKeepsTheTargetsOwnSilhouette) {
    Case c = discs(80, 0, 30, 10);
    for (std::int32_t y = -80; y < 80; ++y)
        for (std::int32_t x = 0; x < 80; ++x) c.covered(x, y) = 0; // an occluder over the left half
    const Hole hole = c.grow();
    for (std::int32_t y = -25; y < 25; ++y) {
        std::int32_t x = 0;
        while (c.targets.id(x, y) != kNoPart) ++x;
        if (x < 15) continue; // discs of the left half reach round the top and the bottom
        EXPECT_FALSE(hole.mask(x, y));
        // Between the last target pixel and the first outside one the rim is midway.
        EXPECT_EQ(hole.distance(x - 1, y), -0.5f);
        EXPECT_EQ(hole.distance(x, y), 0.5f);
    }
    EXPECT_TRUE(hole.mask(-40, 0));
    EXPECT_FALSE(hole.mask(-41, 0));
}

TEST(GrowHole, TargetPixelsNeverPushTheRimOutward) {
    // Wherever a target pixel meets the outside across a side, the rim is no farther from the
    // target's centre than the outside pixel's own distance says: at most half a pixel on the
    // target's side.
    std::mt19937 random(6);
    for (int round = 0; round < 30; ++round) {
        const Case c = random_case({0, 0, 70, 60}, random);
        const Hole hole = c.grow();
        for (std::int32_t y = 1; y < 59; ++y)
            for (std::int32_t x = 1; x < 69; ++x) {
                if (c.targets.id(x, y) == kNoPart) continue;
                const bool side =
                    !hole.mask(x - 1, y) || !hole.mask(x + 1, y) || !hole.mask(x, y - 1) || !hole.mask(x, y + 1);
                const bool corner = !hole.mask(x - 1, y - 1) || !hole.mask(x + 1, y - 1) || !hole.mask(x - 1, y + 1) ||
                                    !hole.mask(x + 1, y + 1);
                if (side) {
                    ASSERT_EQ(hole.distance(x, y), -0.5f);
                } else if (corner) {
                    ASSERT_NEAR(hole.distance(x, y), 0.5 - std::sqrt(2.0), 1e-6);
                } else {
                    ASSERT_LE(hole.distance(x, y), -0.5f);
                }
            }
    }
}

TEST(GrowHole, NothingOrEverythingInView) {
    const Rect w{0, 0, 20, 10};
    Case c{IdBuffer(w), Mask(w), Mask(w, 1), {}};
    Hole hole = c.grow();
    EXPECT_TRUE(hole.empty());
    EXPECT_TRUE(hole.band.empty());
    for (const float d : hole.distance.pixels()) EXPECT_GT(d, 0);

    c.targets = id_buffer(Mask(w, 1), 3);
    c.covered = Mask(w, 1);
    hole = c.grow();
    EXPECT_EQ(hole.bounds, w);
    EXPECT_TRUE(hole.band.empty());
    for (const float d : hole.distance.pixels()) EXPECT_LT(d, 0);
    for (const float z : hole.floor_depth.pixels()) EXPECT_EQ(z, 3.0f);

    EXPECT_TRUE(Case{}.grow().empty());
}

TEST(GrowHole, RefusesWhatDoesNotFitTogether) {
    const Case good = discs(20, 0, 8, 4);
    const auto code = [](const Case& c) -> std::string {
        try {
            (void)c.grow();
        } catch (const Error& e) {
            EXPECT_EQ(e.kind, ErrorKind::usage);
            return e.code;
        }
        return "";
    };
    EXPECT_EQ(code(good), "");
    for (const int depth : {0, -1, 4097}) {
        Case bad = good;
        bad.params.depth_px = depth;
        EXPECT_EQ(code(bad), "E0120");
    }
    for (const float blur : {-1.0f, 1e9f, std::nanf("")}) {
        Case bad = good;
        bad.params.blur_px = blur;
        EXPECT_EQ(code(bad), "E0120");
    }
    Case bad = good;
    bad.covered = Mask(Rect{0, 0, 3, 3});
    EXPECT_EQ(code(bad), "E0120");
    bad = good;
    bad.enclosing = Mask(Rect{0, 0, 3, 3});
    EXPECT_EQ(code(bad), "E0120");
    const std::vector<Contour> elsewhere{{{{1000, 1000}}, true, true}};
    EXPECT_THROW((void)grow_hole(elsewhere, good.targets, good.covered, good.enclosing), Error);
}

} // namespace
} // namespace porthole
