#include "benchmarks.h"
#include "scenes.h"

namespace porthole::bench {
namespace {

void count_rays(benchmark::State& state, const View& view) {
    state.counters["Mrays/s"] = benchmark::Counter(double(view.width) * double(view.height) / 1e6,
                                                   benchmark::Counter::kIsIterationInvariantRate);
}

void bare(benchmark::State& state, const Stage& s) {
    const View view = s.target_view(1080);
    const BareEmbree& embree = s.bare();
    for (auto _ : state) benchmark::DoNotOptimize(embree.trace(view));
    count_rays(state, view);
}

void ids(benchmark::State& state, const Stage& s) {
    const View view = s.target_view(1080);
    for (auto _ : state) benchmark::DoNotOptimize(trace_ids(s.whole(), view, view.window(), one_thread()));
    count_rays(state, view);
}

} // namespace

void add_primary(const Settings& settings) {
    for (const SceneSpec& spec :
         settings.quick ? scenes({"balls", "assembly"}) : scenes({"balls", "assembly", "body", "worm", "engine"})) {
        add("primary/" + spec.name + "/bare", [spec](benchmark::State& state) { bare(state, stage(spec)); });
        add("primary/" + spec.name + "/ids", [spec](benchmark::State& state) { ids(state, stage(spec)); });
    }
}

} // namespace porthole::bench
