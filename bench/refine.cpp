#include "refine.h"

#include <benchmark/benchmark.h>

#include <cmath>
#include <cstdlib>
#include <map>
#include <memory>
#include <random>
#include <set>
#include <string>

#include "porthole/base/tone.h"
#include "porthole/io/load.h"
#include "porthole/render/render.h"
#include "porthole/scene/camera.h"
#include "support/shapes.h"

namespace porthole::bench {

namespace {

/// Three smooth spheres, one within a crescent of another's shadow: few edges.
Scene spheres() {
    test::Builder b(200);
    b.add_sphere("large", {}, 2);
    b.add_sphere("middle", {2.6, 0.4, 1.2}, 1.2);
    b.add_sphere("small", {0.3, 2.6, 0.6}, 0.8);
    return std::move(b.scene);
}

/// A thousand rods one or two pixels thick: nothing but edges.
Scene wires() {
    test::Builder b(6);
    std::mt19937 random(7);
    std::uniform_real_distribution<double> u(-1, 1);
    for (int i = 0; i < 1000; ++i) {
        const Vec3d from{u(random), u(random), u(random)}, to{u(random), u(random), u(random)};
        for (int k = 0; k < 24; ++k) b.add_sphere("wire" + std::to_string(i), from + (to - from) * (k / 24.0), 0.004);
    }
    return std::move(b.scene);
}

struct Subject {
    Scene scene;
    std::unique_ptr<MeshBvhs> meshes;
    std::unique_ptr<Bvh> bvh;
    explicit Subject(Scene s) : scene(std::move(s)) {
        meshes = std::make_unique<MeshBvhs>(build_mesh_bvhs(scene));
        bvh = std::make_unique<Bvh>(build_bvh(*meshes, all_parts(scene)));
    }
};

struct Named {
    std::string name, file;
    Scene (*make)() = nullptr;
};

struct Picture {
    View view;
    RenderParams params;
    Frame full;
};

const Subject& subject(const Named& named) {
    static std::map<std::string, std::unique_ptr<Subject>> subjects;
    std::unique_ptr<Subject>& s = subjects[named.name];
    if (!s) s = std::make_unique<Subject>(named.make ? named.make() : load_scene(named.file));
    return *s;
}

constexpr int kHeights[] = {1080, 2160};

const Control& one_thread() {
    static const Control control{{}, {}, 1};
    return control;
}

const Picture& full_picture(const Named& named, int height, int samples) {
    static std::map<std::string, std::unique_ptr<Picture>> pictures;
    std::unique_ptr<Picture>& p = pictures[named.name + std::to_string(height) + '/' + std::to_string(samples)];
    if (p) return *p;
    const Subject& s = subject(named);
    p = std::make_unique<Picture>();
    p->view = view_from_direction(frame_subject(s.scene, {}), {1.0f, 0.8f, 1.0f}, {}, height * 16 / 9, height);
    p->params.samples = samples;
    p->params.refine = Refine::full;
    p->full = render(*s.bvh, nullptr, p->view, p->params, nullptr, nullptr, one_thread());
    return *p;
}

void compare(benchmark::State& state, const Frame& frame, const Frame& full) {
    const Image<Rgba8> a = to_srgb8(frame.color, {1, 1, 1}, false), b = to_srgb8(full.color, {1, 1, 1}, false);
    double squares = 0, wrong = 0, inferred = 0;
    std::set<PartId> seen, there;
    for (std::size_t i = 0; i < a.pixels().size(); ++i) {
        const Rgba8 p = a.pixels()[i], q = b.pixels()[i];
        for (const int d : {p.r - q.r, p.g - q.g, p.b - q.b}) squares += double(d) * d;
        const PartId id = frame.ids.id.pixels()[i], truth = full.ids.id.pixels()[i];
        wrong += id != truth;
        if (!frame.inferred.empty()) inferred += frame.inferred.pixels()[i];
        seen.insert(id), there.insert(truth);
    }
    const double n = double(a.pixels().size());
    double missed = 0;
    for (const PartId id : there) missed += seen.count(id) == 0;
    state.counters["dB"] = squares > 0 ? 10 * std::log10(255.0 * 255.0 * 3 * n / squares) : 99;
    state.counters["wrong_ids_%"] = 100 * wrong / n;
    state.counters["missed"] = missed;
    state.counters["traced_%"] = 100 * (n - inferred) / n;
}

void frame(benchmark::State& state, const Named& named, int height, int samples, Refine refine) {
    const Subject& s = subject(named);
    const Picture& p = full_picture(named, height, samples);
    RenderParams params = p.params;
    params.refine = refine;
    Frame last;
    for (auto _ : state) last = render(*s.bvh, nullptr, p.view, params, nullptr, nullptr, one_thread());
    compare(state, last, p.full);
}

} // namespace

void add_refine_benchmarks() {
    std::vector<Named> scenes{{"spheres", "", spheres}, {"wires", "", wires}};
    if (const char* shared = std::getenv("PORTHOLE_SHARED")) {
        const std::string models = std::string(shared) + "/models/";
        const std::pair<const char*, const char*> files[] = {
            {"engine", "assembly/2CylinderEngine.glb"}, {"house", "assembly/FZK_Haus.glb"},
            {"mosquito", "assembly/MosquitoInAmber.glb"}, {"office", "assembly/Office_A.glb"},
            {"saw", "assembly/ReciprocatingSaw.glb"},   {"body", "assembly/vh_male_body.glb"},
            {"worm", "assembly/virtual_worm.glb"},      {"head", "medical/head_brain_mri.glb"}};
        for (const auto& [name, file] : files) scenes.push_back({name, models + file});
    }
    if (const char* assembly = std::getenv("PORTHOLE_ASSEMBLY")) scenes.push_back({"assembly", assembly});
    for (const Named& scene : scenes)
        for (const int height : kHeights)
            for (const int samples : {1, 8})
                for (const Refine refine : {Refine::full, Refine::adaptive}) {
                    const std::string name = scene.name + "/refine/" + (refine == Refine::full ? "full" : "adaptive") +
                                             '/' + std::to_string(height) + "p/" + std::to_string(samples);
                    benchmark::RegisterBenchmark(name.c_str(), [=](benchmark::State& state) {
                        frame(state, scene, height, samples, refine);
                    })->Unit(benchmark::kMillisecond);
                }
}

} // namespace porthole::bench
