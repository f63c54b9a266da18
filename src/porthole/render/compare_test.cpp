#include "porthole/render/compare.h"

#include <gtest/gtest.h>

#include <cmath>

namespace porthole {
namespace {

/// A picture of 4x2 pixels of part 7 on the left and part 2 on the right, white on a black background.
Frame picture() {
    const Rect w{0, 0, 4, 2};
    Frame frame;
    frame.color = Image<Vec4f>(w, Vec4f{1, 1, 1, 1});
    frame.ids = IdBuffer(w);
    for (int y = 0; y < 2; ++y)
        for (int x = 0; x < 4; ++x) frame.ids.id(x, y) = PartId(x < 2 ? 7 : 2);
    frame.rays = {8, 16, 32, 1, 2};
    return frame;
}

TEST(Compare, FindsNoDifferenceInTheSamePicture) {
    const Frame full = picture();
    const Refinement r = compare_frames(full, full, {});
    EXPECT_EQ(r.pixels, 8);
    EXPECT_EQ(r.traced, 8);
    EXPECT_EQ(r.wrong_ids, 0);
    EXPECT_TRUE(r.missed.empty());
    EXPECT_EQ(r.mean_squared_error, 0);
    EXPECT_TRUE(std::isinf(r.psnr_db()));
    EXPECT_EQ(r.rays.all(), 59);
    EXPECT_EQ(r.full_rays.all(), 59);
}

TEST(Compare, CountsWrongIdsAndMissedParts) {
    const Frame full = picture();
    Frame frame = picture();
    frame.inferred = Mask(full.color.window(), 0);
    // Where part 2 was, part 7 and a part that is not there are inferred, and nothing.
    for (int y = 0; y < 2; ++y)
        for (int x = 2; x < 4; ++x) {
            frame.inferred(x, y) = 1;
            frame.ids.id(x, y) = PartId(x == 2 ? 7 : 5);
        }
    frame.ids.id(3, 1) = kNoPart;
    frame.rays = {4, 0, 0, 0, 0};
    const Refinement r = compare_frames(frame, full, {});
    EXPECT_EQ(r.traced, 4);
    EXPECT_EQ(r.wrong_ids, 4);
    EXPECT_EQ(r.missed, std::vector<PartId>{PartId(2)});
    EXPECT_EQ(r.rays.primary, 4);
    EXPECT_EQ(r.full_rays.primary, 8);
}

TEST(Compare, MeasuresEightBitChannelsOverTheBackground) {
    const Frame full = picture();
    Frame frame = picture();
    frame.color(1, 1) = {0, 0, 0, 1};
    const Refinement black = compare_frames(frame, full, {});
    EXPECT_DOUBLE_EQ(black.mean_squared_error, 255.0 * 255.0 / 8);
    EXPECT_NEAR(black.psnr_db(), 10 * std::log10(8.0), 1e-12);
    // Nothing over white is white.
    frame.color(1, 1) = {0, 0, 0, 0};
    EXPECT_EQ(compare_frames(frame, full, {1, 1, 1}).mean_squared_error, 0);
    // One channel, one step.
    frame.color(1, 1) = {1, 1, 0.99f, 1};
    EXPECT_NEAR(compare_frames(frame, full, {}).mean_squared_error, 1.0 / 24, 1e-12);
}

TEST(Compare, TakesAsManySamplesAsTheRefinedPicture) {
    RenderParams params;
    params.samples = 16;
    params.refine = Refine::adaptive;
    EXPECT_EQ(full_of(params).samples, 16);
    EXPECT_EQ(full_of(params).refine, Refine::full);
    params.refine = Refine::paper2;
    EXPECT_EQ(full_of(params).samples, 1);
    EXPECT_EQ(full_of(params).refine, Refine::full);
}

} // namespace
} // namespace porthole
