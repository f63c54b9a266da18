#include "contours.h"

#include <benchmark/benchmark.h>

#include <algorithm>
#include <cstdlib>
#include <iterator>
#include <map>
#include <memory>
#include <random>

#include "bare_embree.h"
#include "porthole/hole/contour.h"
#include "porthole/io/load.h"
#include "porthole/plan.h"
#include "porthole/scene/camera.h"
#include "porthole/scene/select.h"
#include "support/shapes.h"

namespace porthole::bench {
namespace {

/// A closed shell of 200,000 triangles around balls, rods and wires down to a pixel's width.
Scene procedural() {
    test::Builder b(24);
    const auto shell = std::uint32_t(b.scene.meshes.size());
    b.scene.meshes.push_back(test::sphere(224));
    b.add("shell", shell, {}, {2, 2, 2});
    std::mt19937 random(4);
    std::uniform_real_distribution<double> u(-1, 1);
    for (int i = 0; i < 400; ++i) {
        const Vec3d c{u(random), u(random), u(random)};
        const std::string name = "part_" + std::to_string(i);
        if (i % 4 == 0) b.add_sphere(name, c, 0.09);
        if (i % 4 == 1) b.add_box(name, c, {0.12, 0.03, 0.02});
        if (i % 4 == 2) b.add_box(name, c, {0.004, 0.15, 0.004});
        if (i % 4 == 3) b.add_sphere(name, c, 0.02);
    }
    return std::move(b.scene);
}

struct Case {
    std::string scene, file;
    int targets;
};

/// The parts that are targets: every k-th of those that are not the shell.
std::vector<PartId> chosen(const Scene& scene, int count) {
    std::vector<PartId> parts;
    for (const PartId id : all_parts(scene))
        if (scene.parts[index(id)].name != "shell" && !scene.mesh_of(id).empty()) parts.push_back(id);
    const std::size_t n = std::min(parts.size(), std::size_t(count));
    std::vector<PartId> targets;
    for (std::size_t i = 0; i < n; ++i) targets.push_back(parts[i * parts.size() / n]);
    return targets;
}

/// A scene that the cases share.
struct Model {
    Scene scene;
    MeshBvhs meshes;
    explicit Model(const std::string& file)
        : scene(file.empty() ? procedural() : load_scene(file)), meshes(build_mesh_bvhs(scene)) {}
};

const Model& model(const Case& c) {
    static std::map<std::string, std::unique_ptr<Model>> models;
    std::unique_ptr<Model>& m = models[c.scene];
    if (!m) m = std::make_unique<Model>(c.file);
    return *m;
}

struct Stage {
    Subject subject;
    View view;
    FlatEmbree flat;
    std::vector<Vec2i> truth; ///< contour pixels of the full target id buffer

    explicit Stage(const Case& c)
        : subject(make_subject(model(c).meshes, chosen(model(c).scene, c.targets))),
          flat(model(c).scene, subject.targets) {
        const Scene& scene = model(c).scene;
        view = view_from_direction(frame_subject(scene, subject.targets), {1.0f, 0.8f, 1.0f}, {}, 1920, 1080);
        truth = contour_pixels(find_contours(trace_ids(subject.target_bvh, view, view.window()).id));
    }
};

const Stage& stage(const Case& c) {
    static std::map<std::string, std::unique_ptr<Stage>> stages;
    std::unique_ptr<Stage>& s = stages[c.scene + std::to_string(c.targets)];
    if (!s) s = std::make_unique<Stage>(c);
    return *s;
}

struct Found {
    std::vector<Contour> contours;
    std::int64_t rays = 0;
};

/// The paper's method as it would run on this tracer: one hierarchy of the whole scene, in which
/// a ray mask picks the targets; ids when they are first asked for.
Found by_paper(const Stage& s, const Control&) {
    PaperContours paper = find_contours_paper(
        [&](std::span<const Vec2i> pixels) { return trace_ids_at(s.subject.whole, s.view, pixels, kMaskFixed); },
        s.view.window());
    return {std::move(paper.contours), paper.step1_rays + paper.step2_rays};
}

/// The same where the scene is one flat hierarchy, so that the mask leaves out triangles, not parts.
Found by_paper_flat(const Stage& s, const Control&) {
    PaperContours paper = find_contours_paper(
        [&](std::span<const Vec2i> pixels) { return s.flat.ids_at(s.view, pixels); }, s.view.window());
    return {std::move(paper.contours), paper.step1_rays + paper.step2_rays};
}

template <ContourMethod method> Found by(const Stage& s, const Control& control) {
    TargetContours found = find_target_contours(s.subject, s.view, method, control);
    return {std::move(found.contours), found.rays};
}

using Method = Found (*)(const Stage&, const Control&);

void measure(benchmark::State& state, const Case& c, Method method) {
    const Stage& s = stage(c);
    const Control one_thread{{}, {}, 1};
    Found found;
    for (auto _ : state) found = method(s, one_thread);

    const auto before = [](Vec2i a, Vec2i b) { return a.y != b.y ? a.y < b.y : a.x < b.x; };
    const std::vector<Vec2i> pixels = contour_pixels(found.contours);
    std::vector<Vec2i> right;
    std::set_intersection(pixels.begin(), pixels.end(), s.truth.begin(), s.truth.end(), std::back_inserter(right),
                          before);
    state.counters["complete"] = double(right.size()) / double(std::max<std::size_t>(1, s.truth.size()));
    state.counters["missed"] = double(s.truth.size() - right.size());
    state.counters["false"] = double(pixels.size() - right.size());
    state.counters["rays"] = double(found.rays);
    state.counters["pixels"] = double(s.truth.size());
}

} // namespace

void add_contour_benchmarks() {
    std::vector<std::pair<std::string, std::string>> scenes{{"procedural", ""}};
    if (const char* assembly = std::getenv("PORTHOLE_ASSEMBLY")) scenes.emplace_back("assembly", assembly);
    if (const char* shared = std::getenv("PORTHOLE_SHARED")) {
        const std::string models = std::string(shared) + "/models/";
        scenes.emplace_back("engine", models + "assembly/2CylinderEngine.glb");
        scenes.emplace_back("body", models + "assembly/vh_male_body.glb");
        scenes.emplace_back("worm", models + "assembly/virtual_worm.glb");
    }
    const std::pair<const char*, Method> methods[] = {{"paper", by_paper},
                                                      {"paper_flat", by_paper_flat},
                                                      {"full", by<ContourMethod::full>},
                                                      {"exact", by<ContourMethod::exact>},
                                                      {"fast", by<ContourMethod::fast>}};
    for (const auto& [scene, file] : scenes)
        for (const int targets : {1, 10, 100})
            for (const auto& [name, method] : methods)
                benchmark::RegisterBenchmark(
                    ("contours/" + scene + '/' + std::to_string(targets) + '/' + name).c_str(),
                    [c = Case{scene, file, targets}, m = method](benchmark::State& state) { measure(state, c, m); })
                    ->Unit(benchmark::kMillisecond);
}

} // namespace porthole::bench
