#include <memory>
#include <random>

#include "benchmarks.h"
#include "porthole/scene/camera.h"
#include "scenes.h"
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
        const int row = i / across, layer = row / across;
        const Vec3d place{double(i % across), double(row % across), double(layer)};
        const PartId id = b.add_sphere("ball" + std::to_string(i), place * 2.2, 1);
        const Frame3 turned(normalize(Vec3f{float(u(random)), float(u(random)), 1.5f}));
        Affine3d& m = b.scene.parts[index(id)].world_from_mesh;
        m.x = Vec3d(turned.x), m.y = Vec3d(turned.y), m.z = Vec3d(turned.z);
    }
    return std::move(b.scene);
}

/// All threads, as what is wanted is a time.
struct Balls {
    Scene scene;
    std::unique_ptr<MeshBvhs> meshes;
    std::unique_ptr<Bvh> bvh;
    View view;

    explicit Balls(int across) : scene(many_balls(across)) {
        meshes = std::make_unique<MeshBvhs>(build_mesh_bvhs(scene));
        bvh = std::make_unique<Bvh>(build_bvh(*meshes, all_parts(scene)));
        view = view_from_direction(frame_subject(scene, {}), {1.0f, 0.8f, 1.0f}, {}, kWidth, kHeight);
    }
};

const Balls& balls(int across) {
    static std::unique_ptr<Balls> many, one;
    std::unique_ptr<Balls>& s = across == 1 ? one : many;
    if (!s) s = std::make_unique<Balls>(across);
    return *s;
}

void build(benchmark::State& state, int across) {
    const Balls& s = balls(across);
    for (auto _ : state) benchmark::DoNotOptimize(build_mesh_bvhs(s.scene));
}

void top(benchmark::State& state, int across) {
    const Balls& s = balls(across);
    for (auto _ : state) benchmark::DoNotOptimize(build_bvh(*s.meshes, all_parts(s.scene)));
}

void bounds(benchmark::State& state, int across) {
    const Balls& s = balls(across);
    for (auto _ : state) benchmark::DoNotOptimize(scene_bounds(s.scene));
}

void ids(benchmark::State& state, int across) {
    const Balls& s = balls(across);
    for (auto _ : state) benchmark::DoNotOptimize(trace_ids(*s.bvh, s.view, s.view.window()));
}

void draw(benchmark::State& state, int across, const RenderParams& look) {
    const Balls& s = balls(across);
    for (auto _ : state) benchmark::DoNotOptimize(render(*s.bvh, nullptr, s.view, look, nullptr, nullptr));
}

/// One sample a pixel, light and shadows.
void direct_frame(benchmark::State& state, int across) { draw(state, across, {.samples = 1, .ao_samples = 0}); }

/// With ambient occlusion.
void rough_frame(benchmark::State& state, int across) { draw(state, across, {.samples = 1}); }

/// As the command line draws it.
void frame(benchmark::State& state, int across) { draw(state, across, {}); }

} // namespace

void add_instances(const Settings& settings) {
    if (settings.quick) return;
    const auto add_part = [](const std::string& what, auto function, int across) {
        add("instances/" + std::to_string(across * across * across) + '/' + what, [=](benchmark::State& state) {
            function(state, across);
        })->UseRealTime();
    };
    add_part("build", build, kAcross);
    add_part("top", top, kAcross);
    add_part("bounds", bounds, kAcross);
    add_part("ids", ids, kAcross);
    add_part("direct_frame", direct_frame, kAcross);
    add_part("rough_frame", rough_frame, kAcross);
    add_part("frame", frame, kAcross);
    add_part("ids", ids, 1);
    add_part("frame", frame, 1);
}

} // namespace porthole::bench
