#include "porthole/render/selective.h"

#include <gtest/gtest.h>

#include <cstring>

#include "porthole/render/compare.h"
#include "porthole/render/test_scene.h"
#include "porthole/trace/visibility.h"

namespace porthole {
namespace {

using test::add_part;
using test::box_mesh;
using test::look_at;
using test::matte;
using test::quad_mesh;
using test::sphere_mesh;

constexpr Refine kWays[] = {Refine::paper1, Refine::paper2, Refine::expansion};

bool same_bits(const Frame& a, const Frame& b) {
    const auto equal = [](const auto& x, const auto& y) {
        return x.window() == y.window() &&
               std::memcmp(x.pixels().data(), y.pixels().data(), x.pixels().size() * sizeof(x.pixels()[0])) == 0;
    };
    return equal(a.color, b.color) && equal(a.ids.id, b.ids.id) && equal(a.ids.depth, b.ids.depth) &&
           a.inferred == b.inferred && a.inside == b.inside && a.rays.all() == b.rays.all();
}

/// A box with a ball in it on a floor, beside a mirror.
Scene scene_of_a_box() {
    Scene s;
    s.materials = {matte({0.8f, 0.8f, 0.8f}), matte({0.7f, 0.2f, 0.1f}), matte({0.1f, 0.6f, 0.3f}),
                   matte({0.9f, 0.9f, 0.9f})};
    s.materials[3].metallic = 1, s.materials[3].roughness = 0.05f;
    add_part(s, quad_mesh({-3, 0, 3}, {6, 0, 0}, {0, 0, -6}, 0), "floor");
    add_part(s, box_mesh({-0.6f, 0.1f, -0.6f}, {0.6f, 1.1f, 0.6f}, 1), "box");
    add_part(s, sphere_mesh({0, 0.6f, 0}, 0.3f, 24, 2), "ball");
    add_part(s, sphere_mesh({1.1f, 0.3f, 0.2f}, 0.3f, 24, 3), "mirror");
    return s;
}

class Selective : public testing::TestWithParam<Refine> {
protected:
    Selective()
        : scene_(padded(scene_of_a_box())), meshes_(build_mesh_bvhs(scene_)),
          bvh_(build_bvh(meshes_, all_parts(scene_))), targets_(build_bvh(meshes_, std::vector{kBall})),
          view_(look_at({0.4f, 1.4f, 3}, {0.2f, 0.5f, 0}, 203, 151)) {
        by_.refine = GetParam();
    }
    static Scene padded(Scene s) {
        for (Mesh& mesh : s.meshes) mesh.positions.reserve(mesh.positions.size() + 1);
        return s;
    }
    [[nodiscard]] Frame plain(const RenderParams& by, int threads = 2) const {
        Control control;
        control.threads = threads;
        return render(bvh_, nullptr, view_, by, nullptr, nullptr, control);
    }
    /// A round hole in the box, as deep as the ball's middle.
    [[nodiscard]] Cut hole() const {
        Cut cut;
        cut.view = view_;
        const PixelPoint middle = view_.project({0, 0.6f, 0});
        const Rect box{int(middle.x) - 42, int(middle.y) - 42, int(middle.x) + 43, int(middle.y) + 43};
        cut.distance = Image<float>(box);
        cut.levels = {CutLevel(box)};
        cut.loose_depth = Image<float>(box, -kInfinity);
        cut.role = {CutRole::loose, CutRole::cut_set, CutRole::fixed, CutRole::loose};
        for (int y = box.y0; y < box.y1; ++y)
            for (int x = box.x0; x < box.x1; ++x) {
                cut.distance(x, y) = std::hypot(float(x) + 0.5f - middle.x, float(y) + 0.5f - middle.y) - 40;
                if (cut.distance(x, y) <= 0) cut.levels[0](x, y).floor = middle.depth;
            }
        index_ranges(cut);
        return cut;
    }
    struct Pictures {
        Frame around, opened;
    };
    [[nodiscard]] Pictures opened(const Cut& cut, const RenderParams& by, int threads = 2) const {
        Control control;
        control.threads = threads;
        const Bvh inside = build_bvh(meshes_, all_parts(scene_), cut.role);
        Pictures p;
        p.around = render_around(bvh_, view_, by, cut, control);
        p.opened = render(inside, &targets_, view_, by, &cut, &p.around, control);
        return p;
    }

