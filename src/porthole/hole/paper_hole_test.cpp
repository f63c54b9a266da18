#include <gtest/gtest.h>

#include "porthole/base/error.h"
#include "porthole/hole/distance.h"
#include "porthole/hole/hole.h"
#include "porthole/hole/test_pictures.h"

namespace porthole {
namespace {

using namespace porthole::testing;

PaperContours follow(const Image<PartId>& ids) {
    return find_contours_paper(
        [&](std::span<const Vec2i> pixels) {
            std::vector<PartId> result;
            for (const Vec2i p : pixels) result.push_back(ids(p.x, p.y));
            return result;
        },
        ids.window());
}

/// A contour as given by hand, of part 0.
PaperContours contour_of(std::vector<Vec2i> pixels, bool closed) {
    PaperContours contours;
    contours.contours.push_back({std::move(pixels), true, closed});
    contours.ids.push_back(PartId{0});
    return contours;
}

TEST(GrowHolePaper, BorderTwelvePixelsOffGivesFour) {
    // The target ends at x = 10, E at x = 22: k <= (12 - k) / 2 holds up to k = 4.
    const Rect window{0, 0, 40, 41};
    const Mask target = mask_where(window, [](int x, int) { return x <= 10; });
    const Mask enclosing = mask_where(window, [](int x, int) { return x <= 22; });
    std::vector<Vec2i> line;
    for (int y = 30; y >= 10; --y) line.push_back({10, y});
    const PaperHole paper = grow_hole_paper(contour_of(line, false), id_buffer(target), enclosing, 30);
    ASSERT_EQ(paper.targets.size(), 1u);
    EXPECT_EQ(paper.targets[0].depth_px, 4);
    EXPECT_EQ(paper.targets[0].distance_px, 8.0f);
    EXPECT_TRUE(paper.hole.mask(14, 20));
    EXPECT_FALSE(paper.hole.mask(15, 20));
    // P and F fan out at both ends of the line.
    EXPECT_TRUE(paper.hole.mask(14, 6));
    EXPECT_TRUE(paper.hole.mask(14, 34));
    EXPECT_FALSE(paper.hole.mask(14, 5));
    for (const BandPixel& b : paper.hole.band) {
        EXPECT_TRUE(b.covered);
        EXPECT_EQ(b.width_px, 4.0f);
        EXPECT_EQ(b.clearance_px, 13.0f);
    }

    // One pixel less to the border, one less to go; the wanted depth is a limit too.
    const Mask nearer = mask_where(window, [](int x, int) { return x <= 21; });
    EXPECT_EQ(grow_hole_paper(contour_of(line, false), id_buffer(target), nearer, 30).targets[0].depth_px, 3);
    EXPECT_EQ(grow_hole_paper(contour_of(line, false), id_buffer(target), enclosing, 2).targets[0].depth_px, 2);
}

TEST(GrowHolePaper, DiagonalsReachFurther) {
    const Rect window{0, 0, 96, 96};
    const Mask target = disc(window, 48, 48, 20);
    const PaperContours contours = follow(ids_of(target));
    ASSERT_EQ(contours.contours.size(), 1u);
    const PaperHole paper = grow_hole_paper(contours, id_buffer(target), Mask(window, 1));
    EXPECT_EQ(paper.targets[0].depth_px, 4);
    EXPECT_EQ(paper.targets[0].distance_px, kInfinity);
    const Image<std::int64_t> to_target = distance_transform(target);
    std::int64_t farthest2 = 0;
    for (std::int32_t y = 0; y < 96; ++y)
        for (std::int32_t x = 0; x < 96; ++x)
            if (paper.hole.mask(x, y)) farthest2 = std::max(farthest2, to_target(x, y));
    EXPECT_EQ(farthest2, 32); // (4 sqrt 2)^2: 5.66 px, where 4 were wanted
    // N_k of the topmost pixel reaches 4.
    EXPECT_TRUE(paper.hole.mask(48, 28 - 4));
    EXPECT_FALSE(paper.hole.mask(48, 28 - 5));
}

TEST(GrowHolePaper, NormalsAreTheOutgoingOnes) {
    // A line one pixel wide has another part's id on both sides; a square's sides on one.
    const Rect window{0, 0, 40, 40};
    const Mask line = mask_where(window, [](int x, int y) { return y == 20 && x >= 10 && x <= 25; });
    std::vector<Vec2i> pixels;
    for (int x = 10; x <= 25; ++x) pixels.push_back({x, 20});
    const PaperHole both = grow_hole_paper(contour_of(pixels, false), id_buffer(line), Mask(window, 1), 3);
    EXPECT_TRUE(both.hole.mask(18, 23));
    EXPECT_TRUE(both.hole.mask(18, 17));
    EXPECT_FALSE(both.hole.mask(18, 24));
    // The last pixel reuses the tangent before it; nothing grows in the tangent's own direction.
    EXPECT_TRUE(both.hole.mask(25, 23));
    EXPECT_TRUE(both.hole.mask(28, 23)); // F_3
    EXPECT_FALSE(both.hole.mask(27, 20));

    const Mask square = mask_where(window, [](int x, int y) { return x >= 13 && x < 23 && y >= 13 && y < 23; });
    const PaperContours contours = follow(ids_of(square));
    ASSERT_EQ(contours.contours.size(), 1u);
    ASSERT_TRUE(contours.contours[0].closed);
    const PaperHole around = grow_hole_paper(contours, id_buffer(square), Mask(window, 1), 3);
    for (const Vec2i p : {Vec2i{18, 10}, Vec2i{18, 25}, Vec2i{10, 18}, Vec2i{25, 18}}) {
        EXPECT_TRUE(around.hole.mask(p.x, p.y));
        EXPECT_EQ(around.hole.distance(p.x, p.y), -0.5f);
    }
    EXPECT_FALSE(around.hole.mask(18, 9));
    EXPECT_EQ(around.hole.distance(18, 9), 0.5f);
    EXPECT_EQ(around.hole.floor_depth(18, 12), kInfinity);
}

TEST(GrowHolePaper, ASinglePixelHasNoTangent) {
    const Rect window{0, 0, 20, 20};
    const Mask dot = mask_where(window, [](int x, int y) { return x == 9 && y == 9; });
    const PaperHole paper = grow_hole_paper(contour_of({{9, 9}}, false), id_buffer(dot), Mask(window, 1));
    EXPECT_EQ(paper.hole.mask, dot);
    EXPECT_EQ(paper.hole.bounds, (Rect{9, 9, 10, 10}));
}

TEST(GrowHolePaper, DepthKeepsTwiceItsDistanceToTheBorder) {
    for (int radius = 6; radius < 60; radius += 7) {
        const Rect window{-70, -70, 71, 71};
        const Mask target = disc(window, 3, -2, radius), enclosing = disc(window, 0, 0, 64);
        const PaperContours contours = follow(ids_of(target));
        ASSERT_EQ(contours.contours.size(), 1u);
        const PaperHole paper = grow_hole_paper(contours, id_buffer(target), enclosing, 20);
        const Mask border = mask_where(window, [&](int x, int y) {
            return enclosing(x, y) && !(enclosing.at_or(x - 1, y, 1) && enclosing.at_or(x + 1, y, 1) &&
                                        enclosing.at_or(x, y - 1, 1) && enclosing.at_or(x, y + 1, 1));
        });
        const Image<std::int64_t> to_border = distance_transform(border);
        const int k = paper.targets[0].depth_px;
        std::int64_t nearest2 = kFar;
        for (std::int32_t y = -70; y < 71; ++y)
            for (std::int32_t x = -70; x < 71; ++x)
                if (paper.hole.mask(x, y) && !target(x, y)) {
                    ASSERT_TRUE(enclosing(x, y));
                    nearest2 = std::min(nearest2, to_border(x, y));
                }
        if (k > 0) {
            EXPECT_LE(4 * k * k, nearest2) << radius;
        }
        // The gap is about 60 - radius on the narrow side, and diagonals run 1.41 k deep.
        EXPECT_LE(k, (60.4 - radius) / 3 + 1) << radius;
        EXPECT_GE(k, std::min(20.0, std::floor((60.4 - radius - 3) / (2 + std::sqrt(2.0)))) - 1) << radius;
    }
}

TEST(GrowHolePaper, TangentDiscsAreRefused) {
    const Rect window{-110, -110, 111, 111};
    const Mask target = disc(window, 40, 0, 60), enclosing = disc(window, 0, 0, 100);
    const PaperContours contours = follow(ids_of(target));
    ASSERT_EQ(contours.contours.size(), 1u);
    const PaperHole paper = grow_hole_paper(contours, id_buffer(target), enclosing);
    ASSERT_EQ(paper.targets.size(), 1u);
    EXPECT_EQ(paper.targets[0].depth_px, 0);
    EXPECT_TRUE(paper.hole.empty()); // not even the target's own pixels
    EXPECT_EQ(paper.hole.band.size(), contours.contours[0].pixels.size());
}

TEST(GrowHolePaper, TargetsAreJudgedEachOnItsOwn) {
    // A has room on all sides, B touches the border.
    const Rect window{0, 0, 96, 64};
    IdBuffer targets = id_buffer(disc(window, 30, 32, 9), 1, PartId{0});
    const IdBuffer second = id_buffer(disc(window, 81, 32, 9), 1, PartId{1});
    for (std::size_t i = 0; i < second.id.pixels().size(); ++i)
        if (second.id.pixels()[i] != kNoPart) {
            targets.id.pixels()[i] = PartId{1};
            targets.depth.pixels()[i] = 1;
        }
    const Mask enclosing = mask_where(window, [](int x, int) { return x <= 90; });
    const PaperContours contours = follow(targets.id);
    ASSERT_EQ(contours.contours.size(), 2u);
    const PaperHole paper = grow_hole_paper(contours, targets, enclosing);
    for (const PaperHole::PerTarget& t : paper.targets) EXPECT_EQ(t.depth_px, t.target == PartId{0} ? 4 : 0);
    EXPECT_TRUE(paper.hole.mask(30, 32));
    EXPECT_FALSE(paper.hole.mask(81, 32));
}

TEST(GrowHolePaper, RefusesWhatDoesNotFitTogether) {
    const Rect window{0, 0, 20, 20};
    const Mask dot = mask_where(window, [](int x, int y) { return x == 9 && y == 9; });
    const PaperContours contours = contour_of({{9, 9}}, false);
    EXPECT_THROW((void)grow_hole_paper(contours, id_buffer(dot), Mask(3, 3)), Error);
    EXPECT_THROW((void)grow_hole_paper(contours, id_buffer(dot), Mask(window, 1), 0), Error);
    EXPECT_THROW((void)grow_hole_paper(contours, id_buffer(dot), Mask(window, 1), 4, Mask(3, 3)), Error);
    EXPECT_THROW((void)grow_hole_paper(contour_of({{8, 9}}, false), id_buffer(dot), Mask(window, 1)), Error);
}

} // namespace
} // namespace porthole
