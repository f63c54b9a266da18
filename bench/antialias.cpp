// What antialiasing costs and how good it is: pictures with their samples at the edges against
// pictures with as many samples in every pixel, both measured against 256 samples in every pixel.
//
//   porthole_bench_antialias
//
// Scenes are models from $PORTHOLE_SHARED/models, and $PORTHOLE_ASSEMBLY when it is set. Counters:
// psnr (dB, of what the screen shows over white), samples (a pixel, on average), aa_ms (what is
// spent on top of one sample a pixel), of_uniform16 (the time's share of that of 16 samples in every pixel).
#include <benchmark/benchmark.h>

#include <ctime>

#include <cmath>
#include <cstdlib>
#include <map>
#include <memory>

#include "porthole/io/load.h"
#include "porthole/plan.h"
#include "porthole/render/render.h"
#include "porthole/scene/camera.h"
#include "porthole/scene/select.h"

namespace porthole::bench {
namespace {

constexpr int kWidth = 640, kHeight = 360;

struct Named {
    std::string name, file;
    std::vector<std::string> targets;
};

/// CPU seconds of one call; render() runs on one thread here.
template <typename F> double cpu_seconds(F&& f) {
    timespec a, b;
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &a);
    f();
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &b);
    return double(b.tv_sec - a.tv_sec) + 1e-9 * double(b.tv_nsec - a.tv_nsec);
}

double shown(float linear) {
    const double v = std::clamp(double(linear), 0.0, 1.0);
    return v <= 0.0031308 ? 12.92 * v : 1.055 * std::pow(v, 1 / 2.4) - 0.055;
}

/// Mean squared error becomes decibels, over white, as a file has it.
double psnr(const Image<Vec4f>& a, const Image<Vec4f>& b) {
    double sum = 0;
    for (std::size_t i = 0; i < a.pixels().size(); ++i) {
        const Vec4f p = a.pixels()[i], q = b.pixels()[i];
        const double d[3] = {shown(p.x + 1 - p.w) - shown(q.x + 1 - q.w), shown(p.y + 1 - p.w) - shown(q.y + 1 - q.w),
                             shown(p.z + 1 - p.w) - shown(q.z + 1 - q.w)};
        for (const double v : d) sum += v * v;
    }
    return -10 * std::log10(sum / (3.0 * double(a.pixels().size())));
}

/// A model, seen and opened, with the reference pictures and the yardsticks' times.
struct Subjects {
    Scene scene;
    std::unique_ptr<MeshBvhs> meshes;
    std::unique_ptr<Subject> subject;
    View view;
    Frame reference;
    Control one_thread{{}, {}, 1};
    double single_s = 0, uniform16_s = 0; ///< CPU

    explicit Subjects(const Named& named) : scene(load_scene(named.file)) {
        meshes = std::make_unique<MeshBvhs>(build_mesh_bvhs(scene));
        const std::vector<PartId> parts = select_parts(scene, named.targets);
        subject = std::make_unique<Subject>(make_subject(*meshes, parts));
        view = view_from_direction(frame_subject(scene, parts), {1.0f, 0.8f, 1.0f}, {}, kWidth, kHeight);
        (void)draw({.samples = 1});
        single_s = cpu_seconds([&] { benchmark::DoNotOptimize(draw({.samples = 1})); });
        uniform16_s = cpu_seconds([&] { benchmark::DoNotOptimize(draw({.samples = 16, .uniform = true})); });
        reference = draw({.samples = 256, .uniform = true});
    }
    [[nodiscard]] Frame draw(const RenderParams& params) const {
        return render(subject->whole, nullptr, view, params, nullptr, nullptr, one_thread);
    }
};

Subjects& subjects(const Named& named) {
    static std::map<std::string, std::unique_ptr<Subjects>> all;
    std::unique_ptr<Subjects>& s = all[named.name];
    if (!s) s = std::make_unique<Subjects>(named);
    return *s;
}

void picture(benchmark::State& state, const Named& named, const RenderParams& params) {
    const Subjects& s = subjects(named);
    double seconds = 0;
    Frame frame;
    for (auto _ : state) seconds += cpu_seconds([&] { frame = s.draw(params); });
    seconds /= double(state.iterations());
    state.counters["psnr"] = psnr(frame.color, s.reference.color);
    state.counters["samples"] = double(frame.rays.primary) / (double(kWidth) * kHeight);
    state.counters["aa_ms"] = 1e3 * (seconds - s.single_s);
    state.counters["of_uniform16"] = seconds / s.uniform16_s;
}

void add_benchmarks(const Named& named) {
    const auto add = [&](const std::string& what, const RenderParams& params) {
        benchmark::RegisterBenchmark((named.name + "/" + what).c_str(), [=](benchmark::State& state) {
            picture(state, named, params);
        })->Unit(benchmark::kMillisecond);
    };
    add("one", {.samples = 1});
    for (const int n : {4, 8, 16}) add("uniform:" + std::to_string(n), {.samples = n, .uniform = true});
    for (const int n : {4, 8, 16, 32}) add("edges:" + std::to_string(n), {.samples = n});
}

} // namespace
} // namespace porthole::bench

int main(int argc, char** argv) {
    using porthole::bench::add_benchmarks;
    if (const char* shared = std::getenv("PORTHOLE_SHARED")) {
        const std::string models = std::string(shared) + "/models/";
        add_benchmarks({"engine", models + "assembly/2CylinderEngine.glb", {"rod_123-699*"}});
        add_benchmarks({"saw", models + "assembly/ReciprocatingSaw.glb", {"body_69"}});
        add_benchmarks({"body", models + "assembly/vh_male_body.glb", {"VH_M_heart_left_ventricle"}});
        add_benchmarks({"head", models + "medical/head_brain_mri.glb", {"Thalamus_L"}});
        add_benchmarks({"worm", models + "assembly/virtual_worm.glb", {"pm5d"}});
    }
    if (const char* assembly = std::getenv("PORTHOLE_ASSEMBLY")) add_benchmarks({"assembly", assembly, {"part_00"}});
    benchmark::Initialize(&argc, argv);
    if (benchmark::ReportUnrecognizedArguments(argc, argv)) return 2;
    benchmark::RunSpecifiedBenchmarks();
    return 0;
}
