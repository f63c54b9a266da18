// Speed claims, as ratios within one run: every scene brings its own yardstick.
//
//   porthole_bench --benchmark_format=json
//
// Procedural scenes always run; models from $PORTHOLE_SHARED/models when it is set; a scene of
// 10^9 instanced triangles when $PORTHOLE_INSTANCES is.
#include <benchmark/benchmark.h>

#include <cstdlib>
#include <filesystem>
#include <map>
#include <memory>
#include <random>

#include "bare_embree.h"
#include "contours.h"
#include "cut_frame.h"
#include "instances.h"
#include "porthole/io/load.h"
#include "porthole/plan.h"
#include "porthole/render/render.h"
#include "porthole/scene/camera.h"
#include "porthole/scene/select.h"
#include "refine.h"
#include "support/shapes.h"

namespace porthole::bench {
namespace {

constexpr int kWidth = 1920, kHeight = 1080;

/// A scene with its hierarchies, a view of it and targets inside. One thread everywhere, so
/// that ratios do not depend on how threads are scheduled.
struct Stage {
    Scene scene;
    std::unique_ptr<MeshBvhs> meshes;
    std::unique_ptr<Subject> subject;
    std::unique_ptr<BareEmbree> bare;
    View view;
    Control one_thread{{}, {}, 1};

