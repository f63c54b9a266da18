#include "porthole/reveal.h"

#include <algorithm>
#include <chrono>
#include <ctime>
#include <functional>
#include <optional>

#include "porthole/crumbs.h"
#include "porthole/viewpoint.h"

namespace porthole {

namespace {

/// Draws by `draw`, which gives the picture and all its rays; if `compare`, once more with every pixel
/// traced, and says in `refinement` how the two compare.
Frame draw_compared(const Scene& scene, const RenderParams& look, bool compare,
                    const std::function<std::pair<Frame, RayCounts>(const RenderParams&)>& draw,
                    std::optional<RefinementReport>& refinement) {
    if (!compare) return draw(look).first;
    const auto timed = [&](const RenderParams& by, RefinementReport::Seconds& seconds) {
        const auto start = std::chrono::steady_clock::now();
        const std::clock_t cpu = std::clock();
        auto drawn = draw(by);
        seconds.wall = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
        seconds.cpu = double(std::clock() - cpu) / CLOCKS_PER_SEC;
        return drawn;
    };
    RefinementReport report;
    auto [frame, rays] = timed(look, report.time);
    const auto [full, full_rays] = timed(full_of(look), report.full_time);
    report.figures = compare_frames(frame, full, look.background);
    report.figures.rays = rays, report.figures.full_rays = full_rays;
    for (const PartId id : report.figures.missed) report.missed_parts.push_back(scene.parts[index(id)].path);
    refinement = std::move(report);
    return std::move(frame);
}

double seconds_since(std::chrono::steady_clock::time_point start) {
    return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

bool is_see_through(const Scene& scene, const Part& part) {
    const std::vector<Submesh>& runs = scene.meshes[part.mesh].submeshes;
    return std::any_of(runs.begin(), runs.end(), [&](const Submesh& s) {
        const Material& m = scene.materials[s.material];
        return m.alpha_mode == AlphaMode::blend || m.transmission > 0;
    });
}

std::vector<PartId> kept_parts(const Scene& scene, const RevealParams& params) {
    std::vector<PartId> kept = params.keep;
    if (params.keep_see_through)
        for (const PartId id : all_parts(scene))
            if (is_see_through(scene, scene.parts[index(id)])) kept.push_back(id);
    return kept;
}

/// 1 for parts that are neither targets, nor kept, nor cut.
std::vector<std::uint8_t> rest_of(const Scene& scene, const RevealParams& params, const ViewPlan& plan) {
    std::vector<std::uint8_t> rest(scene.parts.size(), 1);
    for (const std::vector<PartId>& others : {params.targets, kept_parts(scene, params), plan.cut_set})
        for (const PartId id : others) rest[index(id)] = 0;
    return rest;
}

/// The ids that were inferred of a picture, from those of another that shows the same there.
void take_inferred_ids(Frame& frame, const IdBuffer& ids) {
    for (std::size_t i = 0; i < frame.inferred.pixels().size(); ++i) {
        if (!frame.inferred.pixels()[i]) continue;
        frame.ids.id.pixels()[i] = ids.id.pixels()[i];
        frame.ids.depth.pixels()[i] = ids.depth.pixels()[i];
    }
    frame.inferred = {};
}

struct Pictures {
    Frame plain; ///< around the hole; empty if the plan is a ghost
    Frame frame;
};

/// The pictures of a plan. The hole is drawn over the plain one, so nothing changes outside.
/// @param whole   hierarchy of all that is solid.
/// @param opened  the same with the roles of the plan's cut.
Pictures draw(const ViewPlan& plan, const Bvh& whole, const Bvh& opened, const Bvh& targets, const Caps& caps,
              const RenderParams& look, const Control& control) {
    if (plan.ghost && !plan.nothing_to_cut())
        return {{}, render(whole, &targets, plan.view, look, nullptr, nullptr, control)};
    Pictures drawn;
    drawn.plain = render_around(whole, plan.view, look, plan.cut, control);
    drawn.frame = plan.nothing_to_cut()
                      ? drawn.plain
                      : render(opened, &targets, plan.view, look, &plan.cut, &drawn.plain, control, &caps);
    return drawn;
}

} // namespace

Subject make_subject(const MeshBvhs& meshes, const RevealParams& params, const Control& control) {
    return make_subject(meshes, params.targets, kept_parts(meshes.scene(), params), params.cut_only, control);
}

RenderParams look_of(const RevealParams& params) {
    RenderParams look = params.render;
    if (params.plan.style == HoleStyle::paper) look.shading = Shading::flat;
    if (is_selective(look.refine)) look.samples = 1;
    return look;
}

Frame render_plain(const MeshBvhs& meshes, const Bvh& whole, const View& view, const RevealParams& params,
                   const Control& control, std::optional<RefinementReport>* refinement) {
    const RenderParams look = look_of(params);
    if (params.wire.wire != Wire::none)
        return render_wireframe(meshes, all_parts(meshes.scene()), view, params.wire, look.background, control);
    const auto draw_by = [&](const RenderParams& by) {
        Frame frame = render(whole, nullptr, view, by, nullptr, nullptr, control);
        const RayCounts rays = frame.rays;
        return std::pair{std::move(frame), rays};
    };
    std::optional<RefinementReport> ignored;
    return draw_compared(meshes.scene(), look, params.compare_full && refinement, draw_by,
                         refinement ? *refinement : ignored);
}

Revealed reveal(const MeshBvhs& meshes, const RevealParams& params, const Control& control) {
    const Scene& scene = meshes.scene();
    const auto start = std::chrono::steady_clock::now();
    const auto report_progress = [&](std::string_view stage, double share) {
        if (control.progress) control.progress(stage, share);
    };

    // Who is to be seen, who may be cut, from where.
    report_progress("plan", 0);
    const Subject subject = make_subject(meshes, params, control);
    const auto choose = [&] {
        const FrameSubject framing = frame_subject(scene, params.targets, control);
        if (!is_auto(params.camera)) return make_view(scene, framing, params.camera, params.width, params.height);
        const Vec3f toward_eye =
            best_direction(subject, framing, params.camera, params.width, params.height, params.plan, control);
        return view_from_direction(framing, toward_eye, params.camera, params.width, params.height);
    };
    const View view = params.view ? *params.view : choose();

    Revealed revealed;
    revealed.plan = plan_view(subject, view, params.plan, control);
    ViewPlan& plan = revealed.plan;
    const bool has_caps = params.plan.style != HoleStyle::paper && !plan.ghost;
    if (has_caps) plan_caps(subject, plan, params.plan.solidity, control);
    const double planned = seconds_since(start);
    report_progress("plan", 1);

    const RenderParams look = look_of(params);
    const std::vector<PartId> all = all_parts(scene);
    const std::vector<std::uint8_t> rest = rest_of(scene, params, plan);
    // What becomes a thin shell is taken out of the scene, so that light gets in, and laid over.
    std::vector<PartId> shell = plan.ghost ? plan.cut_set : std::vector<PartId>{};
    if (params.rest == Rest::ghost)
        std::copy_if(all.begin(), all.end(), std::back_inserter(shell), [&](PartId id) { return rest[index(id)]; });
    Bvh opened = build_bvh(meshes, all, plan.cut.role, plan.cut.level);
    const Bvh targets = build_bvh(meshes, plan.opened);
    Frame plain;
    Caps caps;
    std::optional<RefinementReport> refinement;
    std::int64_t measuring_rays = 0;
    if (plan.nothing_revealed() || !shell.empty())
        plain.ids = trace_ids(subject.whole, view, view.window(), control, &plain.rays.primary);
    if (!plan.nothing_revealed()) {
        std::optional<Bvh> solid, solid_opened;
        if (!shell.empty()) {
            std::sort(shell.begin(), shell.end());
            std::vector<PartId> left;
            std::set_difference(all.begin(), all.end(), shell.begin(), shell.end(), std::back_inserter(left));
            solid.emplace(build_bvh(meshes, left));
            solid_opened.emplace(build_bvh(meshes, left, plan.cut.role, plan.cut.level));
        }
        const Bvh& around = solid ? *solid : subject.whole;
        Bvh& inside = solid_opened ? *solid_opened : opened;
        if (has_caps) caps = remove_crumbs(subject, plan, opened, targets, control);
        add_caps(inside, caps.mesh);
        const bool cut = !plan.ghost && !plan.nothing_to_cut();
        const auto draw_by = [&](const RenderParams& by) {
            auto [around_hole, frame] = draw(plan, around, inside, targets, caps, by, control);
            const Drawn drawn{cut ? inside : around, &targets, cut ? &plan.cut : nullptr,
                              cut ? &caps : nullptr, view,     by};
            if (params.rest != Rest::keep || !shell.empty())
                measuring_rays += trace_inferred_ids(around, view, frame, view.window(), control);
            restyle(frame, drawn, rest, params.rest, control);
            if (!shell.empty()) lay_shell(frame, drawn, build_bvh(meshes, shell), control);
            RayCounts rays = frame.rays;
            if (cut) rays += around_hole.rays;
            // What is compared and measured is the first one drawn.
            if (!solid && plain.ids.window().empty()) plain = std::move(around_hole);
            return std::pair{std::move(frame), rays};
        };
        revealed.frame = draw_compared(scene, look, params.compare_full, draw_by, refinement);
        revealed.inferred = revealed.frame.inferred;
        measuring_rays += trace_inferred_ids(around, view, plain, view.window(), control);
        if (!shell.empty() || !cut)
            measuring_rays += trace_inferred_ids(around, view, revealed.frame, view.window(), control);
        else
            take_inferred_ids(revealed.frame, plain.ids);
    }
    const double rendered = seconds_since(start) - planned;

    revealed.report = measure(subject, plan, opened, plain, plan.nothing_revealed() ? plain : revealed.frame, control);
    revealed.report.measuring_rays = measuring_rays;
    revealed.report.refinement = std::move(refinement);
    set_options(revealed.report, scene, params);
    revealed.report.options.view = view;
    revealed.report.camera = is_auto(params.camera)         ? "auto"
                             : params.camera.name == "auto" ? "custom"
                                                            : params.camera.name;
    revealed.report.run.plan = planned;
    revealed.report.run.render = rendered;
    revealed.report.run.threads = thread_count(control);
    return revealed;
}

} // namespace porthole
