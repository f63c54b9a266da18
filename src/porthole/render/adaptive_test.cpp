// Adaptive refinement against tracing every pixel.
#include <gtest/gtest.h>

#include "porthole/render/compare.h"
#include "porthole/render/render.h"
#include "porthole/render/sampling.h"
#include "porthole/render/test_scene.h"
#include "porthole/scene/camera.h"

namespace porthole {
namespace {

using namespace test;

struct Stand {
    Scene scene;
    MeshBvhs meshes;
    Bvh bvh;
    explicit Stand(Scene s)
        : scene(std::move(s)), meshes(build_mesh_bvhs(scene)), bvh(build_bvh(meshes, all_parts(scene))) {}
    Stand(const Stand&) = delete;
    Stand& operator=(const Stand&) = delete;

    [[nodiscard]] Frame draw(const View& view, RenderParams params, Refine refine, int threads = 2) const {
        params.refine = refine;
        Control control;
        control.threads = threads;
        return render(bvh, nullptr, view, params, nullptr, nullptr, control);
    }
    [[nodiscard]] Refinement compare(const View& view, const RenderParams& params) const {
        return compare_frames(draw(view, params, Refine::adaptive), draw(view, params, Refine::full), {1, 1, 1});
    }
};

/// A wall with a box before it, the box's shadow on the wall.
Scene wall_and_box() {
    Scene s;
    s.materials = {matte({0.8f, 0.8f, 0.8f}), matte({0.1f, 0.2f, 0.7f})};
    add_part(s, quad_mesh({-4, -4, 0}, {8, 0, 0}, {0, 8, 0}, 0), "wall");
    add_part(s, box_mesh({-0.5f, -0.5f, 0.5f}, {0.5f, 0.5f, 0.9f}, 1), "box");
    return s;
}

TEST(Adaptive, TracesFewPixelsAndLooksTheSame) {
    const Stand stand(wall_and_box());
    for (const bool orthographic : {false, true}) {
        View view = look_at({0.6f, 0.9f, 6}, {0, 0, 0}, 501, 387, 0.4f);
        view.orthographic = orthographic;
        if (orthographic) view.half_height = 2;
        const Refinement c = stand.compare(view, {});
        EXPECT_EQ(c.wrong_ids, 0);
        EXPECT_TRUE(c.missed.empty());
        EXPECT_LT(double(c.traced), 0.35 * double(c.pixels));
        EXPECT_GT(c.psnr_db(), 50);
    }
}

TEST(Adaptive, FollowsAThreadThatNoLatticeBlockMeets) {
    // Two pixels wide and slanted: it passes most blocks of the lattices by.
    Scene s = wall_and_box();
    add_part(s, box_mesh({-3, 1.4f, 0.2f}, {3, 1.412f, 0.212f}, 1), "thread");
    const Stand stand(std::move(s));
    const View view = look_at({0.6f, 0.9f, 6}, {0, 0, 0}, 640, 480, 0.4f);
    const Frame full = stand.draw(view, {}, Refine::full), fast = stand.draw(view, {}, Refine::adaptive);
    const auto thread_pixels = [](const Frame& f) {
        return std::count(f.ids.id.pixels().begin(), f.ids.id.pixels().end(), PartId{2});
    };
    EXPECT_GT(thread_pixels(full), 300);
    EXPECT_EQ(thread_pixels(fast), thread_pixels(full));
    EXPECT_EQ(compare_frames(fast, full, {1, 1, 1}).wrong_ids, 0);
}

TEST(Adaptive, FindsManySpecks) {
    // Smaller than a block, most of them on none of the first lattice, nothing behind them.
    Scene s;
    s.materials = {matte({0.1f, 0.2f, 0.7f})};
    for (int i = 0; i < 600; ++i) {
        const Vec2f at = pixel_sample(i);
        const Vec3f p{(at.x - 0.5f) * 4, (at.y - 0.5f) * 3, float(i % 7) * 0.1f};
        add_part(s, box_mesh(p, p + Vec3f{0.011f, 0.013f, 0.012f}), "speck");
    }
    const Stand stand(std::move(s));
    const View view = look_at({0, 0, 6}, {0, 0, 0}, 960, 540, 0.35f);
    const Refinement c = stand.compare(view, {.samples = 1});
    EXPECT_EQ(c.wrong_ids, 0);
    EXPECT_TRUE(c.missed.empty());
    EXPECT_LT(c.traced, c.pixels / 2);
}

TEST(Adaptive, TracesCameraRaysWhereColorsCannotBeInferred) {
    Scene s = wall_and_box();
    s.materials[0].roughness = 0.1f; // a mirror
    s.materials[0].metallic = 1;
    const Stand stand(std::move(s));
    const View view = look_at({0.6f, 0.9f, 6}, {0, 0, 0}, 320, 240, 0.4f);
    const Frame fast = stand.draw(view, {}, Refine::adaptive);
    for (int y = 0; y < 240; ++y)
        for (int x = 0; x < 320; ++x)
            if (fast.ids.id(x, y) == PartId{0}) {
                ASSERT_EQ(fast.inferred(x, y), 0) << x << ' ' << y;
            }
    EXPECT_GT(compare_frames(fast, stand.draw(view, {}, Refine::full), {1, 1, 1}).psnr_db(), 45);
}

TEST(Adaptive, SameBitsForAnyNumberOfThreads) {
    const Stand stand(wall_and_box());
    const View view = look_at({0.6f, 0.9f, 6}, {0, 0, 0}, 333, 222, 0.4f);
    const Frame one = stand.draw(view, {}, Refine::adaptive, 1);
    for (const int threads : {2, 7}) {
        const Frame many = stand.draw(view, {}, Refine::adaptive, threads);
        EXPECT_TRUE(one.color == many.color);
        EXPECT_TRUE(one.ids == many.ids);
        EXPECT_TRUE(one.inferred == many.inferred);
        EXPECT_EQ(one.rays.all(), many.rays.all());
    }
}

TEST(Adaptive, DrawsPicturesOfAnySize) {
    const Stand stand(wall_and_box());
    for (const Vec2i size : {Vec2i{1, 1}, Vec2i{2, 5}, Vec2i{4, 4}, Vec2i{5, 4}, Vec2i{7, 33}, Vec2i{65, 3}}) {
        const View view = look_at({0.6f, 0.9f, 6}, {0, 0, 0}, size.x, size.y, 0.4f);
        const Refinement c = stand.compare(view, {.samples = 1});
        EXPECT_EQ(c.wrong_ids, 0) << size.x << 'x' << size.y;
        EXPECT_GT(c.psnr_db(), 40) << size.x << 'x' << size.y;
    }
}

TEST(Adaptive, FlatShadingToo) {
    const Stand stand(wall_and_box());
    const View view = look_at({0.6f, 0.9f, 6}, {0, 0, 0}, 320, 240, 0.4f);
    const Refinement c = stand.compare(view, {.shading = Shading::flat});
    EXPECT_EQ(c.wrong_ids, 0);
    EXPECT_GT(c.psnr_db(), 55);
}

} // namespace
} // namespace porthole
