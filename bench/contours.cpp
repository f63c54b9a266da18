#include "porthole/hole/contour.h"

#include <algorithm>
#include <iterator>
#include <map>
#include <memory>

#include "benchmarks.h"
#include "porthole/scene/camera.h"
#include "scenes.h"

namespace porthole::bench {
namespace {

struct Case {
    SceneSpec scene;
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

/// The targets of a case with their yardsticks.
struct ContourStage {
    Subject subject;
    View view;
    FlatEmbree flat;
    std::vector<Vec2i> truth; ///< contour pixels of the full target id buffer

    ContourStage(const Stage& s, int count)
        : subject(make_subject(s.meshes(), chosen(s.scene(), count))), flat(s.scene(), subject.targets) {
        view = view_from_direction(frame_subject(s.scene(), subject.targets), {1.0f, 0.8f, 1.0f}, {}, 1920, 1080);
        truth = contour_pixels(find_contours(trace_ids(subject.target_bvh, view, view.window()).id));
    }
};

const ContourStage& contour_stage(const Case& c) {
    static std::map<std::string, std::unique_ptr<ContourStage>> stages;
    std::unique_ptr<ContourStage>& s = stages[c.scene.name + std::to_string(c.targets)];
    if (!s) s = std::make_unique<ContourStage>(stage(c.scene), c.targets);
    return *s;
}

struct Found {
    std::vector<Contour> contours;
    std::int64_t rays = 0;
};

/// The paper's method as it would run on this tracer: one hierarchy of the whole scene, in which
/// a ray mask picks the targets; ids when they are first asked for.
Found by_paper(const ContourStage& s, const Control&) {
    PaperContours paper = find_contours_paper(
        [&](std::span<const Vec2i> pixels) { return trace_ids_at(s.subject.whole, s.view, pixels, kMaskFixed); },
        s.view.window());
    return {std::move(paper.contours), paper.step1_rays + paper.step2_rays};
}

/// The same where the scene is one flat hierarchy, so that the mask leaves out triangles, not parts.
Found by_paper_flat(const ContourStage& s, const Control&) {
    PaperContours paper = find_contours_paper(
        [&](std::span<const Vec2i> pixels) { return s.flat.ids_at(s.view, pixels); }, s.view.window());
    return {std::move(paper.contours), paper.step1_rays + paper.step2_rays};
}

template <ContourMethod method> Found by(const ContourStage& s, const Control& control) {
    TargetContours found = find_target_contours(s.subject, s.view, method, control);
    return {std::move(found.contours), found.rays};
}

using Method = Found (*)(const ContourStage&, const Control&);

void measure(benchmark::State& state, const Case& c, Method method) {
    const ContourStage& s = contour_stage(c);
    Found found;
    for (auto _ : state) found = method(s, one_thread());

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

void add_contours(const Settings& settings) {
    const std::pair<const char*, Method> methods[] = {{"paper", by_paper},
                                                      {"paper_flat", by_paper_flat},
                                                      {"full", by<ContourMethod::full>},
                                                      {"exact", by<ContourMethod::exact>},
                                                      {"fast", by<ContourMethod::fast>}};
    for (const SceneSpec& spec : settings.quick ? scenes({"crowd", "assembly"})
                                                : scenes({"crowd", "clutter", "assembly", "engine", "body", "worm"}))
        for (const int targets : {1, 10, 100})
            for (const auto& [name, method] : methods)
                add("contours/" + spec.name + '/' + std::to_string(targets) + '/' + name,
                    [c = Case{spec, targets}, m = method](benchmark::State& state) { measure(state, c, m); });
}

} // namespace porthole::bench
