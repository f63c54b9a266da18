#include "porthole/trace/layers.h"

#include <gtest/gtest.h>

#include <array>
#include <random>

#include "porthole/trace/visibility.h"
#include "support/shapes.h"

namespace porthole {
namespace {

using test::Builder;
using test::look;

/// Where a ray of the orthographic view below passes a sphere of radius r about the origin, as depths.
std::optional<std::array<double, 2>> sphere_depths(const View& view, int x, int y, double r) {
    const double s = double(view.pixel_scale());
    const double px = (x + 0.5 - 0.5 * view.width) * s, py = (y + 0.5 - 0.5 * view.height) * s;
    const double h2 = r * r - px * px - py * py;
    if (h2 < 0.02) return std::nullopt; // the mesh and its sphere part at the silhouette
    return std::array{10 - std::sqrt(h2), 10 + std::sqrt(h2)};
}

struct Shells {
    Builder b{96};
    std::vector<PartId> parts;
    std::vector<double> radii{1.0, 0.8, 0.5};
    View view = look({0, 0, 10}, {}, 120, 120, 1.2f, true);
    Shells() {
        for (const double r : radii) parts.push_back(b.add_sphere("s" + std::to_string(r), {}, r));
    }
};

TEST(TraceLayers, FirstAndNextSurfaceOfEachLevel) {
    const Shells s;
    const MeshBvhs meshes = build_mesh_bvhs(s.b.scene);
    const Bvh bvh = build_bvh(meshes, s.parts);
    const Rect w = s.view.window();
    Mask where(w, 1);
    for (int y = 0; y < 120; ++y) where(7, y) = 0;
    const Image<float> until(w, 9.9f);
    const std::vector<std::uint8_t> level{0, 1, 1};
    std::int64_t rays = 0;
    const auto layers = trace_layers(bvh, s.view, where, until, level, 2, 1e-5f, {}, &rays);
    EXPECT_EQ(rays, 119 * 120);
    ASSERT_EQ(layers.size(), 2u);
    int all_three = 0;
    for (int y = 0; y < 120; ++y)
        for (int x = 0; x < 120; ++x) {
            const auto outer = sphere_depths(s.view, x, y, 1), middle = sphere_depths(s.view, x, y, 0.8),
                       inner = sphere_depths(s.view, x, y, 0.5);
            if (x == 7) {
                ASSERT_EQ(layers[0].first(x, y), kInfinity);
                continue;
            }
            if (!inner) continue;
            ++all_three;
            ASSERT_NEAR(layers[0].first(x, y), (*outer)[0], 2e-3);
            ASSERT_NEAR(layers[0].next(x, y), (*middle)[0], 2e-3); // the next of any level
            ASSERT_NEAR(layers[1].first(x, y), (*middle)[0], 2e-3);
            ASSERT_NEAR(layers[1].next(x, y), (*inner)[0], 2e-3);
        }
    EXPECT_GT(all_three, 1000);

    // Nothing lies before a limit in front of everything.
    const auto none = trace_layers(bvh, s.view, where, Image<float>(w, 8.5f), level, 2, 1e-5f);
    for (const float d : none[0].first.pixels()) ASSERT_EQ(d, kInfinity);
}

TEST(TraceLayers, SurfacesThatTouchAreOne) {
    Builder b;
    const std::vector<PartId> parts{b.add_box("a", {0, 0, 0}, {1, 1, 0.25}),
                                    b.add_box("b", {0, 0, -0.5}, {1, 1, 0.25})};
    const MeshBvhs meshes = build_mesh_bvhs(b.scene);
    const View view = look({0, 0, 10}, {}, 20, 20, 0.5f, true);
    const Mask where(view.window(), 1);
    const auto one =
        trace_layers(build_bvh(meshes, parts), view, where, Image<float>(view.window(), 100.0f), {}, 1, 1e-4f);
    const std::vector<std::uint8_t> level{0, 1};
    const auto two =
        trace_layers(build_bvh(meshes, parts), view, where, Image<float>(view.window(), 100.0f), level, 2, 1e-4f);
    for (std::size_t i = 0; i < where.pixels().size(); ++i) {
        ASSERT_NEAR(one[0].first.pixels()[i], 9.75, 1e-4);
        ASSERT_NEAR(one[0].next.pixels()[i], 10.25, 1e-4);
        ASSERT_NEAR(two[1].first.pixels()[i], 10.25, 1e-4);
        ASSERT_NEAR(two[1].next.pixels()[i], 10.75, 1e-4); // not the box in front, in the same place
    }
}

TEST(TraceLayers, ThreadsAndWindowsDoNotMatter) {
    const Shells s;
    const MeshBvhs meshes = build_mesh_bvhs(s.b.scene);
    const Bvh bvh = build_bvh(meshes, s.parts);
    const View view = look({3, 4, 5}, {}, 130, 110, 0.3f);
    std::mt19937 random(3);
    Mask where(view.window());
    for (std::uint8_t& m : where.pixels()) m = random() % 3 == 0;
    const Image<float> until(view.window(), 8.0f);
    const std::vector<std::uint8_t> level{0, 1, 2};
    const auto first = trace_layers(bvh, view, where, until, level, 3, 1e-5f, test::with_threads(1));
    const auto seven = trace_layers(bvh, view, where, until, level, 3, 1e-5f, test::with_threads(7));
    const Rect part{37, 22, 91, 77};
    Mask where_part(part);
    for (int y = part.y0; y < part.y1; ++y)
        for (int x = part.x0; x < part.x1; ++x) where_part(x, y) = where(x, y);
    const auto cropped = trace_layers(bvh, view, where_part, Image<float>(part, 8.0f), level, 3, 1e-5f);
    for (std::size_t k = 0; k < 3; ++k) {
        ASSERT_EQ(first[k].first, seven[k].first);
        ASSERT_EQ(first[k].next, seven[k].next);
        for (int y = part.y0; y < part.y1; ++y)
            for (int x = part.x0; x < part.x1; ++x) {
                ASSERT_EQ(cropped[k].first(x, y), first[k].first(x, y));
                ASSERT_EQ(cropped[k].next(x, y), first[k].next(x, y));
            }
    }
}

TEST(TraceExtents, FromTheFirstSurfaceOfAPartToItsLast) {
    const Shells s;
    const MeshBvhs meshes = build_mesh_bvhs(s.b.scene);
    std::vector<Vec2i> pixels;
    for (int y = 0; y < 120; y += 3)
        for (int x = 0; x < 120; x += 3) pixels.push_back({x, y});
    const auto extents = trace_extents(build_bvh(meshes, s.parts), s.view, pixels);
    ASSERT_EQ(extents.size(), pixels.size());
    std::size_t checked = 0;
    for (std::size_t i = 0; i < pixels.size(); ++i)
        for (std::size_t k = 0; k < 3; ++k) {
            const auto expected = sphere_depths(s.view, pixels[i].x, pixels[i].y, s.radii[k]);
            if (!expected) continue;
            const auto found = std::find_if(extents[i].begin(), extents[i].end(),
                                            [&](const PartExtent& e) { return e.part == s.parts[k]; });
            ASSERT_NE(found, extents[i].end());
            ASSERT_NEAR(found->first, (*expected)[0], 2e-3);
            ASSERT_NEAR(found->last, (*expected)[1], 2e-3);
            ++checked;
        }
    EXPECT_GT(checked, 1000u);
}

TEST(TraceCutEffect, FarthestSurfaceGoneAndWhetherAnythingIsLeft) {
    // Three sheets one behind the other, the last only on the right; the second is of another level.
    Builder b;
    const PartId first = b.add_box("first", {0, 0, 2}, {5, 5, 0.1});
    const PartId second = b.add_box("second", {0, 0, 1}, {5, 5, 0.1});
    const PartId last = b.add_box("last", {5, 0, 0}, {5, 5, 0.1});
    const MeshBvhs meshes = build_mesh_bvhs(b.scene);
    Cut cut;
    cut.view = look({0, 0, 10}, {}, 40, 40, 1, true);
    const Rect w = cut.view.window();
    cut.distance = Image<float>(w, -5.0f);
    cut.loose_depth = Image<float>(w, -kInfinity);
    cut.role = {CutRole::cut_set, CutRole::cut_set, CutRole::loose};
    cut.level = {0, 1, 0};
    cut.levels.assign(2, CutLevel(w));
    for (int y = 0; y < 40; ++y)
        for (int x = 0; x < 40; ++x) {
            cut.levels[0](x, y).floor = 9.7f;
            // Above, the second sheet's level starts farther inside than these pixels are.
            cut.levels[1](x, y) = {.start = y < 20 ? 6.0f : 0.0f, .floor = 9.7f};
        }
    const std::array both{first, second};
    const Bvh cut_bvh = build_bvh(meshes, both), whole = build_bvh(meshes, all_parts(b.scene));
    const CutEffect effect = trace_cut_effect(cut_bvh, whole, cut, Mask(w, 1));
    for (int y = 0; y < 40; ++y)
        for (int x = 0; x < 40; ++x) {
            const bool above = y < 20, right = x >= 20;
            ASSERT_NEAR(effect.farthest(x, y), above ? 8.1 : 9.1, 1e-4) << x << ',' << y;
            ASSERT_EQ(effect.farthest_level(x, y), above ? 0 : 1);
            ASSERT_EQ(effect.left(x, y) != 0, above || right);
        }
    (void)last;
    // A loose part in front of what is gone goes with it; a kept one is left to see.
    cut.role[index(second)] = CutRole::loose;
    cut.levels.pop_back(), cut.level.clear();
    const std::array only{first};
    const CutEffect shallow = trace_cut_effect(build_bvh(meshes, only), whole, cut, Mask(w, 1));
    for (std::size_t i = 0; i < shallow.left.pixels().size(); ++i) ASSERT_EQ(shallow.left.pixels()[i], 1);
}

} // namespace
} // namespace porthole
