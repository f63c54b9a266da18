#include <map>
#include <memory>

#include "benchmarks.h"
#include "cut_frame.h"
#include "scenes.h"

namespace porthole::bench {
namespace {

/// A cutaway with its yardsticks, planned when first asked for.
struct CutStage {
    CutFrame cut;
    AbsentScene absent;
    Frame around;
    explicit CutStage(const Stage& s)
        : cut(s.subject(), s.target_view(1080)), absent(cut),
          around(render_around(s.subject().whole, cut.view, {}, cut.plan.cut)) {}
};

const CutStage& cut_stage(const SceneSpec& spec) {
    static std::map<std::string, std::unique_ptr<CutStage>> stages;
    std::unique_ptr<CutStage>& s = stages[spec.name];
    if (!s) s = std::make_unique<CutStage>(stage(spec));
    return *s;
}

void plan(benchmark::State& state, const SceneSpec& spec) {
    const CutStage& c = cut_stage(spec);
    for (auto _ : state) benchmark::DoNotOptimize(plan_view(*c.cut.subject, c.cut.view, {}, one_thread()));
}

void plain(benchmark::State& state, const SceneSpec& spec) {
    const CutStage& c = cut_stage(spec);
    for (auto _ : state)
        benchmark::DoNotOptimize(render(c.cut.subject->whole, nullptr, c.cut.view, {}, nullptr, nullptr, one_thread()));
}

/// The same work in every picture: a hole has more samples than what is around it, and lines.
RenderParams one_sample() { return {.samples = 1, .lines = Lines::none}; }

void cutaway(benchmark::State& state, const SceneSpec& spec, const RenderParams& params) {
    const CutStage& c = cut_stage(spec);
    for (auto _ : state) benchmark::DoNotOptimize(c.cut.draw(true, params, one_thread()));
}

/// The yardstick of cutaway(): the removed geometry is truly absent.
void absent(benchmark::State& state, const SceneSpec& spec, const RenderParams& params) {
    const CutStage& c = cut_stage(spec);
    for (auto _ : state)
        benchmark::DoNotOptimize(render(*c.absent.bvh, nullptr, c.cut.view, params, nullptr, nullptr, one_thread()));
}

void hole(benchmark::State& state, const SceneSpec& spec, bool capped, const RenderParams& params) {
    const CutStage& c = cut_stage(spec);
    for (auto _ : state) benchmark::DoNotOptimize(c.cut.draw_hole(capped, params, c.around, one_thread()));
}

} // namespace

void add_cut(const Settings& settings) {
    for (const SceneSpec& spec : settings.quick ? scenes({"balls"}) : scenes({"balls", "assembly", "engine", "body"})) {
        const auto add_part = [&](const std::string& what, auto function) {
            add("cut/" + spec.name + '/' + what, [=](benchmark::State& state) { function(state, spec); });
        };
        add_part("plan", plan);
        add_part("plain", plain);
        for (const bool one : {false, true}) {
            const RenderParams params = one ? one_sample() : RenderParams{};
            const auto add_look = [&](const std::string& what, auto function) {
                add_part(one ? what + "_one_sample" : what, function);
            };
            add_look("cutaway", [=](benchmark::State& s, const SceneSpec& c) { cutaway(s, c, params); });
            add_look("absent", [=](benchmark::State& s, const SceneSpec& c) { absent(s, c, params); });
            add_look("hole_capped", [=](benchmark::State& s, const SceneSpec& c) { hole(s, c, true, params); });
            add_look("hole_uncapped", [=](benchmark::State& s, const SceneSpec& c) { hole(s, c, false, params); });
        }
    }
}

} // namespace porthole::bench
