#include <gtest/gtest.h>

#include <algorithm>
#include <set>

#include "porthole/hole/contour.h"
#include "porthole/hole/test_pictures.h"

namespace porthole {
namespace {

using namespace porthole::testing;

/// A picture to be traced on demand, which counts who was asked for.
struct Tracer {
    const Image<PartId>& ids;
    Image<int> asked{ids.window()};

    PaperContours find() {
        return find_contours_paper(
            [this](std::span<const Vec2i> pixels) {
                std::vector<PartId> result;
                for (const Vec2i p : pixels) {
                    ++asked(p.x, p.y);
                    result.push_back(ids(p.x, p.y));
                }
                return result;
            },
            ids.window());
    }
};

PaperContours find(const Image<PartId>& ids) { return Tracer{ids}.find(); }

Image<PartId> box(Rect window, Rect part) {
    return ids_of(mask_where(window, [&](int x, int y) { return part.contains(x, y); }));
}

TEST(PaperContours, SquareOfThreeGivesEightPixelsClosed) {
    // Every place of the square within a block: unless step 1 misses it, all eight are found.
    int found = 0;
    for (int y = 8; y < 16; ++y)
        for (int x = 8; x < 16; ++x) {
            const Image<PartId> ids = box({0, 0, 32, 32}, {x, y, x + 3, y + 3});
            const PaperContours paper = find(ids);
            if (paper.contours.empty()) continue;
            ++found;
            ASSERT_EQ(paper.contours.size(), 1u);
            EXPECT_TRUE(paper.contours[0].closed) << x << ' ' << y;
            EXPECT_EQ(contour_pixels(paper.contours), contour_pixels(find_contours(ids))) << x << ' ' << y;
            EXPECT_EQ(paper.contours[0].pixels.size(), 8u);
            EXPECT_EQ(paper.ids, (std::vector<PartId>{PartId{0}}));
        }
    EXPECT_GT(found, 0);
}

TEST(PaperContours, TargetThatNoCornerTellsApartIsMissed) {
    // It fills a block exactly: all its corners see it, and no other block's corner does.
    EXPECT_TRUE(find(box({0, 0, 40, 40}, {8, 8, 16, 16})).contours.empty());
    // Between the corners of a block.
    EXPECT_TRUE(find(box({0, 0, 40, 40}, {9, 9, 15, 15})).contours.empty());
    // A pixel off the grid it is found.
    const PaperContours paper = find(box({0, 0, 40, 40}, {9, 8, 17, 16}));
    ASSERT_EQ(paper.contours.size(), 1u);
    EXPECT_TRUE(paper.contours[0].closed);
    EXPECT_EQ(paper.contours[0].pixels.size(), 28u);
}

TEST(PaperContours, FirstPixelOfEachIdInScanOrderOfBlocksDeparts) {
    const PaperContours paper = find(ids_from_text({
        "........BBB.....", //
        "........BBB.....", //
        "........BBB.....", //
        "........BBB.....", //
        "................", //
        "................", //
        "................", //
        "AAAA............",
    }));
    ASSERT_EQ(paper.contours.size(), 2u);
    // Block (0, 0) comes before block (8, 0), although B's pixels lie higher.
    EXPECT_EQ(paper.ids, (std::vector<PartId>{PartId{0}, PartId{1}}));
    EXPECT_EQ(paper.contours[0].pixels.front(), (Vec2i{0, 7}));
    // The 2x2 block at (8, 0) sees B alone; the one beside it is the first that differs.
    EXPECT_EQ(paper.contours[1].pixels.front(), (Vec2i{10, 0}));
}

TEST(PaperContours, OpenLineEndsOpen) {
    const Image<PartId> ids = box({0, 0, 32, 16}, {3, 7, 20, 8});
    const PaperContours paper = find(ids);
    ASSERT_EQ(paper.contours.size(), 1u);
    EXPECT_FALSE(paper.contours[0].closed);
}

TEST(PaperContours, EveryRayIsCountedAndTracedOnce) {
    std::mt19937 random(4);
    for (int round = 0; round < 60; ++round) {
        const Rect window{-3, 5, -3 + 9 + pick(random, 60), 5 + 9 + pick(random, 40)};
        Image<PartId> ids = ids_of(random_mask(window, kAllKinds[round % 5], random));
        const Mask second = random_mask(window, Kind::blobs, random);
        for (std::size_t i = 0; i < second.pixels().size(); ++i)
            if (second.pixels()[i]) ids.pixels()[i] = PartId{1};
        Tracer tracer{ids};
        const PaperContours paper = tracer.find();

        std::int64_t traced = 0;
        for (std::size_t i = 0; i < ids.pixels().size(); ++i) {
            ASSERT_LE(tracer.asked.pixels()[i], 1);
            ASSERT_EQ(tracer.asked.pixels()[i], paper.traced.pixels()[i]);
            ASSERT_EQ(paper.known.pixels()[i], paper.traced.pixels()[i] ? ids.pixels()[i] : kNoPart);
            traced += tracer.asked.pixels()[i];
        }
        ASSERT_EQ(paper.step1_rays + paper.step2_rays, traced);

        // One chain per id, of that id's pixels, none twice, each step to a neighbour.
        std::set<PartId> seen;
        ASSERT_EQ(paper.ids.size(), paper.contours.size());
        for (std::size_t c = 0; c < paper.contours.size(); ++c) {
            ASSERT_TRUE(seen.insert(paper.ids[c]).second);
            const auto& chain = paper.contours[c].pixels;
            ASSERT_EQ(contour_pixels({&paper.contours[c], 1}).size(), chain.size());
            for (std::size_t i = 0; i < chain.size(); ++i) {
                ASSERT_EQ(ids(chain[i].x, chain[i].y), paper.ids[c]);
                if (i > 0) {
                    ASSERT_LE(std::abs(chain[i].x - chain[i - 1].x), 1);
                    ASSERT_LE(std::abs(chain[i].y - chain[i - 1].y), 1);
                }
            }
        }
    }
}

TEST(PaperContours, AsksFarFewerRaysThanThereArePixels) {
    const Rect window{0, 0, 512, 512};
    const PaperContours paper = find(ids_of(disc(window, 250, 260, 100)));
    ASSERT_EQ(paper.contours.size(), 1u);
    // Four corners of 64 x 64 blocks, and what the disc's border adds.
    EXPECT_GE(paper.step1_rays, 64 * 64 * 4);
    EXPECT_LT(paper.step1_rays, 64 * 64 * 4 + 4000);
    EXPECT_LT(paper.step2_rays, 4000);
    EXPECT_EQ(find(ids_of(Mask(window))).step1_rays, 64 * 64 * 4);
    EXPECT_EQ(find(ids_of(Mask(window))).step2_rays, 0);
}

TEST(PaperContours, PartialBlocksAreClampedToTheWindow) {
    // 13 x 11: the last column of blocks is 5 wide, the last row 3 high. The target fills the
    // picture's last corner, which is a corner of the clamped block.
    const PaperContours paper = find(box({0, 0, 13, 11}, {11, 9, 13, 11}));
    ASSERT_EQ(paper.contours.size(), 1u);
    EXPECT_EQ(paper.contours[0].pixels, (std::vector<Vec2i>{{11, 9}, {12, 9}, {12, 10}, {11, 10}}));
    EXPECT_TRUE(paper.contours[0].closed);
    EXPECT_TRUE(
        find_contours_paper([](std::span<const Vec2i>) { return std::vector<PartId>(); }, Rect{}).contours.empty());
}

} // namespace
} // namespace porthole
