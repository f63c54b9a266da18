#include <map>
#include <memory>

#include "benchmarks.h"
#include "scenes.h"

namespace porthole::bench {
namespace {

const Frame& reference(const SceneSpec& spec, const View& view) {
    static std::map<std::string, std::unique_ptr<Frame>> pictures;
    std::unique_ptr<Frame>& p = pictures[spec.name];
    if (!p)
        p = std::make_unique<Frame>(
            render(stage(spec).whole(), nullptr, view, {.samples = 256, .uniform = true}, nullptr, nullptr));
    return *p;
}

void picture(benchmark::State& state, const SceneSpec& spec, int height_px, const RenderParams& params) {
    const Stage& s = stage(spec);
    const View view = s.target_view(height_px);
    const Frame& truth = reference(spec, view);
    Frame last;
    for (auto _ : state) last = render(s.whole(), nullptr, view, params, nullptr, nullptr, one_thread());
    count_differences(state, last, truth);
    state.counters["samples"] = double(last.rays.primary) / (double(view.width) * double(view.height));
}

} // namespace

void add_antialias(const Settings& settings) {
    const int height_px = settings.quick ? 180 : 360;
    for (const SceneSpec& spec : settings.quick ? scenes({"clutter", "assembly"})
                                                : scenes({"clutter", "assembly", "engine", "body", "worm", "head"})) {
        const auto add_picture = [&](const std::string& what, const RenderParams& params) {
            add("antialias/" + spec.name + '/' + what,
                [=](benchmark::State& state) { picture(state, spec, height_px, params); });
        };
        add_picture("one", {.samples = 1, .refine = Refine::full});
        add_picture("uniform:16", {.samples = 16, .uniform = true});
        for (const int n : {8, 16, 32, 64}) {
            add_picture("edges:" + std::to_string(n), {.samples = n, .refine = Refine::full});
            add_picture("adaptive:" + std::to_string(n), {.samples = n});
        }
    }
}

} // namespace porthole::bench
