#include <map>
#include <memory>

#include "benchmarks.h"
#include "porthole/render/compare.h"
#include "scenes.h"

namespace porthole::bench {
namespace {

struct Case {
    SceneSpec scene;
    int height_px, samples;
};

/// The picture with every pixel traced; `adaptive` is compared with it.
const Frame& full_picture(const Case& c, const View& view, const RenderParams& params) {
    static std::map<std::string, std::unique_ptr<Frame>> pictures;
    std::unique_ptr<Frame>& p =
        pictures[c.scene.name + ' ' + std::to_string(c.height_px) + ' ' + std::to_string(c.samples)];
    if (!p)
        p = std::make_unique<Frame>(render(stage(c.scene).whole(), nullptr, view, full_of(params), nullptr, nullptr));
    return *p;
}

void picture(benchmark::State& state, const Case& c, Refine refine) {
    const Stage& s = stage(c.scene);
    const View view = s.view(c.height_px);
    const RenderParams params{.samples = c.samples, .refine = refine};
    const Frame& full = full_picture(c, view, params);
    Frame last;
    for (auto _ : state) last = render(s.whole(), nullptr, view, params, nullptr, nullptr, one_thread());
    count_differences(state, last, full);
}

void add_case(const Case& c) {
    const std::string name =
        "refine/" + c.scene.name + '/' + (c.height_px == 2160 ? "4K" : "1080p") + '/' + std::to_string(c.samples) + '/';
    add(name + "full", [c](benchmark::State& state) { picture(state, c, Refine::full); });
    add(name + "adaptive", [c](benchmark::State& state) { picture(state, c, Refine::adaptive); });
}

} // namespace

void add_refine(const Settings& settings) {
    const std::vector<SceneSpec> small = scenes({"spheres", "wires", "assembly"});
    const std::vector<SceneSpec> all = scenes(
        {"spheres", "wires", "assembly", "engine", "house", "mosquito", "office", "saw", "body", "worm", "head"});
    for (const SceneSpec& scene : settings.quick ? small : all) add_case({scene, 1080, 1});
    if (settings.quick) return;
    for (const SceneSpec& scene : scenes({"assembly"})) add_case({scene, 1080, RenderParams{}.samples});
    for (const SceneSpec& scene : scenes({"spheres", "assembly"})) add_case({scene, 2160, 1});
}

} // namespace porthole::bench
