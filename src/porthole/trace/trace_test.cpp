// Ray queries against constructed scenes and against single rays.
#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <future>
#include <optional>
#include <random>

#include "porthole/trace/bvh.h"
#include "porthole/trace/visibility.h"
#include "support/shapes.h"

namespace porthole {
namespace {

using test::Builder;
using test::with_threads;

/// Random small spheres inside a large one; part 0 is the large one.
Scene nested_scene(int count, std::uint32_t seed, int rings = 24) {
    Builder b(rings);
    b.add_sphere("shell", {}, 2);
    std::mt19937 random(seed);
    std::uniform_real_distribution<double> u(-1, 1);
    for (int i = 0; i < count; ++i) b.add_sphere("ball" + std::to_string(i), {u(random), u(random), u(random)}, 0.12);
    return std::move(b.scene);
}

View view_from(Vec3f eye, int width, int height) { return test::look(eye, {}, width, height, 0.4f); }

TEST(Trace, DepthsOfASphereAreThoseOfTheSphere) {
    Builder b(200);
    b.add_sphere("s", {}, 1);
    const Scene& scene = b.scene;
    const MeshBvhs meshes = build_mesh_bvhs(scene);
    const Bvh bvh = build_bvh(meshes, all_parts(scene));
    const View view = view_from({0, 0, 5}, 64, 64);
    const IdBuffer ids = trace_ids(bvh, view, view.window());
    EXPECT_EQ(ids.id(32, 32), PartId{0});
    EXPECT_NEAR(ids.depth(32, 32), 4.0f, 1e-3);
    EXPECT_EQ(ids.id(0, 0), kNoPart);
    EXPECT_EQ(ids.depth(0, 0), kInfinity);
}

TEST(Trace, BlocksEqualTheFullBufferFromManyDirections) {
    const Scene scene = nested_scene(60, 7);
    const MeshBvhs meshes = build_mesh_bvhs(scene);
    std::vector<PartId> targets;
    for (std::uint32_t i = 1; i < scene.parts.size(); i += 3) targets.push_back(PartId{i});
    const Bvh bvh = build_bvh(meshes, targets);
    const ClusterBoxes boxes = cluster_boxes(scene, targets);
    std::mt19937 random(3);
    std::normal_distribution<float> normal;
    for (int k = 0; k < 32; ++k) {
        // Some eyes are among the targets, so that boxes reach behind the camera.
        const float distance = k % 4 == 0 ? 0.5f : 6.0f;
        const View view =
            view_from(normalize(Vec3f{normal(random), normal(random), normal(random)}) * distance, 101, 67);
        const Rect window = view.window().grown(13);
        const BlockMask blocks = mark_blocks(scene, targets, boxes, view, window);
        EXPECT_EQ(trace_ids(bvh, view, window), trace_ids_in_blocks(bvh, view, window, blocks)) << "direction " << k;
        if (distance > 1) {
            EXPECT_LT(blocks.count(), std::int64_t(blocks.marked.pixels().size()));
        }
    }
}

TEST(Trace, CropEqualsTheFullPicture) {
    const Scene scene = nested_scene(20, 1);
    const MeshBvhs meshes = build_mesh_bvhs(scene);
    const Bvh bvh = build_bvh(meshes, all_parts(scene));
    const View view = view_from({3, 1, 4}, 90, 70);
    const IdBuffer full = trace_ids(bvh, view, view.window());
    const Rect crop{13, 9, 58, 41};
    const IdBuffer part = trace_ids(bvh, view, crop);
    for (int y = crop.y0; y < crop.y1; ++y)
        for (int x = crop.x0; x < crop.x1; ++x) {
            ASSERT_EQ(part.id(x, y), full.id(x, y));
            ASSERT_EQ(part.depth(x, y), full.depth(x, y));
        }
}

TEST(Trace, ThreadsAndOrderOfPartsDoNotMatter) {
    // Meshes above the size from which Embree builds with several threads.
    const Scene scene = nested_scene(30, 5, 180);
    const View view = view_from({3, 1, 4}, 320, 200);
    std::vector<PartId> parts = all_parts(scene);
    std::vector<PartId> backwards(parts.rbegin(), parts.rend());
    std::optional<IdBuffer> first;
    for (const int threads : {1, 2, 7, 1, 7}) {
        const MeshBvhs meshes = build_mesh_bvhs(scene, {}, with_threads(threads));
        for (const auto& order : {parts, backwards}) {
            const IdBuffer ids = trace_ids(build_bvh(meshes, order), view, view.window(), with_threads(threads));
            if (!first) first = ids;
            EXPECT_EQ(*first, ids) << threads << " threads";
        }
    }
}

TEST(Trace, HitsDependNeitherOnLayoutNorOnThreads) {
    // Every triangle twice, far apart in the mesh: whichever of the two a ray hits depends on the
    // tree. Large enough for Embree to build with several threads.
    Builder b(90);
    Mesh& mesh = b.scene.meshes[b.sphere_mesh];
    std::vector<Vec3u> again = mesh.triangles;
    std::shuffle(again.begin(), again.end(), std::mt19937(5));
    mesh.triangles.insert(mesh.triangles.end(), again.begin(), again.end());
    mesh.submeshes = {{0, std::uint32_t(mesh.triangles.size()), 0}};
    b.add_sphere("outer", {}, 2);
    b.add_sphere("inner", {0.3, 0, 1.2}, 0.9);
    const Scene scene = std::move(b.scene);
    const View view = view_from({1, 2, 6}, 96, 64);

    struct Hit {
        std::uint32_t part, triangle;
        float t, u, v;
        bool operator==(const Hit&) const = default;
    };
    std::optional<std::vector<Hit>> first;
    for (const BvhLayout layout : {BvhLayout::fast, BvhLayout::compact})
        for (const int threads : {1, 2, 7, 7}) {
            const MeshBvhs meshes = build_mesh_bvhs(scene, {.layout = layout}, with_threads(threads));
            const Bvh bvh = build_bvh(meshes, all_parts(scene));
            std::vector<Hit> hits;
            for (int y = 0; y < view.height; ++y)
                for (int x = 0; x < view.width; x += kLanes) {
                    RayHit16 rays;
                    for (int i = 0; i < kLanes; ++i) {
                        const Ray ray = view.ray(float(x + i) + 0.5f, float(y) + 0.5f);
                        rays.set(i, ray.origin, ray.direction, 0, kInfinity);
                    }
                    intersect(bvh, rays, Coherence::coherent);
                    for (int i = 0; i < kLanes; ++i)
                        if (rays.hit(i))
                            hits.push_back({rays.instance[i], rays.triangle[i], rays.tfar[i], rays.u[i], rays.v[i]});
                }
            EXPECT_GT(hits.size(), 1000u);
            if (!first) first = hits;
            EXPECT_TRUE(*first == hits) << int(layout) << ", " << threads << " threads";
        }
}

TEST(Trace, PartDuplicatedInPlaceChangesNothing) {
    Scene scene = nested_scene(10, 2);
    const View view = view_from({3, 1, 4}, 160, 100);
    const std::vector<CutRole> roles(scene.parts.size() + 1, CutRole::cut_set);
    const auto traced = [&] {
        const MeshBvhs meshes = build_mesh_bvhs(scene);
        return trace_ids(build_bvh(meshes, all_parts(scene), std::span(roles).first(scene.parts.size())), view,
                         view.window());
    };
    const IdBuffer before = traced();
    // The copy has its own mesh: only its content tells that it coincides.
    scene.meshes.push_back(scene.meshes[0]);
    finish_mesh(scene.meshes.back());
    scene.parts.push_back({"shell", "shell[1]", 2, {}});
    EXPECT_EQ(before, traced());
}

TEST(Trace, CopiedSceneTracesTheSame) {
    // A copy's vertices have no room behind them for Embree's 16-byte reads.
    const Scene scene = nested_scene(3, 8);
    const Scene copy = scene;
    const View view = view_from({3, 1, 4}, 80, 60);
    const auto traced = [&](const Scene& s) {
        const MeshBvhs meshes = build_mesh_bvhs(s);
        return trace_ids(build_bvh(meshes, all_parts(s)), view, view.window());
    };
    EXPECT_EQ(traced(scene), traced(copy));
}

TEST(Trace, OcclusionOnInstancesReturns) {
    // Embree 3.13.5 did not return from coherent occlusion packets on instances; ours are
    // incoherent. A frame of them must end, and agree with nearest hits.
    const Scene scene = nested_scene(200, 11);
    const MeshBvhs meshes = build_mesh_bvhs(scene);
    const std::vector<PartId> parts = all_parts(scene);
    const Bvh bvh = build_bvh(meshes, std::span(parts).subspan(1));
    const View view = view_from({3, 1, 4}, 400, 300);
    auto coverage = std::async(std::launch::async, [&] { return trace_coverage(bvh, view, view.window()); });
    ASSERT_EQ(coverage.wait_for(std::chrono::seconds(60)), std::future_status::ready);
    const Mask hit = coverage.get();
    const IdBuffer ids = trace_ids(bvh, view, view.window());
    for (std::size_t i = 0; i < hit.pixels().size(); ++i)
        ASSERT_EQ(hit.pixels()[i] != 0, ids.id.pixels()[i] != kNoPart);
}

TEST(Trace, SpansAreWhatLiesInFront) {
    Builder b(60);
    b.add_sphere("target", {}, 0.3);
    b.add_sphere("shell", {}, 1.0);
    b.add_sphere("behind", {0, 0, -3}, 0.4);
    b.add_sphere("before", {0, 0, 2}, 0.1);
    const Scene& scene = b.scene;
    const MeshBvhs meshes = build_mesh_bvhs(scene);
    const std::vector<CutRole> roles{CutRole::fixed, CutRole::cut_set, CutRole::cut_set, CutRole::cut_set};
    const Bvh whole = build_bvh(meshes, all_parts(scene), roles);
    const std::vector<PartId> targets{PartId{0}};
    const View view = view_from({0, 0, 6}, 200, 200);
    const IdBuffer ids = trace_ids(build_bvh(meshes, targets), view, view.window());
    const Spans spans = trace_spans(whole, kMaskCutSet, view, ids, 1e-5f);
    ASSERT_EQ(spans.parts.size(), 2u);
    EXPECT_EQ(spans.parts[0].part, PartId{1});
    EXPECT_EQ(spans.parts[1].part, PartId{3});
    std::int64_t target_pixels = 0;
    for (const PartId id : ids.id.pixels()) target_pixels += id != kNoPart;
    EXPECT_EQ(spans.parts[0].pixels, target_pixels);
    EXPECT_LT(spans.parts[1].pixels, target_pixels);
    EXPECT_NEAR(spans.parts[1].greatest_gap, 2.1f - 0.3f, 0.02f);
    EXPECT_NEAR(spans.nearest(100, 100), 6 - 2.1f, 1e-3f);
    EXPECT_EQ(spans.nearest(0, 0), kInfinity);
}

TEST(Trace, FarthestIsTheLastSurfaceBeforeTheLimit) {
    Builder b(60);
    b.add_sphere("s", {}, 1);
    const Scene& scene = b.scene;
    const MeshBvhs meshes = build_mesh_bvhs(scene);
    const Bvh bvh = build_bvh(meshes, all_parts(scene));
    const View view = view_from({0, 0, 6}, 64, 64);
    const Mask mask(view.window(), 1);
    const Image<float> middle(view.window(), 6.0f), all(view.window(), kInfinity), none(view.window(), 1.0f);
    EXPECT_NEAR(trace_farthest(bvh, view, mask, middle)(32, 32), 5.0f, 1e-2f);
    EXPECT_NEAR(trace_farthest(bvh, view, mask, all)(32, 32), 7.0f, 1e-2f);
    EXPECT_EQ(trace_farthest(bvh, view, mask, none)(32, 32), -kInfinity);
    EXPECT_EQ(trace_farthest(bvh, view, mask, all)(0, 0), -kInfinity);
}

TEST(Trace, CutRemovesForShadowRays) {
    Builder b(60);
    b.add_sphere("s", {}, 1);
    const Scene& scene = b.scene;
    const MeshBvhs meshes = build_mesh_bvhs(scene);
    const Bvh bvh = build_bvh(meshes, all_parts(scene));
    Cut cut;
    cut.view = view_from({0, 0, 6}, 64, 64);
    cut.distance = Image<float>(Rect{16, 16, 48, 48}, 1.0f);
    for (int y = 24; y < 40; ++y)
        for (int x = 24; x < 40; ++x) cut.distance(x, y) = -1.0f;
    cut.levels.emplace_back(cut.distance.window(), CutProfile{.floor = 6.0f});
    cut.loose_depth = Image<float>(cut.distance.window(), -kInfinity);
    cut.role = {CutRole::cut_set};
    const auto is_occluded = [&](Vec3f origin, Vec3f direction, const Cut* c) {
        RayHit16 rays;
        for (int i = 0; i < kLanes; ++i) rays.clear(i);
        rays.set(3, origin, direction, 0, 100);
        occluded(bvh, rays, c, nullptr);
        return rays.tfar[3] == -kInfinity;
    };
    // From the middle of the sphere towards the eye: through the hole. Away from it: the back stays.
    EXPECT_TRUE(is_occluded({0, 0, 0}, {0, 0, 1}, nullptr));
    EXPECT_FALSE(is_occluded({0, 0, 0}, {0, 0, 1}, &cut));
    EXPECT_TRUE(is_occluded({0, 0, 0}, {0, 0, -1}, &cut));
    EXPECT_TRUE(is_occluded({0, 0, 0}, {1, 0, 0}, &cut));
}

TEST(Trace, ReflectedRayThatStartsOnARemovedSurfaceGoesOn) {
    // A hit at t = 0 is skipped by the next representable t, which is denormal and flushed.
    Builder b;
    b.add_box("wall", {0, 0, 0}, {1, 1, 1});
    b.add_box("behind", {0, 0, -4}, {1, 1, 1});
    const MeshBvhs meshes = build_mesh_bvhs(b.scene);
    const Bvh bvh = build_bvh(meshes, all_parts(b.scene));
    Cut cut;
    cut.view = view_from({0, 0, 6}, 64, 64);
    cut.distance = Image<float>(cut.view.window(), -1.0f);
    cut.levels.emplace_back(cut.view.window(), CutProfile{.floor = 7.5f});
    cut.loose_depth = Image<float>(cut.view.window(), -kInfinity);
    cut.role = {CutRole::cut_set, CutRole::fixed};
    auto found = std::async(std::launch::async, [&] {
        const FlushDenormals flush;
        RayHit16 rays;
        for (int i = 0; i < kLanes; ++i) rays.clear(i);
        rays.set(5, {0.1f, 0.2f, 1}, {0, 0, -1}, 0, kInfinity);
        intersect_cut(bvh, rays, 5, &cut);
        return std::pair{rays.part(5), rays.tfar[5]};
    });
    ASSERT_EQ(found.wait_for(std::chrono::seconds(60)), std::future_status::ready);
    const auto [part, t] = found.get();
    EXPECT_EQ(part, PartId{1});
    EXPECT_NEAR(t, 4.0f, 1e-5f);
}

} // namespace
} // namespace porthole
