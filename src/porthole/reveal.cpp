#include "porthole/reveal.h"

#include <algorithm>
#include <chrono>

#include "porthole/viewpoint.h"

namespace porthole {

namespace {

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

} // namespace

Subject make_subject(const MeshBvhs& meshes, const RevealParams& params, const Control& control) {
    return make_subject(meshes, params.targets, kept_parts(meshes.scene(), params), params.cut_only, control);
}

RenderParams look_of(const RevealParams& params) {
    RenderParams look = params.render;
    if (params.plan.style == HoleStyle::paper) look.shading = Shading::flat;
    return look;
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
    if (params.plan.style != HoleStyle::paper) plan_caps(subject, revealed.plan, params.plan.solidity, control);
    const double planned = seconds_since(start);
    report_progress("plan", 1);

    // The plain picture first; the hole is drawn over it, so nothing changes outside.
    const RenderParams look = look_of(params);
    Bvh opened = build_bvh(meshes, all_parts(scene), revealed.plan.cut.role, revealed.plan.cut.level);
    const Caps caps = trace_caps(opened, revealed.plan.cut, revealed.plan.solids, revealed.plan.target_ids.id, control,
                                  &revealed.plan.rays.caps);
    add_caps(opened, caps.mesh);
    Frame plain;
    if (!revealed.plan.nothing_revealed()) {
        plain = render_around(subject.whole, view, look, revealed.plan.cut, control);
        if (revealed.plan.nothing_to_cut()) {
            revealed.frame = plain;
        } else {
            const Bvh targets = build_bvh(meshes, revealed.plan.opened);
            revealed.frame = render(opened, &targets, view, look, &revealed.plan.cut, &plain, control, &caps);
        }
    } else {
        plain.ids = trace_ids(subject.whole, view, view.window(), control, &plain.rays.primary);
    }
    const double rendered = seconds_since(start) - planned;

    revealed.report = measure(subject, revealed.plan, opened, plain,
                              revealed.plan.nothing_revealed() ? plain : revealed.frame, control);
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
