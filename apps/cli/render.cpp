// porthole render: the plain picture.
#include "picture.h"
#include "porthole/io/files.h"
#include "porthole/scene/select.h"
#include "session.h"

namespace porthole::cli {

int run_render(const RenderOptions& options, Output& out, const Control& control) {
    const Stopwatch total;
    const PictureOptions& picture = options.picture;
    check_outputs(picture, memory_limit(options.common));
    if (picture.compare_full && options.mode == RenderOptions::Mode::wireframe)
        throw Error(ErrorKind::usage, "E0105", "--compare-full", "a wireframe has no pixels to infer");
    const Scene scene = load(options.common, out, control);
    require_parts(scene);
    ModelDigest digest = digest_model(options.common, picture, control);
    Report report;
    report.run.load = total.seconds();
    const std::vector<PartId> focus = select_parts(scene, options.focus, "--focus");

    const Stopwatch building;
    out.progress("build", 0);
    const MeshBvhs meshes = build_mesh_bvhs(scene, {.isa = picture.isa}, control);
    const Bvh whole = build_bvh(meshes, all_parts(scene));
    const View view =
        make_view(scene, frame_subject(scene, focus, control), picture.camera, picture.size.x, picture.size.y);
    report.run.build = building.seconds();

    const Stopwatch drawing;
    out.progress("render", 0);
    RevealParams params;
    params.render = picture.render;
    params.compare_full = picture.compare_full;
    params.wire = options.wire;
    if (options.mode == RenderOptions::Mode::flat) params.render.shading = Shading::flat;
    if (options.mode != RenderOptions::Mode::wireframe) params.wire.wire = Wire::none;
    const Frame frame = render_plain(meshes, whole, view, params, control, &report.refinement);
    report.run.render = drawing.seconds();

    const Stopwatch writing;
    if (!picture.output.empty()) {
        out.progress("write", 0);
        write_picture(frame, picture, report.picture, control);
        out.done(picture.output == "-" ? "standard output" : escaped(picture.output));
    }
    report.run.write = writing.seconds();

    report.view = view;
    report.options.render = params.render;
    report.options.wire = params.wire;
    report.options.compare_full = params.compare_full;
    report.nothing_to_cut = true;
    report.frame_rays = frame.rays;
    report.run.threads = thread_count(control);
    report.run.total = total.seconds();
    fill_report(report, "render", scene, options.common, picture, std::move(digest));
    write_report(report, picture);
    if (report.refinement) out.info(summary(*report.refinement, params.render.refine));
    return kExitDone;
}

} // namespace porthole::cli
