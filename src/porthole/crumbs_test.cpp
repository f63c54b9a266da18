// Slivers that a cut leaves of constructed combs.
#include "porthole/crumbs.h"

#include <gtest/gtest.h>

#include <array>

#include "support/shapes.h"

namespace porthole {
namespace {

struct Block {
    Vec3d center, half;
};

/// One part: a plate that hides the target, and teeth behind it that it holds somewhere else.
Mesh comb(const std::vector<Block>& teeth) {
    const Mesh cube = test::cube();
    std::vector<Block> blocks = teeth;
    blocks.push_back({{0, 0, 2}, {1.1, 1.1, 0.05}});
    Mesh mesh;
    for (const Block& block : blocks) {
        const auto base = std::uint32_t(mesh.positions.size());
        for (const Vec3f p : cube.positions)
            mesh.positions.push_back({float(block.center.x + block.half.x * p.x),
                                      float(block.center.y + block.half.y * p.y),
                                      float(block.center.z + block.half.z * p.z)});
        for (const Vec3u t : cube.triangles) mesh.triangles.push_back({base + t.x, base + t.y, base + t.z});
    }
    return test::finished(std::move(mesh));
}

constexpr double kFront = 0.3; ///< z of the target's front, where the cut ends beside it

/// A sliver of 4 x 4 pixels that the cut runs through, with its left edge at x.
Block sliver(double x, double y = 0) { return {{x + 0.02, y, kFront}, {0.02, 0.02, 0.02}}; }

/// A target of 60 x 60 pixels behind a comb, before a wall. 100 pixels to the metre, the picture's
/// middle is x = y = 0; the eye is at z = 10.
struct Bench {
    test::Builder builder;
    PartId target, holder;
    MeshBvhs meshes;
    Subject subject;
    View view = test::look({0, 0, 10}, {}, 240, 240, 1.2f, true);
    PlanParams params{.depth = Length{Length::Unit::pixel, 25}};

    explicit Bench(const std::vector<Block>& teeth, const std::vector<Block>& walls = {{{0, 0, -2}, {1.1, 1.1, 0.1}}})
        : target(builder.add_box("target", {0, 0, 0}, {kFront, kFront, kFront})), holder(add(teeth, walls)),
          meshes(build_mesh_bvhs(builder.scene)), subject(make_subject(meshes, std::array{target})) {}

