#include <gtest/gtest.h>

#include <cmath>

#include "porthole/render/render.h"
#include "porthole/render/test_frame.h"
#include "porthole/render/test_scene.h"

namespace porthole {
namespace {

using test::add_part;
using test::box_mesh;
using test::look_at;
using test::matte;
using test::quad_mesh;
using test::same_bits;
using test::same_color;

// A box inside a box; the hole is a disc, made by hand.
struct BoxInBox {
    Scene scene;
    PartId outer, inner, bolt, floor;
    std::vector<CutRole> role;
    View view;
    Cut cut;

    BoxInBox() {
        scene.materials = {matte({0.7f, 0.7f, 0.72f}), matte({0.72f, 0.7f, 0.7f}), matte({0.3f, 0.5f, 0.3f})};
        outer = add_part(scene, box_mesh({-1, -1, -1}, {1, 1, 1}, 0), "outer");
        inner = add_part(scene, box_mesh({-0.3f, -0.3f, -0.3f}, {0.3f, 0.3f, 0.3f}, 1), "inner");
        bolt = add_part(scene, box_mesh({-0.1f, 0.3f, 1}, {0.1f, 0.5f, 1.1f}, 2), "bolt");
        floor = add_part(scene, quad_mesh({-4, -1.01f, 4}, {8, 0, 0}, {0, 0, -8}, 2), "floor");
        role = {CutRole::cut_set, CutRole::fixed, CutRole::loose, CutRole::loose};
        view = look_at({0.5f, 0.8f, 5}, {0, 0, 0}, 160, 120, 0.3f);
        // A disc of 30 pixels around the middle; floor depth: that of the inner box's front, flat.
        cut.view = view;
        cut.role = role;
        const Rect window{45, 25, 115, 95};
        cut.distance = Image<float>(window);
        cut.levels.emplace_back(window, CutProfile{.floor = 4.6f});
        cut.loose_depth = Image<float>(window, 4.3f);
        for (int y = window.y0; y < window.y1; ++y)
            for (int x = window.x0; x < window.x1; ++x) {
                cut.distance(x, y) = std::hypot(float(x) - 79.5f, float(y) - 59.5f) - 30.0f;
            }
    }
};

struct OpenedBox : BoxInBox {
    MeshBvhs meshes;
    Bvh whole, targets;
    OpenedBox()
        : meshes(build_mesh_bvhs(scene)), whole(build_bvh(meshes, all_parts(scene), role)),
          targets(build_bvh(meshes, std::vector<PartId>{inner})) {}
    OpenedBox(const OpenedBox&) = delete;
    OpenedBox& operator=(const OpenedBox&) = delete;
};

TEST(RenderCut, WhatTheHoleCoversNeedNotBeDrawnBefore) {
    const OpenedBox b;
    for (RenderParams params : {RenderParams{}, RenderParams{.samples = 1}, RenderParams{.lines = Lines::all}}) {
        params.refine = Refine::full;
        const Frame plain = render(b.whole, nullptr, b.view, params, nullptr, nullptr);
        const Frame around = render_around(b.whole, b.view, params, b.cut);
        EXPECT_EQ(around.ids, plain.ids);
        EXPECT_LT(around.rays.shadow, plain.rays.shadow * 9 / 10);
        const Frame over_plain = render(b.whole, &b.targets, b.view, params, &b.cut, &plain);
        const Frame over_around = render(b.whole, &b.targets, b.view, params, &b.cut, &around);
        EXPECT_EQ(over_around.color, over_plain.color);
        EXPECT_EQ(over_around.ids, over_plain.ids);
    }
}

class RenderCutBy : public testing::TestWithParam<Refine> {};
INSTANTIATE_TEST_SUITE_P(Ways, RenderCutBy, testing::Values(Refine::full, Refine::adaptive));

TEST_P(RenderCutBy, OutsideTheHoleThePictureIsThePlainOneBitForBit) {
    const OpenedBox b;
    const RenderParams params{.refine = GetParam()};
    const Frame plain = render(b.whole, nullptr, b.view, params, nullptr, nullptr);
    const Frame open = render(b.whole, &b.targets, b.view, params, &b.cut, &plain);
    int inside = 0, changed = 0, rim = 0;
    for (int y = 0; y < b.view.height; ++y)
        for (int x = 0; x < b.view.width; ++x) {
            // No sample of a pixel whose centre is farther than its diagonal lies in the hole.
            const float d = std::hypot(float(x) - 79.5f, float(y) - 59.5f) - 30.0f;
            const bool same = same_color(plain.color(x, y), open.color(x, y));
            if (d > 0.8f) {
                EXPECT_TRUE(same) << x << ' ' << y;
                EXPECT_EQ(plain.ids.id(x, y), open.ids.id(x, y));
                // Of what was inferred the ids around the hole are traced.
                if (plain.inferred.empty() || !plain.inferred(x, y)) {
                    EXPECT_EQ(plain.ids.depth(x, y), open.ids.depth(x, y));
                }
            } else if (d < -0.8f) {
                ++inside;
                changed += !same;
                EXPECT_NE(open.ids.id(x, y), b.bolt);
            } else {
                ++rim;
            }
        }
    EXPECT_GT(inside, 2000);
    EXPECT_GT(changed, inside * 95 / 100);
    EXPECT_GT(rim, 100);
    EXPECT_EQ(open.ids.id(79, 59), b.inner);
}

TEST(RenderCut, InsideTheHoleEachPixelShowsWhatTheCutLeaves) {
    const OpenedBox b;
    const Frame plain = render(b.whole, nullptr, b.view, {}, nullptr, nullptr);
    RenderParams params;
    const Frame open = render(b.whole, &b.targets, b.view, params, &b.cut, &plain);
    RayHit16 packet;
    for (int y = 0; y < b.view.height; ++y)
        for (int x = 0; x < b.view.width; ++x) {
            if (b.cut.distance.at_or(x, y, 1) > 0) continue;
            const Ray ray = b.view.ray(float(x) + 0.5f, float(y) + 0.5f);
            for (int i = 0; i < kLanes; ++i) packet.clear(i);
            // Oracle: the target if there is one, else the nearest surface that removes() leaves.
            packet.set(0, ray.origin, ray.direction, 0, kInfinity);
            intersect(b.targets, packet, Coherence::incoherent);
            if (!packet.hit(0)) {
                packet.set(0, ray.origin, ray.direction, 0, kInfinity);
                intersect_cut(b.whole, packet, 0, &b.cut);
            }
            ASSERT_EQ(open.ids.id(x, y), packet.hit(0) ? packet.part(0) : kNoPart) << x << ' ' << y;
            if (!packet.hit(0)) continue;
            EXPECT_NEAR(open.ids.depth(x, y), packet.tfar[0] * ray.depth_per_t, 1e-5f);
        }
}

TEST(RenderCut, LightReachesTheHoleAndTheTargetStandsOut) {
    const OpenedBox b;
    const Frame plain = render(b.whole, nullptr, b.view, {}, nullptr, nullptr);
    const Frame open = render(b.whole, &b.targets, b.view, {}, &b.cut, &plain);
    // Grey in grey: the target gets the accent, and it is lit.
    const Vec4f accent = open.color(79, 59);
    EXPECT_GT(accent.x, 0.5f);
    EXPECT_GT(accent.x, 3 * accent.z);
    RenderParams params;
    params.emphasis = Emphasis::none;
    const Vec4f own = render(b.whole, &b.targets, b.view, params, &b.cut, &plain).color(79, 59);
    EXPECT_NEAR(own.x, own.z, 0.05f);
    EXPECT_GT(own.y, 0.5f); // the closed box around it would leave under .35
}

TEST(RenderCut, ThreadsDoNotMatterThere) {
    const OpenedBox b;
    Control control;
    const Frame plain = render(b.whole, nullptr, b.view, {}, nullptr, nullptr);
    control.threads = 1;
    const Frame one = render(b.whole, &b.targets, b.view, {}, &b.cut, &plain, control);
    for (const int threads : {2, 7}) {
        control.threads = threads;
        EXPECT_TRUE(same_bits(one, render(b.whole, &b.targets, b.view, {}, &b.cut, &plain, control)));
    }
}

TEST(RenderCut, AKeptPartInFrontOfATargetStaysInFrontAndOneThatTouchesItIsBehind) {
    BoxInBox b;
    // A post before the target, kept; and a skin that coincides with the target's front.
    const PartId post = add_part(b.scene, box_mesh({-0.02f, -0.2f, 0.6f}, {0.02f, 0.2f, 0.65f}, 2), "post");
    const PartId skin = add_part(b.scene, quad_mesh({-0.3f, -0.3f, 0.3f}, {0.6f, 0, 0}, {0, 0.6f, 0}, 2), "skin");
    b.cut.role.push_back(CutRole::fixed);
    b.cut.role.push_back(CutRole::fixed);
    const MeshBvhs meshes = build_mesh_bvhs(b.scene);
    const Bvh whole = build_bvh(meshes, all_parts(b.scene), b.cut.role);
    const Bvh targets = build_bvh(meshes, std::vector<PartId>{b.inner});
    const Frame plain = render(whole, nullptr, b.view, {}, nullptr, nullptr);
    const Frame open = render(whole, &targets, b.view, {}, &b.cut, &plain);
    int posts = 0, skins = 0, inner = 0;
    for (const PartId id : open.ids.id.pixels()) posts += id == post, skins += id == skin, inner += id == b.inner;
    EXPECT_GT(posts, 20);
    EXPECT_EQ(skins, 0);
    EXPECT_GT(inner, 300);
}

TEST(RenderCut, AnEmptyCutLeavesThePlainPicture) {
    const OpenedBox b;
    const Frame plain = render(b.whole, nullptr, b.view, {}, nullptr, nullptr);
    const Cut none;
    const Frame open = render(b.whole, &b.targets, b.view, {}, &none, &plain);
    EXPECT_TRUE(same_bits(plain, open));
    EXPECT_EQ(open.rays.primary, 0);
}

} // namespace
} // namespace porthole
