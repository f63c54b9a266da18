// Ghosts and restyled surroundings on constructed scenes.
#include <gtest/gtest.h>

#include "porthole/reveal.h"
#include "support/shapes.h"

namespace porthole {
namespace {

using test::Builder;
using test::look;

/// A ball in a shell, a smaller shell beside it that hides nothing, and a plate behind both.
struct Nested {
    Builder b{48};
    PartId core, shell, other, plate;
    MeshBvhs meshes;
    RevealParams params;

    Nested()
        : core(b.add_sphere("core", {0.2, 0.1, 0}, 0.4)), shell(b.add_sphere("shell", {0, 0, 0}, 1)),
          other(b.add_sphere("other", {1.7, -0.3, 0}, 0.5)), plate(b.add_box("plate", {-1.5, 0, -2}, {1, 0.8, 0.1})),
          meshes(build_mesh_bvhs(b.scene)) {
        params.targets = {core};
        params.view = look({0, 0, 10}, {}, 320, 240, 1.3f, true);
        params.render.ao_samples = 2;
    }
    [[nodiscard]] Revealed draw() const { return reveal(meshes, params); }
    [[nodiscard]] Frame plain() const {
        const Bvh whole = build_bvh(meshes, all_parts(b.scene));
        return render_plain(meshes, whole, *params.view, params);
    }
};

TEST(Ghost, TheTargetIsThePictureWithoutWhatHidesIt) {
    Nested n;
    n.params.plan.style = HoleStyle::ghost;
    const Revealed r = n.draw();
    EXPECT_TRUE(r.plan.ghost);
    EXPECT_EQ(r.plan.cut_set, std::vector<PartId>{n.shell});
    const std::vector<PartId> left{n.core, n.other, n.plate};
    const Bvh solid = build_bvh(n.meshes, left), targets = build_bvh(n.meshes, n.params.targets);
    const Frame without = render(solid, &targets, *n.params.view, n.params.render, nullptr, nullptr);
    int seen = 0, of_target = 0, untouched = 0, whole = 0;
    for (int y = 0; y < 240; ++y)
        for (int x = 0; x < 320; ++x) {
            const float to_shell = std::hypot(float(x) + 0.5f - 160, float(y) + 0.5f - 120) * 2.6f / 240;
            of_target += without.ids.id(x, y) == n.core;
            if (without.ids.id(x, y) == n.core) {
                seen += r.frame.ids.id(x, y) == n.core;
                // At its border a pixel shows the shell beside it, too.
                if (without.color(x, y).w == 1) {
                    EXPECT_EQ(r.frame.color(x, y), without.color(x, y)) << x << ' ' << y;
                    ++whole;
                }
            } else if (to_shell > 1.02f) {
                ++untouched;
                EXPECT_EQ(r.frame.color(x, y), without.color(x, y)) << x << ' ' << y;
            }
        }
    EXPECT_GT(of_target, 1500);
    EXPECT_EQ(seen, of_target);
    EXPECT_GT(whole, of_target * 9 / 10);
    EXPECT_GT(untouched, 20000);
    ASSERT_EQ(r.report.targets.size(), 1u);
    EXPECT_EQ(r.report.targets[0].visible_after, 1.0);
    EXPECT_EQ(r.report.targets[0].visible_before, 0.0);
}

TEST(Ghost, TheVeilGetsDenserTowardsTheOutlineWhichStays) {
    Nested n;
    n.params.plan.style = HoleStyle::ghost;
    n.params.render.lines = Lines::none;
    const Revealed r = n.draw();
    // Up from the shell's middle, over the background.
    float last = 0;
    for (int y = 119 - 48; y > 119 - 91; --y) {
        const float alpha = r.frame.color(160, y).w;
        ASSERT_EQ(r.frame.ids.id(160, y), n.shell);
        EXPECT_GE(alpha, last - 1e-4f) << y;
        last = alpha;
    }
    EXPECT_LT(r.frame.color(120, 140).w, 0.2f);
    EXPECT_GT(last, 0.35f);
    const Frame plain = n.plain();
    for (std::size_t i = 0; i < plain.ids.id.pixels().size(); ++i)
        EXPECT_EQ(plain.ids.id.pixels()[i] == kNoPart, r.frame.ids.id.pixels()[i] == kNoPart);
    EXPECT_EQ(r.report.picture.outline_iou, 1.0);
    EXPECT_EQ(r.report.picture.see_through_px, 0);

    // With its lines the outline is darker, and nothing else of the ball is.
    n.params.render.lines = Lines::rim;
    const Revealed lined = n.draw();
    int darker = 0;
    for (int y = 0; y < 240; ++y)
        for (int x = 0; x < 160; ++x) {
            if (lined.frame.color(x, y) == r.frame.color(x, y)) continue;
            ++darker;
            EXPECT_NEAR(std::hypot(double(x) + 0.5 - 160, double(y) + 0.5 - 120), 240 / 2.6, 2.0) << x << ' ' << y;
        }
    EXPECT_GT(darker, 250);
}

TEST(Ghost, LightGetsIn) {
    Nested n;
    n.params.plan.style = HoleStyle::hole;
    n.params.render.emphasis = Emphasis::none;
    n.params.plan.style = HoleStyle::ghost;
    const Revealed r = n.draw();
    // The ball's lit side is as bright as if nothing were around it.
    const std::vector<PartId> alone{n.core};
    const Bvh bare = build_bvh(n.meshes, alone);
    const Frame free = render(bare, nullptr, *n.params.view, n.params.render, nullptr, nullptr);
    const PixelPoint p = n.params.view->project({0.1f, 0.3f, 0.35f});
    EXPECT_NEAR(r.frame.color(int(p.x), int(p.y)).y, free.color(int(p.x), int(p.y)).y, 0.02f);
}

TEST(Ghost, ASecondShellInsideIsSeenTooAndThreadsDoNotMatter) {
    Nested n;
    n.b.add_sphere("middle", {0.1, 0.05, 0}, 0.7);
    n.meshes = build_mesh_bvhs(n.b.scene);
    n.params.plan.style = HoleStyle::ghost;
    const auto draw = [&](int threads) { return reveal(n.meshes, n.params, test::with_threads(threads)); };
    const Revealed one = draw(1);
    EXPECT_EQ(one.plan.cut_set.size(), 2u);
    EXPECT_EQ(one.frame.color, draw(3).frame.color);
    // Just inside the outline of the inner shell the veil is denser than just outside.
    const PixelPoint p = n.params.view->project({0.1f, 0.75f, 0});
    const int x = int(p.x), y = int(p.y);
    EXPECT_EQ(one.frame.ids.id(x, y - 3), n.shell);
    EXPECT_GT(one.frame.color(x, y + 4).w, one.frame.color(x, y - 5).w + 0.1f);
}

TEST(Ghost, StandsInForARefusedTarget) {
    // Tangent spheres: no room for a band on one side; the paper refuses.
    Builder b(64);
    const PartId inner = b.add_sphere("inner", {0.6, 0, 0}, 0.4);
    b.add_sphere("outer", {0, 0, 0}, 1);
    const MeshBvhs meshes = build_mesh_bvhs(b.scene);
    RevealParams params;
    params.targets = {inner};
    params.view = look({0, 0, 10}, {}, 200, 200, 1.2f, true);
    params.plan.style = HoleStyle::paper;
    EXPECT_TRUE(reveal(meshes, params).plan.nothing_revealed());
    params.plan.tight = Tight::ghost;
    const Revealed r = reveal(meshes, params);
    EXPECT_TRUE(r.plan.ghost);
    EXPECT_EQ(r.plan.opened, std::vector<PartId>{inner});
    EXPECT_EQ(r.report.targets[0].visible_after, 1.0);
    EXPECT_EQ(r.report.targets[0].refused, "");
    // Where there is room it changes nothing.
    Nested n;
    const Revealed usual = n.draw();
    n.params.plan.tight = Tight::ghost;
    EXPECT_FALSE(n.draw().plan.ghost);
    EXPECT_EQ(n.draw().frame.color, usual.frame.color);
}

TEST(Rest, DimsOnlyWhatIsNeitherTargetNorCut) {
    Nested n;
    const Revealed kept = n.draw();
    n.params.rest = Rest::dim;
    const Revealed dim = n.draw();
    EXPECT_EQ(dim.frame.ids, kept.frame.ids);
    const auto spread = [](Vec4f c) { return std::max({c.x, c.y, c.z}) - std::min({c.x, c.y, c.z}); };
    int changed = 0, same = 0;
    for (int y = 2; y < 238; ++y)
        for (int x = 2; x < 318; ++x) {
            const PartId id = kept.frame.ids.id(x, y);
            bool inner = true;
            for (int dy = -2; dy <= 2; ++dy)
                for (int dx = -2; dx <= 2; ++dx) inner &= kept.frame.ids.id(x + dx, y + dy) == id;
            if (!inner) continue;
            const Vec4f a = kept.frame.color(x, y), b = dim.frame.color(x, y);
            if (id == n.other || id == n.plate) {
                ++changed;
                EXPECT_NEAR(b.y, 0.75f * a.y + 0.25f * 0.72f, 0.02f);
                EXPECT_LE(spread(b), spread(a) * 0.55f + 0.02f);
            } else {
                ++same;
                EXPECT_EQ(a, b);
            }
        }
    EXPECT_GT(changed, 5000);
    EXPECT_GT(same, 15000);
}

TEST(Rest, KeptPartsStayAsTheyAre) {
    Nested n;
    n.params.keep = {n.plate};
    const Revealed kept = n.draw();
    for (const Rest rest : {Rest::dim, Rest::line, Rest::ghost}) {
        n.params.rest = rest;
        const Revealed r = n.draw();
        const PixelPoint p = n.params.view->project({-1.4f, 0.2f, -1.9f}),
                         q = n.params.view->project({1.7f, -0.3f, 0.5f});
        EXPECT_EQ(r.frame.color(int(p.x), int(p.y)), kept.frame.color(int(p.x), int(p.y)));
        EXPECT_NE(r.frame.color(int(q.x), int(q.y)), kept.frame.color(int(q.x), int(q.y)));
    }
}

TEST(Rest, LinesLeaveTheBackgroundBetweenThem) {
    Nested n;
    n.params.rest = Rest::line;
    const Revealed r = n.draw();
    int empty = 0, drawn = 0;
    for (int y = 0; y < 240; ++y)
        for (int x = 0; x < 320; ++x) {
            if (r.frame.ids.id(x, y) != n.other) continue;
            const double d =
                std::hypot(double(x) + 0.5 - 160 - 1.7 * 240 / 2.6, double(y) + 0.5 - 120 - 0.3 * 240 / 2.6);
            if (d < 0.5 * 240 / 2.6 - 2.5) {
                ++empty;
                EXPECT_EQ(r.frame.color(x, y), Vec4f{}) << x << ' ' << y;
            } else {
                drawn += r.frame.color(x, y).w > 0.2f;
            }
        }
    EXPECT_GT(empty, 1500);
    EXPECT_GT(drawn, 60);
}

TEST(Rest, GhostsOfTheRestLeaveTheHoleAsItIs) {
    Nested n;
    const Revealed kept = n.draw();
    n.params.rest = Rest::ghost;
    const Revealed r = n.draw();
    EXPECT_EQ(r.plan.hole.mask, kept.plan.hole.mask);
    EXPECT_EQ(r.report.picture.outline_iou, kept.report.picture.outline_iou);
    EXPECT_EQ(r.report.targets[0].visible_after, 1.0);
    const PixelPoint p = n.params.view->project({1.7f, -0.3f, 0.5f});
    EXPECT_EQ(r.frame.ids.id(int(p.x), int(p.y)), n.other);
    EXPECT_LT(r.frame.color(int(p.x), int(p.y)).w, 0.3f);
    // What stands before the target's middle is gone in both; the shell is solid in both.
    const PixelPoint s = n.params.view->project({-0.6f, -0.4f, 0.7f});
    EXPECT_EQ(r.frame.color(int(s.x), int(s.y)).w, 1);
}

TEST(Styles, NoOptionChangesAPlainPicture) {
    // A target that nothing hides: every style gives the plain picture, restyled or not.
    Nested n;
    n.params.targets = {n.shell};
    n.params.plan.style = HoleStyle::ghost;
    const Revealed r = n.draw();
    EXPECT_TRUE(r.plan.nothing_to_cut());
    EXPECT_EQ(r.frame.color, n.plain().color);
}

} // namespace
} // namespace porthole
