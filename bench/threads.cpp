#include "benchmarks.h"
#include "porthole/reveal.h"
#include "scenes.h"

namespace porthole::bench {
namespace {

void frame(benchmark::State& state, const SceneSpec& spec, const Control& control) {
    const Stage& s = stage(spec);
    const View view = s.target_view(1080);
    for (auto _ : state) benchmark::DoNotOptimize(render(s.whole(), nullptr, view, {}, nullptr, nullptr, control));
}

/// Everything between the hierarchies and the picture, from a camera that is chosen.
void whole_reveal(benchmark::State& state, const SceneSpec& spec, const Control& control) {
    const Stage& s = stage(spec);
    const RevealParams params{.targets = s.targets()};
    for (auto _ : state) benchmark::DoNotOptimize(reveal(s.meshes(), params, control));
}

} // namespace

void add_threads(const Settings& settings) {
    const auto add_part = [](const SceneSpec& spec, const std::string& what, auto function) {
        for (const int threads : {1, 2})
            add("threads/" + spec.name + '/' + what + '/' + std::to_string(threads), [=](benchmark::State& state) {
                function(state, spec, Control{{}, {}, threads});
            })->UseRealTime();
    };
    for (const SceneSpec& spec : settings.quick ? scenes({"balls"}) : scenes({"balls", "assembly", "body"}))
        add_part(spec, "frame", frame);
    if (settings.quick) return;
    for (const SceneSpec& spec : scenes({"assembly", "body"})) add_part(spec, "reveal", whole_reveal);
}

} // namespace porthole::bench
