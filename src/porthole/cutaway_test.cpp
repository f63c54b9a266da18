// Plans of style cutaway, checked against the geometry of constructed scenes.
#include <gtest/gtest.h>

#include <array>
#include <random>

#include "porthole/base/error.h"
#include "porthole/hole/distance.h"
#include "porthole/plan.h"
#include "support/shapes.h"

namespace porthole {
namespace {

using test::Builder;
using test::look;

Length px(double n) { return {Length::Unit::pixel, n}; }

/// Depth from the eye at z = 10 to the front of a sphere about the origin; the view is orthographic.
double front_of(const View& view, int x, int y, double radius) {
    const double s = double(view.pixel_scale());
    const double u = (x + 0.5 - 0.5 * view.width) * s, v = (y + 0.5 - 0.5 * view.height) * s;
    return 10 - std::sqrt(std::max(0.0, radius * radius - u * u - v * v));
}

float cut_depth(const ViewPlan& plan, std::size_t level, int x, int y) {
    return plan.cut.levels[level](x, y).depth(-plan.cut.distance(x, y));
}

/// Whether a surface of `part` at `depth` on the ray of a pixel's centre is gone.
bool is_gone(const ViewPlan& plan, int x, int y, PartId part, double depth) {
    if (!plan.hole.mask.at_or(x, y, 0)) return false;
    switch (plan.cut.role[index(part)]) {
    case CutRole::cut_set: return depth < double(cut_depth(plan, plan.cut.level_of(part), x, y));
    case CutRole::loose: return depth < double(plan.cut.loose_depth(x, y));
    case CutRole::fixed: return false;
    }
    return false;
}

template <typename Visit> void for_each_pixel(Rect r, const Visit& visit) {
    for (int y = r.y0; y < r.y1; ++y)
        for (int x = r.x0; x < r.x1; ++x) visit(x, y);
}

TEST(Cutaway, PerspectiveChamfersAreAsWideAsTheWallLooksThere) {
    // The same picture of a plate from twice as near, and half as large: the same profile.
    const auto width = [](float distance, double scale) {
        Builder b(48);
        const PartId ball = b.add_sphere("ball", {0, 0, -2 * scale}, 0.3 * scale);
        b.add_box("plate", {0, 0, 0}, {3 * scale, 3 * scale, 0.06 * scale});
        const MeshBvhs meshes = build_mesh_bvhs(b.scene);
        const View view = look({0, 0, distance}, {}, 300, 300, 0.2f);
        const ViewPlan plan = plan_view(make_subject(meshes, std::array{ball}), view, {.depth = px(40)});
        return plan.cut.levels[0](150, plan.hole.bounds.y0 + 5).width;
    };
    const float w = width(8, 1);
    // The plate's front is 7.94 m away: 1.1 * 0.12 m over 0.4 m / 300 * 7.94.
    EXPECT_NEAR(w, 1.1 * 0.12 / (0.4 / 300 * 7.94), 0.3);
    EXPECT_NEAR(width(16, 2), w, 0.05);
}

struct Shells {
    Builder b{64};
    PartId core = b.add_sphere("core", {0, 0, 0}, 0.35);
    PartId inner = b.add_sphere("inner", {0, 0, 0}, 0.6);
    PartId outer = b.add_sphere("outer", {0, 0, 0}, 1);
    PartId middle = b.add_sphere("middle", {0, 0, 0}, 0.8);
    PartId bead = b.add_sphere("bead", {0.05, 0.05, 0.7}, 0.06); // between middle and inner
    View view = look({0, 0, 10}, {}, 400, 400, 1.2f, true);
};

TEST(Cutaway, ShellsThatEncloseOneAnotherOpenInSteps) {
    const Shells s;
    const MeshBvhs meshes = build_mesh_bvhs(s.b.scene);
    const Subject subject = make_subject(meshes, std::array{s.core});
    const ViewPlan plan = plan_view(subject, s.view, {.depth = px(30)});
    ASSERT_EQ(plan.cut.levels.size(), 3u);
    EXPECT_EQ(plan.cut.level_of(s.outer), 0u);
    EXPECT_EQ(plan.cut.level_of(s.middle), 1u);
    EXPECT_EQ(plan.cut.level_of(s.inner), 2u);
    EXPECT_EQ(plan.cut.level_of(s.bead), 1u);

    // Each opening is a step of a third of the band narrower than the one outside it.
    const std::array<std::pair<PartId, double>, 3> shells{{{s.outer, 1.0}, {s.middle, 0.8}, {s.inner, 0.6}}};
    for (std::size_t k = 0; k < 3; ++k) {
        std::int64_t open = 0;
        for_each_pixel(s.view.window(), [&](int x, int y) {
            const double front = front_of(s.view, x, y, shells[k].second);
            if (front > 9.95) return;
            open += is_gone(plan, x, y, shells[k].first, front + 1e-3);
        });
        const double radius = std::sqrt(double(open) / double(kPi));
        EXPECT_NEAR(radius, 0.35 * 400 / 2.4 + 30 - 10 * double(k), 1.5) << "level " << k;
    }
    const ViewPlan off = plan_view(subject, s.view, {.depth = px(45), .steps = false});
    EXPECT_EQ(off.cut.levels.size(), 1u);
    EXPECT_TRUE(off.cut.level.empty());
    // A band too narrow for three steps that one can see makes fewer of them.
    EXPECT_EQ(plan_view(subject, s.view, {.depth = px(13)}).cut.levels.size(), 2u);
    EXPECT_EQ(plan_view(subject, s.view, {.depth = px(7)}).cut.levels.size(), 1u);
}

TEST(Cutaway, WhatEnclosesNothingIsNoLayer) {
    Shells s;
    const PartId plate = s.b.add_box("plate", {0, 0, 1.5}, {1, 1, 0.02});   // in front of all
    const PartId half = s.b.add_box("half", {0.9, 0, 0}, {0.8, 0.9, 0.45}); // around one side of the target
    const MeshBvhs meshes = build_mesh_bvhs(s.b.scene);
    const ViewPlan plan = plan_view(make_subject(meshes, std::array{s.core}), s.view, {.depth = px(30)});
    EXPECT_EQ(plan.cut.levels.size(), 3u);
    EXPECT_EQ(plan.cut.level_of(plate), 0u);
    EXPECT_EQ(plan.cut.level_of(half), 2u); // it begins behind the innermost shell
}

TEST(Cutaway, CutsAllThatHidesTargetsAndNothingBehindThem) {
    std::mt19937 random(11);
    std::uniform_real_distribution<double> u(-0.8, 0.8);
    for (int round = 0; round < 12; ++round) {
        Builder b(20);
        std::vector<PartId> targets;
        for (int i = 0; i < 3; ++i)
            targets.push_back(b.add_sphere("t" + std::to_string(i), {u(random), u(random), 0}, 0.15));
        for (int i = 0; i < 30; ++i) {
            const Vec3d c{u(random), u(random), 1.2 * u(random)}, half{0.05 + std::abs(u(random)) / 3, 0.05, 0.1};
            if (i % 2)
                b.add_box("box" + std::to_string(i), c, half);
            else
                b.add_sphere("ball" + std::to_string(i), c, 0.2);
        }
        b.add_sphere("shell", {0, 0, 0}, 1.6);
        b.add_sphere("skin", {0, 0, 0}, 1.8);
        const MeshBvhs meshes = build_mesh_bvhs(b.scene);
        const Subject subject = make_subject(meshes, targets);
        const View view = look({4.0f * float(u(random)), 2, 5}, {}, 200, 160, 0.4f, round % 3 == 0);
        for (const PlanParams& params : {PlanParams{}, PlanParams{.shape = HoleShape::hull},
                                         PlanParams{.angle_deg = 20}, PlanParams{.steps = false}}) {
            const ViewPlan plan = plan_view(subject, view, params);
            ASSERT_FALSE(plan.nothing_to_cut());
            RayHit16 rays;
            for_each_pixel(plan.hole.bounds.intersected(view.window()), [&](int x, int y) {
                if (plan.target_ids.id(x, y) == kNoPart) return;
                const Ray ray = view.ray(float(x) + 0.5f, float(y) + 0.5f);
                for (int i = 0; i < kLanes; ++i) rays.clear(i);
                rays.set(0, ray.origin, ray.direction, 0, kInfinity);
                const float target = plan.target_ids.depth(x, y);
                for_each_crossing(subject.whole, rays, [&](const Crossing& c) {
                    const float depth = c.t * ray.depth_per_t;
                    if (std::abs(depth - target) < 1e-4f) return;
                    ASSERT_EQ(is_gone(plan, x, y, c.part, double(depth)),
                              depth < target && subject.roles[index(c.part)] != CutRole::fixed)
                        << "round " << round << ' ' << b.scene.parts[index(c.part)].name << " at " << depth
                        << ", target " << target;
                });
            });
        }
    }
}

TEST(Cutaway, ANarrowerPictureShowsTheSameHole) {
    std::mt19937 random(4);
    std::uniform_real_distribution<double> u(-1, 1);
    for (int round = 0; round < 8; ++round) {
        Builder b(24);
        std::vector<PartId> targets;
        for (int i = 0; i < 12; ++i)
            targets.push_back(
                b.add_sphere("t" + std::to_string(i), {2 * u(random), 0.6 * u(random), 0.3 * u(random)}, 0.12));
        for (int i = 0; i < 12; ++i)
            b.add_box("box" + std::to_string(i), {2 * u(random), u(random), 1 + 0.3 * u(random)},
                      {0.6 + 0.5 * u(random), 0.3, 0.03});
        if (round % 2) b.add_box("lid", {0, 0, 1.6}, {6, 5, 0.05});
        const MeshBvhs meshes = build_mesh_bvhs(b.scene);
        const Subject subject = make_subject(meshes, targets);
        const View wide = look({0.3f, 0.2f, 9}, {}, 480, 120, 0.2f);
        View narrow = wide;
        narrow.width = 160; // the middle 160 columns
        const PlanParams params{.depth = px(5), .tight = Tight::open};
        const ViewPlan a = plan_view(subject, wide, params), c = plan_view(subject, narrow, params);
        ASSERT_EQ(a.closing_px, c.closing_px);
        if (c.hole.empty()) continue;
        if (a.cut_set != c.cut_set || a.cut.levels.size() != c.cut.levels.size()) continue; // asks beyond the margins
        int inside = 0;
        for_each_pixel(narrow.window(), [&](int x, int y) {
            const int wx = x + 160;
            const bool in_a = a.hole.mask.at_or(wx, y, 0), in_c = c.hole.mask.at_or(x, y, 0);
            ASSERT_EQ(in_a, in_c) << x << ',' << y;
            if (!in_a) return;
            ++inside;
            ASSERT_EQ(a.hole.distance(wx, y), c.hole.distance(x, y)) << x << ',' << y;
            for (std::size_t k = 0; k < c.cut.levels.size(); ++k)
                ASSERT_EQ(a.cut.levels[k](wx, y), c.cut.levels[k](x, y));
            ASSERT_EQ(a.cut.loose_depth(wx, y), c.cut.loose_depth(x, y));
        });
        EXPECT_GT(inside, 300);
    }
}

TEST(Cutaway, ShapesJoinTargetsAndKeepClearOfTheOutline) {
    Builder b(48);
    const std::vector<PartId> targets{b.add_sphere("left", {-0.35, 0, 0}, 0.2),
                                      b.add_sphere("right", {0.2, 0.15, 0}, 0.2)};
    b.add_box("case", {0, 0, 0}, {1, 0.6, 1});
    const MeshBvhs meshes = build_mesh_bvhs(b.scene);
    const Subject subject = make_subject(meshes, targets);
    const View view = look({0, 0, 10}, {}, 300, 300, 1.2f, true);
    std::vector<std::int64_t> pixels;
    for (const HoleShape shape : {HoleShape::silhouette, HoleShape::smooth, HoleShape::hull, HoleShape::box}) {
        const ViewPlan plan = plan_view(subject, view, {.depth = px(20), .shape = shape});
        std::int64_t n = 0;
        const Image<std::int64_t> to_outside = distance_transform([&] {
            Mask outside = plan.enclosing;
            for (std::uint8_t& m : outside.pixels()) m = !m;
            return outside;
        }());
        for_each_pixel(plan.window, [&](int x, int y) {
            const bool target = plan.target_ids.id(x, y) != kNoPart;
            if (target) {
                ASSERT_NE(plan.core.id(x, y), kNoPart);
            }
            if (plan.core.id(x, y) == kNoPart) return;
            ++n;
            if (!target) {
                ASSERT_GE(to_outside(x, y), 400);
            }
        });
        pixels.push_back(n);
    }
    for (std::size_t i = 1; i < pixels.size(); ++i) EXPECT_GT(pixels[i], pixels[i - 1] + 100);
}

TEST(Cutaway, WhatACutThingStandsOnStays) {
    // Walls on a slab: their undersides lie in the slab's top, and rounding decides which is nearer.
    Builder b;
    const PartId target = b.add_box("target", {0, 0.25, 0}, {0.5, 0.25, 0.05});
    const PartId slab = b.add_box("slab", {0, -0.1, 0}, {3, 0.1, 3});
    for (int i = 0; i < 5; ++i) b.add_box("wall" + std::to_string(i), {0, 0.3, 0.3 + 0.12 * i}, {0.8, 0.3, 0.02});
    const MeshBvhs meshes = build_mesh_bvhs(b.scene);
    const Subject subject = make_subject(meshes, std::array{target});
    const View view = look({1.7f, 3.1f, 6.3f}, {0, 0.2f, 0.3f}, 400, 300, 0.2f);
    const ViewPlan plan = plan_view(subject, view, {.depth = px(24)});
    ASSERT_FALSE(plan.nothing_to_cut());
    ASSERT_EQ(plan.cut.role[index(slab)], CutRole::loose);
    const std::array only{slab};
    const IdBuffer slab_ids = trace_ids(build_bvh(meshes, only), view, view.window());
    int asked = 0;
    for_each_pixel(plan.hole.bounds.intersected(view.window()), [&](int x, int y) {
        if (!plan.hole.mask(x, y) || plan.target_ids.id(x, y) != kNoPart || slab_ids.id(x, y) == kNoPart) return;
        ++asked;
        EXPECT_GE(slab_ids.depth(x, y), plan.cut.loose_depth(x, y)) << x << ',' << y;
    });
    EXPECT_GT(asked, 2000);
}

TEST(Cutaway, BevelsAndAnglesOutOfRangeAreRefused) {
    const Shells s;
    const MeshBvhs meshes = build_mesh_bvhs(s.b.scene);
    const Subject subject = make_subject(meshes, std::array{s.core});
    for (const PlanParams& params : {PlanParams{.bevel = px(-1)}, PlanParams{.bevel = px(5000)},
                                     PlanParams{.angle_deg = 0}, PlanParams{.angle_deg = 90}})
        EXPECT_THROW((void)plan_view(subject, s.view, params), Error);
    EXPECT_NO_THROW((void)plan_view(subject, s.view, {.bevel = px(0)}));
}

} // namespace
} // namespace porthole