    static constexpr PartId kBall = PartId(2);
    Scene scene_;
    MeshBvhs meshes_;
    Bvh bvh_, targets_;
    View view_;
    RenderParams by_;
};

TEST_P(Selective, GivesTheSameBitsForAnyNumberOfThreads) {
    const Cut cut = hole();
    const Frame one = plain(by_, 1);
    const Pictures cut_one = opened(cut, by_, 1);
    EXPECT_FALSE(one.inferred.empty());
    for (const int threads : {2, 7}) {
        EXPECT_TRUE(same_bits(one, plain(by_, threads)));
        const Pictures again = opened(cut, by_, threads);
        EXPECT_TRUE(same_bits(cut_one.around, again.around));
        EXPECT_TRUE(same_bits(cut_one.opened, again.opened));
    }
}

TEST_P(Selective, IsFullWhenMacroPixelsArePixels) {
    RenderParams by = by_;
    by.refine_by.macro_px = 1;
    by.shading = Shading::flat;
    const Cut cut = hole();
    EXPECT_TRUE(same_bits(plain(by), plain(full_of(by))));
    const Pictures flat = opened(cut, by), full_flat = opened(cut, full_of(by));
    EXPECT_EQ(flat.opened.color, full_flat.opened.color);
    EXPECT_EQ(flat.opened.ids, full_flat.opened.ids);
    EXPECT_EQ(flat.opened.inside, full_flat.opened.inside);
    // Lit, but without shadows: the same but for the rounding of the filter's weights.
    by.shading = Shading::raytraced;
    by.shadows = false, by.ao_samples = 0;
    const Pictures lit = opened(cut, by), full_lit = opened(cut, full_of(by));
    EXPECT_EQ(lit.opened.ids, full_lit.opened.ids);
    for (std::size_t i = 0; i < lit.opened.color.pixels().size(); ++i) {
        const Vec4f found = lit.opened.color.pixels()[i], right = full_lit.opened.color.pixels()[i];
        ASSERT_NEAR(found.x, right.x, 1e-5f);
        ASSERT_NEAR(found.y, right.y, 1e-5f);
        ASSERT_NEAR(found.z, right.z, 1e-5f);
        ASSERT_EQ(found.w, right.w);
    }
    // Neighbours share their shadows in the full picture; here there are none to share them with.
    by.shadows = true, by.ao_samples = 4;
    const Refinement shadowed = compare_frames(plain(by), plain(full_of(by)), {1, 1, 1});
    EXPECT_EQ(shadowed.wrong_ids, 0);
    EXPECT_EQ(shadowed.traced, shadowed.pixels);
    EXPECT_GT(shadowed.psnr_db(), 34);
}

TEST_P(Selective, SavesRaysAndComesClose) {
    const Frame frame = plain(by_), full = plain(full_of(by_));
    const Refinement r = compare_frames(frame, full, {1, 1, 1});
    EXPECT_LT(r.rays.primary, r.full_rays.primary);
    EXPECT_LT(r.traced, r.pixels);
    EXPECT_GT(r.psnr_db(), 26);
    EXPECT_TRUE(r.missed.empty());
    EXPECT_LT(r.wrong_ids, r.pixels / 500);
    // What was not inferred is right.
    for (int y = 0; y < view_.height; ++y)
        for (int x = 0; x < view_.width; ++x) {
            if (frame.inferred(x, y)) continue;
            ASSERT_EQ(frame.ids.id(x, y), full.ids.id(x, y)) << x << ',' << y;
            ASSERT_EQ(frame.ids.depth(x, y), full.ids.depth(x, y)) << x << ',' << y;
        }
}

TEST_P(Selective, TakesOneSampleWhateverIsAsked) {
    RenderParams by = by_;
    by.samples = 1;
    EXPECT_TRUE(same_bits(plain(by), plain(by_)));
}

TEST_P(Selective, TracesAllIdsInTheHole) {
    const Cut cut = hole();
    const Pictures found = opened(cut, by_), full = opened(cut, full_of(by_));
    ASSERT_FALSE(found.opened.inferred.empty());
    int inside = 0, balls = 0;
    for (int y = 0; y < view_.height; ++y)
        for (int x = 0; x < view_.width; ++x) {
            if (cut.distance.at_or(x, y, 1.0f) > 0) continue;
            ++inside;
            ASSERT_EQ(found.opened.inferred(x, y), 0) << x << ',' << y;
            ASSERT_EQ(found.opened.ids.id(x, y), full.opened.ids.id(x, y)) << x << ',' << y;
            ASSERT_EQ(found.opened.ids.depth(x, y), full.opened.ids.depth(x, y)) << x << ',' << y;
            // Before the cut, too.
            ASSERT_EQ(found.around.ids.id(x, y), full.around.ids.id(x, y)) << x << ',' << y;
            ASSERT_EQ(found.around.ids.depth(x, y), full.around.ids.depth(x, y)) << x << ',' << y;
            balls += found.opened.ids.id(x, y) == kBall;
        }
    EXPECT_GT(inside, 4000);
    EXPECT_GT(balls, 500);
    EXPECT_GT(compare_frames(found.opened, full.opened, {1, 1, 1}).psnr_db(), 26);
}

TEST_P(Selective, ShowsWhatTheIdsSayInTheHole) {
    // A needle that macro pixels pass by. In the hole its ids are known, and so it is drawn.
    Scene s = scene_of_a_box();
    add_part(s, box_mesh({-0.3f, 0.55f, 0.35f}, {0.3f, 0.557f, 0.357f}, 2), "needle");
    const Scene scene = padded(std::move(s));
    const MeshBvhs meshes = build_mesh_bvhs(scene);
    const Bvh whole = build_bvh(meshes, all_parts(scene));
    Cut cut = hole();
    cut.role.push_back(CutRole::fixed);
    const PartId needle = PartId(4);
    const Bvh inside = build_bvh(meshes, all_parts(scene), cut.role), targets = build_bvh(meshes, std::vector{needle});
    RenderParams by = by_;
    by.shadows = false, by.ao_samples = 0, by.lines = Lines::none;
    const auto draw = [&](const RenderParams& look) {
        const Frame around = render_around(whole, view_, look, cut);
        return render(inside, &targets, view_, look, &cut, &around);
    };
    const Frame found = draw(by), full = draw(full_of(by));
    int seen = 0;
    for (int y = 0; y < view_.height; ++y)
        for (int x = 0; x < view_.width; ++x) {
            if (full.ids.id(x, y) != needle) continue;
            ++seen;
            EXPECT_EQ(found.ids.id(x, y), needle);
            EXPECT_EQ(found.color(x, y), full.color(x, y)) << x << ',' << y;
        }
    EXPECT_GT(seen, 15);
}

TEST_P(Selective, IsThePlainPictureOutsideTheHole) {
    const Cut cut = hole();
    const Frame without = plain(by_);
    const Pictures found = opened(cut, by_);
    int outside = 0;
    for (int y = 0; y < view_.height; ++y)
        for (int x = 0; x < view_.width; ++x) {
            bool touched = false;
            for (int dy = -1; dy <= 1; ++dy)
                for (int dx = -1; dx <= 1; ++dx) touched |= cut.distance.at_or(x + dx, y + dy, 1.0f) <= 0;
            if (touched) continue;
            ++outside;
            ASSERT_EQ(std::memcmp(&found.opened.color(x, y), &without.color(x, y), sizeof(Vec4f)), 0) << x << ',' << y;
        }
    EXPECT_GT(outside, 20000);
}

TEST_P(Selective, InferredIdsCanBeTraced) {
    Frame frame = plain(by_);
    const IdBuffer right = trace_ids(bvh_, view_, view_.window());
    EXPECT_GT(trace_inferred_ids(bvh_, view_, frame, view_.window()), 0);
    EXPECT_EQ(frame.ids, right);
    EXPECT_TRUE(frame.inferred.empty());
    EXPECT_EQ(trace_inferred_ids(bvh_, view_, frame, view_.window()), 0);
}

TEST_P(Selective, RefusesParametersOutOfRange) {
    const auto refused = [&](auto&& change) {
        RenderParams by = by_;
        change(by.refine_by);
        try {
            (void)plain(by);
        } catch (const Error& e) {
            return e.code == std::string("E0140");
        }
        return false;
    };
    EXPECT_TRUE(refused([](RefineParams& by) { by.macro_px = 0; }));
    EXPECT_TRUE(refused([](RefineParams& by) { by.macro_px = 12; }));
    EXPECT_TRUE(refused([](RefineParams& by) { by.macro_px = 512; }));
    EXPECT_TRUE(refused([](RefineParams& by) { by.threshold_px = 16; }));
    EXPECT_TRUE(refused([](RefineParams& by) { by.threshold_px = 3; }));
    EXPECT_TRUE(refused([](RefineParams& by) { by.guides.pop_back(), by.guides.pop_back(); }));
    EXPECT_TRUE(refused([](RefineParams& by) { by.guides = {{0, 0}, {0.5f, 0.5f}, {1, 1}}; }));
    EXPECT_TRUE(refused([](RefineParams& by) { by.guides[0].x = 1.5f; }));
    EXPECT_FALSE(refused([](RefineParams& by) { by.macro_px = 16, by.threshold_px = 4; }));
}

INSTANTIATE_TEST_SUITE_P(Ways, Selective, testing::ValuesIn(kWays), [](const auto& way) {
    return std::string(way.param == Refine::paper1 ? "paper1" : way.param == Refine::paper2 ? "paper2" : "expansion");
});

TEST(SelectiveFaces, TracesTheEdgesOfFacesToo) {
    Scene s;
    s.materials = {matte({0.7f, 0.2f, 0.1f})};
    add_part(s, box_mesh({-1, -1, -1}, {1, 1, 1}), "box");
    for (Mesh& mesh : s.meshes) mesh.positions.reserve(mesh.positions.size() + 1);
    const MeshBvhs meshes = build_mesh_bvhs(s);
    const Bvh bvh = build_bvh(meshes, all_parts(s));
    const View view = look_at({2, 2.5f, 5}, {0, 0, 0}, 120, 90);
    RenderParams by;
    by.refine = Refine::paper2;
    const auto draw = [&](const RenderParams& look) { return render(bvh, nullptr, view, look, nullptr, nullptr); };
    const Frame full = draw(full_of(by));
    const Refinement parts = compare_frames(draw(by), full, {1, 1, 1});
    by.refine_by.surface = RefineParams::Surface::face;
    const Refinement faces = compare_frames(draw(by), full, {1, 1, 1});
    EXPECT_GT(faces.traced, parts.traced);
    EXPECT_GT(faces.psnr_db(), parts.psnr_db() + 3);
}

} // namespace
} // namespace porthole