    Stage(Scene s, const std::vector<std::string>& targets) : scene(std::move(s)) {
        meshes = std::make_unique<MeshBvhs>(build_mesh_bvhs(scene));
        const std::vector<PartId> parts = select_parts(scene, targets);
        subject = std::make_unique<Subject>(make_subject(*meshes, parts));
        bare = std::make_unique<BareEmbree>(scene);
        view = view_from_direction(frame_subject(scene, parts), {1.0f, 0.8f, 1.0f}, {}, kWidth, kHeight);
    }
};

/// A shell around many small balls.
Scene procedural() {
    test::Builder b(100);
    b.add_sphere("shell", {}, 2);
    std::mt19937 random(4);
    std::uniform_real_distribution<double> u(-1, 1);
    for (int i = 0; i < 120; ++i) b.add_sphere("ball" + std::to_string(i), {u(random), u(random), u(random)}, 0.12);
    return std::move(b.scene);
}

struct Named {
    std::string name, file;
    std::vector<std::string> targets;
};

Stage& stage(const Named& named) {
    static std::map<std::string, std::unique_ptr<Stage>> stages;
    std::unique_ptr<Stage>& s = stages[named.name];
    if (!s) s = std::make_unique<Stage>(named.file.empty() ? procedural() : load_scene(named.file), named.targets);
    return *s;
}

void count_rays(benchmark::State& state) {
    state.counters["Mrays/s"] =
        benchmark::Counter(double(kWidth) * kHeight / 1e6, benchmark::Counter::kIsIterationInvariantRate);
}

void bare_packets(benchmark::State& state, const Named& named) {
    const Stage& s = stage(named);
    for (auto _ : state) benchmark::DoNotOptimize(s.bare->trace(s.view));
    count_rays(state);
}

void primary_ids(benchmark::State& state, const Named& named) {
    const Stage& s = stage(named);
    for (auto _ : state) benchmark::DoNotOptimize(trace_ids(s.subject->whole, s.view, s.view.window(), s.one_thread));
    count_rays(state);
}

void target_ids(benchmark::State& state, const Named& named, bool blocks_only) {
    const Stage& s = stage(named);
    for (auto _ : state) {
        if (blocks_only) {
            const BlockMask blocks =
                mark_blocks(s.scene, s.subject->targets, s.subject->boxes, s.view, s.view.window());
            benchmark::DoNotOptimize(
                trace_ids_in_blocks(s.subject->target_bvh, s.view, s.view.window(), blocks, s.one_thread));
        } else {
            benchmark::DoNotOptimize(trace_ids(s.subject->target_bvh, s.view, s.view.window(), s.one_thread));
        }
    }
}

void paper_contours(benchmark::State& state, const Named& named) {
    const Stage& s = stage(named);
    for (auto _ : state)
        benchmark::DoNotOptimize(find_contours_paper(
            [&](std::span<const Vec2i> pixels) { return trace_ids_at(s.subject->target_bvh, s.view, pixels); },
            s.view.window()));
}

void whole_plan(benchmark::State& state, const Named& named) {
    const Stage& s = stage(named);
    for (auto _ : state) benchmark::DoNotOptimize(plan_view(*s.subject, s.view, {}, s.one_thread));
}

void plain_frame(benchmark::State& state, const Named& named) {
    const Stage& s = stage(named);
    for (auto _ : state)
        benchmark::DoNotOptimize(render(s.subject->whole, nullptr, s.view, {}, nullptr, nullptr, s.one_thread));
}

/// A cutaway with its yardsticks, planned when first asked for.
struct CutStage {
    CutFrame cut;
    AbsentScene absent;
    Frame around;
    explicit CutStage(const Stage& s)
        : cut(*s.subject, s.view), absent(cut), around(render_around(s.subject->whole, s.view, {}, cut.plan.cut)) {}
};

CutStage& cut_stage(const Named& named) {
    static std::map<std::string, std::unique_ptr<CutStage>> stages;
    std::unique_ptr<CutStage>& s = stages[named.name];
    if (!s) s = std::make_unique<CutStage>(stage(named));
    return *s;
}

void cutaway_frame(benchmark::State& state, const Named& named) {
    const CutStage& c = cut_stage(named);
    for (auto _ : state) benchmark::DoNotOptimize(c.cut.draw(true, {}, stage(named).one_thread));
}

/// The yardstick of cutaway_frame: the removed geometry is truly absent.
void absent_frame(benchmark::State& state, const Named& named) {
    const CutStage& c = cut_stage(named);
    for (auto _ : state)
        benchmark::DoNotOptimize(
            render(*c.absent.bvh, nullptr, c.cut.view, {}, nullptr, nullptr, stage(named).one_thread));
}

void hole_pixels(benchmark::State& state, const Named& named, bool capped) {
    const CutStage& c = cut_stage(named);
    for (auto _ : state) benchmark::DoNotOptimize(c.cut.draw_hole(capped, {}, c.around, stage(named).one_thread));
}

void add_benchmarks(const Named& named) {
    const auto add = [&](const char* what, auto function) {
        benchmark::RegisterBenchmark((named.name + "/" + what).c_str(), function)->Unit(benchmark::kMillisecond);
    };
    add("bare_packets", [=](benchmark::State& s) { bare_packets(s, named); });
    add("primary_ids", [=](benchmark::State& s) { primary_ids(s, named); });
    add("targets_full", [=](benchmark::State& s) { target_ids(s, named, false); });
    add("targets_exact", [=](benchmark::State& s) { target_ids(s, named, true); });
    add("contours_paper", [=](benchmark::State& s) { paper_contours(s, named); });
    add("plan", [=](benchmark::State& s) { whole_plan(s, named); });
    add("cutaway_frame", [named](benchmark::State& s) { cutaway_frame(s, named); });
    add("absent_frame", [named](benchmark::State& s) { absent_frame(s, named); });
    add("hole_capped", [named](benchmark::State& s) { hole_pixels(s, named, true); });
    add("hole_uncapped", [named](benchmark::State& s) { hole_pixels(s, named, false); });
    add("plain_frame", [=](benchmark::State& s) { plain_frame(s, named); });
}

} // namespace
} // namespace porthole::bench

int main(int argc, char** argv) {
    using porthole::bench::add_benchmarks;
    add_benchmarks({"procedural", "", {"ball1*"}});
    if (const char* shared = std::getenv("PORTHOLE_SHARED")) {
        const std::string models = std::string(shared) + "/models/";
        add_benchmarks({"engine", models + "assembly/2CylinderEngine.glb", {"rod_123-699*"}});
        add_benchmarks({"body", models + "assembly/vh_male_body.glb", {"VH_M_heart_left_ventricle"}});
        add_benchmarks({"worm", models + "assembly/virtual_worm.glb", {"pm5d"}});
    }
    if (const char* assembly = std::getenv("PORTHOLE_ASSEMBLY")) add_benchmarks({"assembly", assembly, {"part_00"}});
    porthole::bench::add_contour_benchmarks();
    // Frames of seconds: only when asked for.
    if (std::getenv("PORTHOLE_INSTANCES")) porthole::bench::add_instances();
    porthole::bench::add_refine_benchmarks();
    benchmark::Initialize(&argc, argv);
    if (benchmark::ReportUnrecognizedArguments(argc, argv)) return 2;
    benchmark::RunSpecifiedBenchmarks();
    return 0;
}
