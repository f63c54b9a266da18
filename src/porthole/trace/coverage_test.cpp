// Scan conversion against a ray in every pixel.
#include "porthole/trace/coverage.h"

#include <gtest/gtest.h>

#include <random>

#include "porthole/trace/visibility.h"
#include "support/shapes.h"

namespace porthole {
namespace {

using test::Builder;
using test::with_threads;

struct Compared {
    std::int64_t hits = 0, misses = 0; ///< pixels, by ray
    std::int64_t rays = 0;             ///< of Doubt::trace
    std::int64_t wrong = 0;            ///< pixels that Doubt::guess has wrong
};

bool hit(const Coverage& coverage, int x, int y) { return coverage.window.contains(x, y) && coverage.hit(x, y); }

/// Doubt::trace has to agree with a ray in every pixel, on any number of threads.
Compared compare(const Scene& scene, std::span<const PartId> parts, const View& view, Rect window) {
    const MeshBvhs meshes = build_mesh_bvhs(scene);
    const Bvh bvh = build_bvh(meshes, parts);
    const ClusterBoxes boxes = cluster_boxes(scene, parts);
    const IdBuffer ids = trace_ids(bvh, view, window);
    Compared compared;
    const Coverage seen = cover(bvh, parts, boxes, view, window, Doubt::trace, with_threads(1), &compared.rays);
    const Coverage shared = cover(bvh, parts, boxes, view, window, Doubt::trace, with_threads(5));
    const Coverage guessed = cover(bvh, parts, boxes, view, window, Doubt::guess, with_threads(2));
    for (int y = window.y0; y < window.y1; ++y)
        for (int x = window.x0; x < window.x1; ++x) {
            const bool truth = ids.id(x, y) != kNoPart;
            ++(truth ? compared.hits : compared.misses);
            EXPECT_EQ(hit(seen, x, y), truth) << x << ',' << y;
            EXPECT_EQ(hit(shared, x, y), truth) << x << ',' << y;
            compared.wrong += hit(guessed, x, y) != truth;
        }
    const BlockMask blocks = blocks_of(seen, window);
    EXPECT_EQ(trace_ids_in_blocks(bvh, view, window, blocks), ids);
    return compared;
}

Affine3d placed(Vec3d x, Vec3d y, Vec3d z, Vec3d p) { return {x, y, z, p}; }

TEST(Coverage, EqualsARayInEveryPixelFromManyDirections) {
    Builder b;
    std::mt19937 random(7);
    std::uniform_real_distribution<double> u(-1, 1);
    for (int i = 0; i < 40; ++i) {
        b.add_sphere("ball", {u(random), u(random), u(random)}, 0.02 + 0.15 * std::abs(u(random)));
        b.add_box("rod", {u(random), u(random), u(random)}, {0.4 * std::abs(u(random)) + 0.01, 0.004, 0.02});
        // Sheared, mirrored and stretched placements lose precision in the tracer's inverse.
        b.scene.parts.push_back({"turned", "turned", b.cube_mesh,
                                 placed({0.1 * u(random), 0.1, 0.02}, {-0.003, 0.1 * u(random), 0.04},
                                        {0.05, 0.01, 0.2 * u(random) + 0.3}, {u(random), u(random), u(random)})});
    }
    const std::vector<PartId> parts = all_parts(b.scene);
    std::normal_distribution<float> normal;
    Compared all;
    for (int k = 0; k < 24; ++k) {
        // Some eyes are among the parts.
        const float distance = k % 4 == 0 ? 0.5f : 6.0f;
        const Vec3f eye = normalize(Vec3f{normal(random), normal(random), normal(random)}) * distance;
        const View view = test::look(eye, {}, 203, 117, k % 3 == 1 ? 1.3f : 0.3f, k % 3 == 1);
        const Compared c = compare(b.scene, parts, view, view.window().grown(k % 2 * 13));
        all.hits += c.hits, all.misses += c.misses, all.wrong += c.wrong;
        if (distance > 1) all.rays += c.rays;
    }
    EXPECT_GT(all.hits, 10000);
    EXPECT_GT(all.misses, 10000);
    EXPECT_LT(all.rays, (all.hits + all.misses) / 4);
    EXPECT_LT(all.wrong, all.hits / 10000);
}

TEST(Coverage, CentresOnEdgesAndSurfacesSeenEdgeOnAreTraced) {
    Builder b;
    // Edges run through pixel centres: a pixel is 1/32 of a metre, and no picture is even.
    b.add_box("box", {0.25, 0.25, 0}, {0.5, 0.375, 0.25});
    Mesh sheet;
    sheet.positions = {{0, -1, 1}, {0, 1, 1}, {0, 1, -1}, {0, -1, -1}};
    sheet.triangles = {{0, 1, 2}, {0, 2, 3}};
    b.scene.meshes.push_back(test::finished(sheet));
    b.add("sheet", std::uint32_t(b.scene.meshes.size() - 1), {-0.75, 0, 0}, {1, 1, 1});
    const std::vector<PartId> parts = all_parts(b.scene);
    for (const Vec3f eye : {Vec3f{0, 0, 4}, Vec3f{4, 0, 0}, Vec3f{0, 4, 0}, Vec3f{0, 0, -4}}) {
        const View view = test::look(eye, {}, 65, 65, 65.0f / 64, true);
        EXPECT_GT(compare(b.scene, parts, view, view.window()).rays, 0);
    }
}

TEST(Coverage, HolesAndPrimitivesAreTraced) {
    Builder b;
    b.scene.materials.push_back(b.scene.materials[0]);
    b.scene.materials[1].alpha_mode = AlphaMode::mask;
    b.scene.materials[1].base_color.w = 0.2f; // below the cutoff: a ray passes
    Mesh ball = test::sphere(12);
    ball.submeshes[0].material = 1;
    b.scene.meshes.push_back(ball);
    b.add("hole", 2, {-1, 0, 0}, {0.5, 0.5, 0.5});
    Mesh exact;
    exact.primitives = make_primitive(PrimitiveKind::sphere, 0, Affine3d{}, 0);
    finish_mesh(exact);
    b.scene.meshes.push_back(exact);
    b.add("ball", 3, {1, 0, 0}, {0.5, 0.5, 0.5});
    const View view = test::look({0.2f, 1, 6}, {}, 120, 80, 0.3f);
    const std::array hole{PartId{0}};
    const Compared passed = compare(b.scene, hole, view, view.window());
    EXPECT_EQ(passed.hits, 0);
    EXPECT_GT(passed.rays, 0);
    const Compared both = compare(b.scene, all_parts(b.scene), view, view.window());
    EXPECT_GT(both.hits, 100);
}

TEST(Coverage, SmallWindowsAndFineMeshes) {
    Builder b(64);
    b.add_sphere("ball", {}, 1);
    const std::vector<PartId> parts = all_parts(b.scene);
    // Sixteen thousand triangles: on the smaller picture more than its pixels are worth.
    for (const auto& [width, height] : {std::pair{5, 3}, {1, 40}, {16, 16}, {300, 200}}) {
        const View view = test::look({1, 2, 5}, {}, width, height, 0.4f);
        EXPECT_GT(compare(b.scene, parts, view, view.window()).hits, 0);
    }
    const View away = test::look({1, 2, 5}, {2, 4, 10}, 64, 64, 0.4f);
    const MeshBvhs meshes = build_mesh_bvhs(b.scene);
    const Coverage none =
        cover(build_bvh(meshes, parts), parts, cluster_boxes(b.scene, parts), away, away.window(), Doubt::trace);
    EXPECT_TRUE(none.window.empty());
}

} // namespace
} // namespace porthole