    PartId add(const std::vector<Block>& teeth, const std::vector<Block>& walls) {
        for (const Block& wall : walls) builder.add_box("wall", wall.center, wall.half);
        builder.scene.meshes.push_back(comb(teeth));
        return builder.add("comb", 2, {}, {1, 1, 1});
    }
    [[nodiscard]] ViewPlan planned(const Control& control = {}) const {
        ViewPlan plan = plan_view(subject, view, params, control);
        plan_caps(subject, plan, {}, control);
        return plan;
    }
    Caps clean(ViewPlan& plan, const Control& control = {}) const {
        const Bvh opened = build_bvh(meshes, all_parts(builder.scene), plan.cut.role, plan.cut.level);
        return remove_crumbs(subject, plan, opened, subject.target_bvh, control);
    }
    /// Everything stays as it was.
    void expect_kept(std::int64_t pieces, std::int64_t pixels) const {
        const ViewPlan before = planned();
        ASSERT_FALSE(before.nothing_to_cut());
        ViewPlan plan = planned();
        (void)clean(plan);
        EXPECT_EQ(plan.crumbs.removed, 0);
        EXPECT_EQ(plan.crumbs.removed_px, 0);
        EXPECT_EQ(plan.crumbs.kept, pieces);
        EXPECT_EQ(plan.crumbs.kept_px, pixels);
        EXPECT_TRUE(plan.cut.levels == before.cut.levels);
        EXPECT_TRUE(plan.cut.loose_depth == before.cut.loose_depth);
        EXPECT_TRUE(plan.cut.ranges == before.cut.ranges);
    }
};

TEST(Crumbs, SliversOfACombAreCutAway) {
    const Bench bench({sliver(0.35, -0.1), sliver(0.35), sliver(0.35, 0.1)});
    const ViewPlan before = bench.planned();
    ASSERT_EQ(before.cut.levels.size(), 1u);
    ViewPlan plan = bench.planned();
    const Caps caps = bench.clean(plan);
    EXPECT_EQ(plan.crumbs.removed, 3);
    EXPECT_EQ(plan.crumbs.removed_px, 3 * 16);
    EXPECT_EQ(plan.crumbs.kept, 0);

    int cut_deeper = 0;
    const Rect box = plan.hole.bounds;
    for (int y = box.y0; y < box.y1; ++y)
        for (int x = box.x0; x < box.x1; ++x) {
            bool in_sliver = false, beside = false;
            for (const int row : {108, 118, 128}) { // first rows of the slivers, whose first column is 155
                in_sliver |= x >= 155 && x < 159 && y >= row && y < row + 4;
                beside |= x >= 154 && x < 160 && y >= row - 1 && y < row + 5;
            }
            const float depth = plan.cut.levels[0](x, y).depth(-plan.cut.distance(x, y));
            if (in_sliver) {
                // Its far side is at z = 0.28.
                EXPECT_GT(depth, 10 - 0.28f);
                EXPECT_LT(depth, 10 - 0.28f + 1e-3f);
                const SurfaceRef cap = caps.at(0, x, y);
                EXPECT_EQ(cap.part, kNoPart);
                ++cut_deeper;
            } else if (!beside) {
                EXPECT_EQ(plan.cut.levels[0](x, y), before.cut.levels[0](x, y)) << x << ',' << y;
                EXPECT_EQ(plan.cut.loose_depth(x, y), before.cut.loose_depth(x, y));
            }
        }
    EXPECT_EQ(cut_deeper, 3 * 16);
    // Light does not meet them either.
    EXPECT_TRUE(plan.cut.removes({0.37f, 0.1f, 0.285f}, bench.holder));
    EXPECT_FALSE(before.cut.removes({0.37f, 0.1f, 0.285f}, bench.holder));
}

TEST(Crumbs, OneBehindAnotherGoesToo) {
    Block behind = sliver(0.35);
    behind.center.z = -0.5;
    const Bench bench({sliver(0.35), behind});
    ViewPlan plan = bench.planned();
    (void)bench.clean(plan);
    // What comes to light is looked at, too, but no third time.
    EXPECT_EQ(plan.crumbs.removed, 1);
    EXPECT_EQ(plan.crumbs.kept, 1);
    EXPECT_EQ(plan.crumbs.kept_px, 16);
}

TEST(Crumbs, PiecesAsLargeAsTheRuleStay) {
    // 5 x 5 pixels are no crumb at this height, 5 x 4 are.
    EXPECT_EQ(crumb_area_px(Bench({}).view), 25);
    Bench(std::vector{Block{{0.375, 0.005, kFront}, {0.025, 0.025, 0.02}}}).expect_kept(0, 0);
    const Bench smaller(std::vector{Block{{0.375, 0, kFront}, {0.025, 0.02, 0.02}}});
    ViewPlan plan = smaller.planned();
    (void)smaller.clean(plan);
    EXPECT_EQ(plan.crumbs.removed_px, 20);
}

TEST(Crumbs, NeighboursTwoPixelsApartAreOnePiece) { Bench({sliver(0.35, 0), sliver(0.35, 0.05)}).expect_kept(0, 0); }

TEST(Crumbs, WhatTouchesTheRimStays) {
    Bench bench({});
    const ViewPlan plan = bench.planned();
    int rim = 120;
    while (plan.cut.distance(rim, 120) <= 0) ++rim;
    // Its last column is the last one inside, so that it goes on to the rim.
    Bench touching({sliver((rim - 4 - 120) / 100.0)});
    touching.params.bevel = Length{Length::Unit::pixel, 0};
    touching.expect_kept(0, 0);
}

TEST(Crumbs, WhatStandsOnSomethingStays) {
    // A pin down to the wall.
    Bench(std::vector{Block{{0.37, 0, -0.8}, {0.02, 0.02, 1.12}}}).expect_kept(0, 0);
    // A low block on a table that is its own part, hardly behind the cut.
    Bench({sliver(0.35)}, {{{0, 0, -2}, {1.1, 1.1, 0.1}}, {{0.4, 0, 0.24}, {0.09, 0.2, 0.04}}}).expect_kept(0, 0);
}

TEST(Crumbs, WhatCoversTheBackgroundStays) {
    // The wall has a window of 2 x 2 pixels behind the sliver.
    const double x = 0.37, w = 0.01;
    const double left = (x - w + 1.1) / 2, right = (1.1 - x - w) / 2, high = (1.1 - w) / 2;
    Bench({sliver(0.35)}, {{{-1.1 + left, 0, -2}, {left, 1.1, 0.1}},
                           {{1.1 - right, 0, -2}, {right, 1.1, 0.1}},
                           {{x, 1.1 - high, -2}, {w, high, 0.1}},
                           {{x, -1.1 + high, -2}, {w, high, 0.1}}})
        .expect_kept(1, 16);
}

TEST(Crumbs, WhatStandsCloseToATargetStays) { Bench({sliver(kFront + 0.01)}).expect_kept(1, 16); }

TEST(Crumbs, AreTheSameForAnyNumberOfThreads) {
    const Bench bench({sliver(0.35, -0.1), sliver(0.36), sliver(-0.4, 0.1), sliver(kFront + 0.01, 0.2)});
    ViewPlan one = bench.planned(test::with_threads(1));
    const Caps caps = bench.clean(one, test::with_threads(1));
    EXPECT_EQ(one.crumbs.removed, 3);
    for (const int threads : {2, 7}) {
        ViewPlan more = bench.planned(test::with_threads(threads));
        const Caps again = bench.clean(more, test::with_threads(threads));
        EXPECT_TRUE(one.cut.levels == more.cut.levels);
        EXPECT_TRUE(one.cut.loose_depth == more.cut.loose_depth);
        EXPECT_TRUE(one.cut.ranges == more.cut.ranges);
        EXPECT_TRUE(caps.levels == again.levels);
        EXPECT_EQ(one.crumbs.removed_px, more.crumbs.removed_px);
        EXPECT_EQ(one.crumbs.kept_px, more.crumbs.kept_px);
        EXPECT_EQ(one.rays.caps, more.rays.caps);
    }
}

} // namespace
} // namespace porthole
