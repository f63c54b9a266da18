// Plans of constructed scenes, checked against their geometry.
#include "porthole/plan.h"

#include <gtest/gtest.h>

#include <array>
#include <random>

#include "support/shapes.h"

namespace porthole {
namespace {

using test::Builder;
using test::look;

bool same(const ViewPlan& a, const ViewPlan& b) {
    if (!(a.target_ids == b.target_ids) || !(a.hole.mask == b.hole.mask) || !(a.hole.distance == b.hole.distance))
        return false;
    if (!(a.cut.levels == b.cut.levels) || !(a.cut.loose_depth == b.cut.loose_depth)) return false;
    if (a.contours.size() != b.contours.size() || a.cut.role != b.cut.role) return false;
    for (std::size_t i = 0; i < a.contours.size(); ++i)
        if (a.contours[i].pixels != b.contours[i].pixels) return false;
    return true;
}

TEST(Plan, NestedSpheresOpenWithinHalfTheClearanceEverywhere) {
    Builder b(64);
    const PartId core = b.add_sphere("core", {0.2, 0.1, 0}, 0.4);
    b.add_sphere("shell", {0, 0, 0}, 1);
    const MeshBvhs meshes = build_mesh_bvhs(b.scene);
    const Subject subject = make_subject(meshes, std::array{core});
    const View view = look({0, 0, 10}, {}, 300, 300, 1.2f, true);
    const ViewPlan plan = plan_view(subject, view, {.depth = Length{Length::Unit::pixel, 60}});
    ASSERT_FALSE(plan.nothing_to_cut());
    ASSERT_EQ(plan.opened.size(), 1u);

    // The silhouettes are circles in pixels: 125 px to the metre.
    const double scale = 125, shell = scale, x0 = 150 + 0.2 * scale, y0 = 150 - 0.1 * scale;
    double widest = 0;
    for (const BandPixel& c : plan.hole.band) {
        EXPECT_TRUE(c.covered);
        const double to_center = std::hypot(c.pixel.x + 0.5 - 150, c.pixel.y + 0.5 - 150);
        const double clearance = shell - to_center;
        EXPECT_NEAR(c.clearance_px, clearance, 1.5);
        EXPECT_NEAR(c.width_px, std::min(60.0, clearance / 3), 0.6);
        widest = std::max(widest, double(c.width_px));
    }
    EXPECT_GT(widest, 20);
    // k <= d / 2: a band pixel k away from the target is at least 2 k away from the outside.
    for (int y = plan.window.y0; y < plan.window.y1; ++y)
        for (int x = plan.window.x0; x < plan.window.x1; ++x) {
            if (!plan.hole.mask(x, y) || plan.target_ids.id(x, y) != kNoPart) continue;
            const double k = std::hypot(x + 0.5 - x0, y + 0.5 - y0) - 0.4 * scale;
            const double d = shell - std::hypot(x + 0.5 - 150, y + 0.5 - 150);
            EXPECT_LE(k, d / 2 + 1.5) << x << ',' << y;
        }
}

TEST(Plan, TangentSpheresAreRefusedByThePaperAndOpenedAsACrescentByDefault) {
    Builder b(96);
    const PartId inner = b.add_sphere("inner", {0.6, 0, 0}, 0.4);
    b.add_sphere("outer", {0, 0, 0}, 1);
    const MeshBvhs meshes = build_mesh_bvhs(b.scene);
    const Subject subject = make_subject(meshes, std::array{inner});
    const View view = look({0, 0, 10}, {}, 300, 300, 1.2f, true);

    const ViewPlan paper = plan_view(subject, view, {.style = HoleStyle::paper});
    EXPECT_TRUE(paper.nothing_revealed());
    ASSERT_EQ(paper.targets.size(), 1u);
    EXPECT_TRUE(paper.targets[0].refused);

    const ViewPlan plan = plan_view(subject, view, {.depth = Length{Length::Unit::pixel, 20}});
    ASSERT_FALSE(plan.nothing_revealed());
    // From the geometry: a contour point at angle a from the point of contact lies
    // 1 - |(0.6, 0) + 0.4 (cos a, sin a)| inside the outer circle.
    for (const BandPixel& c : plan.hole.band) {
        const double a = std::atan2(150 - (c.pixel.y + 0.5), c.pixel.x + 0.5 - 225);
        const double clearance = 125 * (1 - std::hypot(0.6 + 0.4 * std::cos(a), 0.4 * std::sin(a)));
        EXPECT_NEAR(c.width_px, std::min(20.0, clearance / 3), 0.8) << "angle " << a;
    }
    // Nothing of the band lies outside the outer circle.
    for (int y = plan.window.y0; y < plan.window.y1; ++y)
        for (int x = plan.window.x0; x < plan.window.x1; ++x) {
            if (plan.hole.mask(x, y) && plan.target_ids.id(x, y) == kNoPart) {
                EXPECT_LT(std::hypot(x + 0.5 - 150, y + 0.5 - 150), 125.7);
            }
        }
}

TEST(Plan, TargetThatFillsItsShellIsRefused) {
    Builder b(96);
    const PartId inner = b.add_sphere("inner", {0, 0, 0}, 0.99);
    b.add_sphere("outer", {0, 0, 0}, 1);
    const MeshBvhs meshes = build_mesh_bvhs(b.scene);
    const Subject subject = make_subject(meshes, std::array{inner});
    const View view = look({0, 0, 10}, {}, 300, 300, 1.2f, true);
    const ViewPlan plan = plan_view(subject, view);
    EXPECT_TRUE(plan.nothing_revealed());
    EXPECT_TRUE(plan.targets[0].refused);
    const ViewPlan forced = plan_view(subject, view, {.tight = Tight::open});
    EXPECT_FALSE(forced.nothing_revealed());
    EXPECT_FALSE(forced.nothing_to_cut());
}

TEST(Plan, FloorUnderABoxStaysAndABoltOnTheLidGoes) {
    Builder b;
    const PartId target = b.add_sphere("target", {0, 0.5, 0}, 0.35);
    const PartId floor = b.add_box("floor", {0, -0.1, 0}, {6, 0.1, 6});
    b.add_box("wall_left", {-1, 0.5, 0}, {0.05, 0.5, 1});
    b.add_box("wall_right", {1, 0.5, 0}, {0.05, 0.5, 1});
    b.add_box("wall_front", {0, 0.5, 1}, {1, 0.5, 0.05});
    b.add_box("wall_back", {0, 0.5, -1}, {1, 0.5, 0.05});
    const PartId lid = b.add_box("lid", {0, 1.05, 0}, {1.1, 0.05, 1.1});
    // On the lid, beside the target's silhouette but within the band.
    const PartId bolt = b.add_sphere("bolt", {0.47, 1.1, 0.1}, 0.05);
    const MeshBvhs meshes = build_mesh_bvhs(b.scene);
    const Subject subject = make_subject(meshes, std::array{target});
    const View view = look({0, 8, 1.5f}, {0, 0.5f, 0}, 400, 400, 0.25f);
    const ViewPlan plan = plan_view(subject, view, {.depth = Length{Length::Unit::pixel, 40}});
    ASSERT_FALSE(plan.nothing_to_cut());

    EXPECT_EQ(plan.cut.role[index(lid)], CutRole::cut_set);
    EXPECT_EQ(plan.cut.role[index(bolt)], CutRole::loose);
    EXPECT_EQ(plan.cut.role[index(floor)], CutRole::loose);

    // Every point of the bolt inside the hole is gone, no point of the floor is.
    const IdBuffer before = trace_ids(subject.whole, view, view.window());
    int bolt_pixels = 0, floor_pixels = 0;
    const std::array only_floor{floor};
    const IdBuffer floor_ids = trace_ids(build_bvh(meshes, only_floor), view, view.window());
    const Rect box = plan.window.intersected(view.window());
    for (int y = box.y0; y < box.y1; ++y)
        for (int x = box.x0; x < box.x1; ++x) {
            if (!plan.hole.mask(x, y)) continue;
            const Ray ray = view.ray(float(x) + 0.5f, float(y) + 0.5f);
            const auto point = [&](float depth) { return ray.origin + ray.direction * (depth / ray.depth_per_t); };
            if (before.id(x, y) == bolt) {
                ++bolt_pixels;
                EXPECT_TRUE(plan.cut.removes(point(before.depth(x, y)), bolt));
            }
            ++floor_pixels;
            EXPECT_FALSE(plan.cut.removes(point(floor_ids.depth(x, y)), floor));
        }
    EXPECT_GT(bolt_pixels, 20);
    EXPECT_GT(floor_pixels, 1000);
}

TEST(Plan, KeptPartsAreFixedAndCutOnlyLimits) {
    Builder b;
    const PartId target = b.add_sphere("target", {0, 0, 0}, 0.3);
    const PartId inner = b.add_sphere("inner", {0, 0, 0}, 0.6);
    const PartId outer = b.add_sphere("outer", {0, 0, 0}, 1.0);
    const MeshBvhs meshes = build_mesh_bvhs(b.scene);
    const View view = look({0, 0, 10}, {}, 200, 200, 1.2f, true);
    const auto cut_set = [&](std::vector<PartId> keep, std::vector<PartId> only) {
        return plan_view(make_subject(meshes, std::array{target}, keep, only), view).cut_set;
    };
    EXPECT_EQ(cut_set({}, {}), (std::vector{inner, outer}));
    EXPECT_EQ(cut_set({outer}, {}), (std::vector{inner}));
    EXPECT_EQ(cut_set({}, {outer}), (std::vector{outer}));
    EXPECT_EQ(cut_set({outer}, {outer}), (std::vector<PartId>{}));
    EXPECT_EQ(cut_set({target}, {target, inner}), (std::vector{inner}));
}

TEST(Plan, SurfaceOnTheTargetCountsAsBehindIt) {
    Builder b;
    const PartId target = b.add_box("target", {0, 0, 0}, {0.5, 0.5, 0.5});
    b.add_box("twin", {0, 0, 0}, {0.5, 0.5, 0.5});
    const MeshBvhs meshes = build_mesh_bvhs(b.scene);
    const ViewPlan plan = plan_view(make_subject(meshes, std::array{target}), look({2, 3, 4}, {}, 120, 120, 0.3f));
    EXPECT_TRUE(plan.nothing_to_cut());
    EXPECT_TRUE(plan.cut_set.empty());
}

TEST(Plan, AbsentAndVisibleTargets) {
    Builder b;
    const PartId visible = b.add_sphere("visible", {0, 0, 0}, 0.5);
    const PartId beside = b.add_sphere("beside", {50, 0, 0}, 0.5);
    const PartId behind = b.add_sphere("behind the eye", {0, 0, 20}, 0.5);
    const MeshBvhs meshes = build_mesh_bvhs(b.scene);
    const View view = look({0, 0, 10}, {}, 100, 100, 0.2f);
    const ViewPlan plan = plan_view(make_subject(meshes, std::array{visible, beside, behind}), view);
    ASSERT_EQ(plan.targets.size(), 3u);
    EXPECT_FALSE(plan.targets[0].absent);
    EXPECT_TRUE(plan.targets[1].absent);
    EXPECT_TRUE(plan.targets[2].absent);
    EXPECT_TRUE(plan.nothing_to_cut());
    EXPECT_FALSE(plan.nothing_revealed());
    EXPECT_TRUE(plan_view(make_subject(meshes, std::array{beside}), view).nothing_revealed());
}

TEST(Plan, ThinTargetsAreFoundBetweenPixelCentres) {
    Builder b;
    const PartId dot = b.add_sphere("dot", {0.012, 0.012, 0}, 0.004); // 0.4 px wide, off the centres
    b.add_sphere("shell", {0, 0, 0}, 1);
    const MeshBvhs meshes = build_mesh_bvhs(b.scene);
    const View view = look({0, 0, 10}, {}, 120, 120, 1.2f, true);
    const ViewPlan plan = plan_view(make_subject(meshes, std::array{dot}), view);
    ASSERT_EQ(plan.targets.size(), 1u);
    EXPECT_TRUE(plan.targets[0].thin);
    EXPECT_FALSE(plan.targets[0].absent);
    EXPECT_GE(plan.targets[0].fine_samples, 1);
    EXPECT_FALSE(plan.nothing_to_cut());
}

TEST(Plan, ExactEqualsFullAndThreadsDoNotMatter) {
    Builder b(16);
    std::mt19937 random(9);
    std::uniform_real_distribution<double> u(-0.6, 0.6);
    std::vector<PartId> targets;
    for (int i = 0; i < 24; ++i) {
        const Vec3d c{u(random), u(random), u(random)};
        // Balls, wires about a pixel wide, and specks below the pixel.
        if (i % 3 == 0) targets.push_back(b.add_sphere("ball" + std::to_string(i), c, 0.08));
        if (i % 3 == 1) targets.push_back(b.add_box("wire" + std::to_string(i), c, {0.4, 0.004, 0.004}));
        if (i % 3 == 2) targets.push_back(b.add_sphere("speck" + std::to_string(i), c, 0.003));
    }
    b.add_sphere("shell", {0, 0, 0}, 1.5);
    const MeshBvhs meshes = build_mesh_bvhs(b.scene);
    const Subject subject = make_subject(meshes, targets);
    std::normal_distribution<float> normal;
    for (int k = 0; k < 32; ++k) {
        const Vec3f direction = normalize(Vec3f{normal(random), normal(random), normal(random)});
        const View view = look(direction * 5.0f, {}, 161, 120, 0.4f);
        const ViewPlan exact = plan_view(subject, view, {}, test::with_threads(1 + k % 7));
        const ViewPlan full = plan_view(subject, view, {.contours = ContourMethod::full}, test::with_threads(2));
        EXPECT_TRUE(same(exact, full)) << "direction " << k;
        EXPECT_LT(exact.rays.targets, full.rays.targets);
        const IdBuffer ids = trace_ids(subject.whole, view, view.window());
        const ViewPlan helped = plan_view(subject, view, {}, {}, &ids);
        EXPECT_TRUE(same(exact, helped) && exact.enclosing == helped.enclosing) << "direction " << k;
        EXPECT_LT(helped.rays.enclosing, exact.rays.enclosing);
    }
}

/// Half a turn of a wire around the view's axis behind a large plate.
ViewPlan plan_arc(double radius, double half_width, const PlanParams& params = {}) {
    Builder b;
    std::vector<PartId> beads;
    const int n = int(8 * radius / half_width);
    for (int i = 0; i <= n; ++i) {
        const double a = double(kPi) * i / n;
        beads.push_back(b.add_box("bead" + std::to_string(i), {radius * std::cos(a), radius * std::sin(a), 0},
                                  {half_width, half_width, half_width}));
    }
    b.add_box("plate", {0, 0, 1}, {5, 5, 0.1});
    const MeshBvhs meshes = build_mesh_bvhs(b.scene);
    return plan_view(make_subject(meshes, beads), look({0, 0, 10}, {}, 300, 300, 1.5f, true), params);
}

TEST(Cutaway, ThinLinesGetANarrowBandUnlessOneIsAskedFor) {
    EXPECT_EQ(plan_arc(0.8, 0.006).depth_px, 9);  // some 1.5 px wide, 3 % of 300
    EXPECT_EQ(plan_arc(0.8, 0.04).depth_px, 15);  // 8 px wide
    EXPECT_EQ(plan_arc(0.05, 0.01).depth_px, 15); // a dot
    EXPECT_EQ(plan_arc(0.8, 0.006, {.depth = Length{}}).depth_px, 15);
    EXPECT_EQ(plan_arc(0.8, 0.006, {.style = HoleStyle::hole}).depth_px, 15);
    const ViewPlan plan = plan_arc(0.8, 0.006);
    float widest = 0;
    for (const BandPixel& c : plan.hole.band) widest = std::max(widest, c.width_px);
    EXPECT_EQ(widest, 9);
}

TEST(Cutaway, ClosingThatBlowsTargetsUpIsHalved) {
    // A solid target keeps the radius; the arc's bay, 12 % of the height being 36 px, is narrower
    // than twice that and would be filled.
    const int wanted = 36;
    EXPECT_EQ(plan_arc(0.3, 0.2).closing_px, wanted);
    const ViewPlan thin = plan_arc(0.25, 0.01);
    EXPECT_LT(thin.closing_px, wanted);
    EXPECT_EQ(wanted % std::max(1, thin.closing_px), 0);
    const auto count = [](const Image<PartId>& ids) {
        return std::count_if(ids.pixels().begin(), ids.pixels().end(), [](PartId id) { return id != kNoPart; });
    };
    const std::int64_t own = count(thin.target_ids.id);
    EXPECT_LE(count(thin.core.id) - own, 2 * own);
}

TEST(Cutaway, ChamferInAPlateIsAsWideAsThePlateIsThick) {
    Builder b;
    const PartId target = b.add_box("target", {0, 0, 0}, {0.3, 0.3, 0.3});
    b.add_box("plate", {0, 0, 2}, {1.1, 1.1, 0.05});
    b.add_box("wall", {0, 0, -2}, {1.1, 1.1, 0.05});
    const MeshBvhs meshes = build_mesh_bvhs(b.scene);
    const Subject subject = make_subject(meshes, std::array{target});
    const View view = look({0, 0, 10}, {}, 240, 240, 1.2f, true); // 100 px to the metre
    PlanParams params{.depth = Length{Length::Unit::pixel, 25}};
    const auto profiles = [&](auto&& expect) {
        const ViewPlan plan = plan_view(subject, view, params);
        ASSERT_EQ(plan.cut.levels.size(), 1u);
        for (const int x : {152, 158, 164, 170, 174}) { // right of the target, whose last column is 149
            const float inside = -plan.cut.distance(x, 120);
            EXPECT_NEAR(inside, 150 + 25 - (x + 0.5), 1);
            const CutProfile& p = plan.cut.levels[0](x, 120);
            EXPECT_NEAR(p.start, 0, 1e-3);
            if (p.width > 0) {
                EXPECT_NEAR(p.front, 10 - 2.05, 1e-3);
            }
            EXPECT_NEAR(p.floor, 10 - 0.3, 1e-3);
            expect(p, inside);
        }
    };
    profiles([](const CutProfile& p, float inside) {
        EXPECT_NEAR(p.width, 11, 0.05); // 1.1 times 0.1 m
        EXPECT_NEAR(p.slope * p.width, 0.11, 1e-3);
        EXPECT_NEAR(p.depth(inside), inside < p.width ? 10 - 2.05 + 0.01 * inside : 10 - 0.3, 2e-3);
    });
    params.bevel = Length{Length::Unit::pixel, 6};
    profiles([](const CutProfile& p, float) {
        EXPECT_NEAR(p.width, 6, 1e-3);
        EXPECT_NEAR(p.slope * p.width, 0.11, 1e-3);
    });
    params.bevel = Length{Length::Unit::pixel, 0};
    profiles([](const CutProfile& p, float inside) {
        EXPECT_EQ(p.width, 0);
        EXPECT_NEAR(p.depth(inside), 10 - 0.3, 1e-3);
    });
    params.bevel.reset();
    params.angle_deg = 30;
    profiles([](const CutProfile& p, float) {
        EXPECT_GT(p.width, 20);
        EXPECT_NEAR(p.slope, 0.01 / std::tan(double(kPi) / 6), 1e-4);
    });
}

TEST(Cutaway, ChamferInASphericalShellFollowsIt) {
    Builder b(96);
    const PartId target = b.add_sphere("target", {0, 0, 0}, 0.3);
    b.add_sphere("inner", {0, 0, 0}, 0.92);
    b.add_sphere("outer", {0, 0, 0}, 1);
    const MeshBvhs meshes = build_mesh_bvhs(b.scene);
    const View view = look({0, 0, 10}, {}, 300, 300, 1.2f, true); // 125 px to the metre
    const ViewPlan plan = plan_view(make_subject(meshes, std::array{target}), view, {.steps = false});
    ASSERT_EQ(plan.cut.levels.size(), 1u);
    int pixels = 0;
    for (int y = 80; y < 220; ++y)
        for (int x = 80; x < 220; ++x) {
            if (!plan.hole.mask(x, y) || plan.target_ids.id(x, y) != kNoPart) continue;
            const double away2 = (std::pow(x + 0.5 - 150, 2) + std::pow(y + 0.5 - 150, 2)) / (125 * 125);
            const double front = 10 - std::sqrt(1 - away2), next = 10 - std::sqrt(0.92 * 0.92 - away2);
            const CutProfile& p = plan.cut.levels[0](x, y);
            EXPECT_NEAR(p.front, front, 0.02);
            EXPECT_NEAR(p.slope * p.width, 1.1 * (next - front), 0.01);
            EXPECT_LE(p.width, 0.6 * 15 + 1e-3);
            EXPECT_LE(p.depth(-plan.cut.distance(x, y)), p.floor);
            ++pixels;
        }
    EXPECT_GT(pixels, 2000);
}

TEST(Cutaway, ShellsOpenOneStepAfterTheOther) {
    Builder b(48);
    const PartId target = b.add_sphere("target", {0, 0, 0}, 0.2);
    const PartId brain = b.add_sphere("brain", {0, 0, 0}, 0.5);
    const PartId skull = b.add_sphere("skull", {0, 0, 0}, 0.75);
    const PartId skin = b.add_sphere("skin", {0, 0, 0}, 1);
    const PartId tumour = b.add_sphere("tumour", {0, 0, 0.35}, 0.1); // in the brain, before the target
    const MeshBvhs meshes = build_mesh_bvhs(b.scene);
    const Subject subject = make_subject(meshes, std::array{target});
    const View view = look({0, 0, 10}, {}, 300, 300, 1.2f, true);
    PlanParams params{.depth = Length{Length::Unit::pixel, 30}};
    const ViewPlan plan = plan_view(subject, view, params);
    ASSERT_EQ(plan.cut.levels.size(), 3u);
    EXPECT_EQ(plan.cut.level_of(skin), 0u);
    EXPECT_EQ(plan.cut.level_of(skull), 1u);
    EXPECT_EQ(plan.cut.level_of(brain), 2u);
    EXPECT_EQ(plan.cut.level_of(tumour), 2u);
    // Right of the target, which ends at 175: three steps of 10 px from the rim at 205 inward.
    for (const int x : {178, 186, 190, 196, 202})
        for (std::size_t k = 0; k < 3; ++k) {
            const CutProfile& p = plan.cut.levels[k](x, 150);
            const float inside = -plan.cut.distance(x, 150);
            EXPECT_NEAR(p.start, 10.0 * double(k), 0.3);
            EXPECT_EQ(p.depth(inside) > -kInfinity, inside >= p.start) << x << " level " << k;
            EXPECT_LE(p.width, 6 + 0.2);
        }
    // On the target all of them are gone.
    for (std::size_t k = 0; k < 3; ++k)
        EXPECT_NEAR(plan.cut.levels[k](150, 150).depth(-plan.cut.distance(150, 150)), 10 - 0.2, 2e-3);

    params.steps = false;
    EXPECT_EQ(plan_view(subject, view, params).cut.levels.size(), 1u);
}

} // namespace
} // namespace porthole
