#include "instances.h"

#include <benchmark/benchmark.h>

#include <memory>
#include <random>

#include "porthole/plan.h"
#include "porthole/render/render.h"
#include "porthole/scene/camera.h"
#include "support/shapes.h"

namespace porthole::bench {
namespace {

constexpr int kWidth = 1920, kHeight = 1080, kAcross = 10;
constexpr int kRings = 500; ///< 4 * 500^2 triangles

/// A ball with waves, so that it casts shadows on itself.
Mesh wavy_ball() {
    Mesh mesh = test::sphere(kRings);
    for (Vec3f& p : mesh.positions)
        p = p * (1 + 0.05f * std::sin(23 * p.x) * std::sin(19 * p.y + 1) * std::sin(29 * p.z + 2));
    return test::finished(std::move(mesh));
}

Scene many_balls(int across) {
    test::Builder b(2);
    b.scene.meshes[b.sphere_mesh] = wavy_ball();
    std::mt19937 random(1);
    std::uniform_real_distribution<double> u(-1, 1);
    for (int i = 0; i < across * across * across; ++i) {
        const Vec3d place{double(i % across), double(i / across % across), double(i / across / across)};
        const PartId id = b.add_sphere("ball" + std::to_string(i), place * 2.2, 1);
        const Frame3 turned(normalize(Vec3f{float(u(random)), float(u(random)), 1.5f}));
        Affine3d& m = b.scene.parts[index(id)].world_from_mesh;
        m.x = Vec3d(turned.x), m.y = Vec3d(turned.y), m.z = Vec3d(turned.z);
    }
    return std::move(b.scene);
}

/// All threads, as what is wanted is a time.
struct Stage {
    Scene scene;
    std::unique_ptr<MeshBvhs> meshes;
    std::unique_ptr<Bvh> bvh;
    View view;

    explicit Stage(int across) : scene(many_balls(across)) {
        meshes = std::make_unique<MeshBvhs>(build_mesh_bvhs(scene));
        bvh = std::make_unique<Bvh>(build_bvh(*meshes, all_parts(scene)));
        view = view_from_direction(frame_subject(scene, {}), {1.0f, 0.8f, 1.0f}, {}, kWidth, kHeight);
    }
};

const Stage& stage(int across) {
    static std::unique_ptr<Stage> many, one;
    std::unique_ptr<Stage>& s = across == 1 ? one : many;
    if (!s) s = std::make_unique<Stage>(across);
    return *s;
}

void add(const char* name, void (*function)(benchmark::State&, int), int across) {
    benchmark::RegisterBenchmark(name, function, across)
        ->Unit(benchmark::kMillisecond)
        ->MeasureProcessCPUTime()
        ->UseRealTime();
}

void build(benchmark::State& state, int across) {
    const Stage& s = stage(across);
    for (auto _ : state) benchmark::DoNotOptimize(build_mesh_bvhs(s.scene));
}

void top(benchmark::State& state, int across) {
    const Stage& s = stage(across);
    for (auto _ : state) benchmark::DoNotOptimize(build_bvh(*s.meshes, all_parts(s.scene)));
}

void bounds(benchmark::State& state, int across) {
    const Stage& s = stage(across);
    for (auto _ : state) benchmark::DoNotOptimize(scene_bounds(s.scene));
}

void ids(benchmark::State& state, int across) {
    const Stage& s = stage(across);
    for (auto _ : state) benchmark::DoNotOptimize(trace_ids(*s.bvh, s.view, s.view.window()));
}

void draw(benchmark::State& state, int across, const RenderParams& look) {
    const Stage& s = stage(across);
    for (auto _ : state) benchmark::DoNotOptimize(render(*s.bvh, nullptr, s.view, look, nullptr, nullptr));
}

/// One sample a pixel, light and shadows.
void direct_frame(benchmark::State& state, int across) { draw(state, across, {.samples = 1, .ao_samples = 0}); }

/// With ambient occlusion.
void rough_frame(benchmark::State& state, int across) { draw(state, across, {.samples = 1}); }

/// As the command line draws it.
void frame(benchmark::State& state, int across) { draw(state, across, {}); }

} // namespace

void add_instances() {
    add("instances/build", build, kAcross);
    add("instances/top", top, kAcross);
    add("instances/bounds", bounds, kAcross);
    add("instances/ids", ids, kAcross);
    add("instances/direct_frame", direct_frame, kAcross);
    add("instances/rough_frame", rough_frame, kAcross);
    add("instances/frame", frame, kAcross);
    add("instances/one_ids", ids, 1);
    add("instances/one_frame", frame, 1);
}

} // namespace porthole::bench
