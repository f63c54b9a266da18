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
    const Scene scene = load(options.common, out, control);
    require_parts(scene);
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
    RenderParams look = picture.render;
    if (options.mode == RenderOptions::Mode::flat) look.shading = Shading::flat;
    WireParams wire = options.wire;
    wire.background = look.background;
    const Frame frame = options.mode == RenderOptions::Mode::wireframe
                            ? render_wireframe(meshes, all_parts(scene), view, wire, control)
                            : render(whole, nullptr, view, look, nullptr, nullptr, control);
    report.run.render = drawing.seconds();

    const Stopwatch writing;
    if (!picture.output.empty()) {
        out.progress("write", 0);
        write_picture(frame, picture, report.picture);
        out.done(picture.output == "-" ? "standard output" : escaped(picture.output));
    }
    report.run.write = writing.seconds();

    report.view = view;
    report.options.render = look;
    report.nothing_to_cut = true;
    report.frame_rays = frame.rays;
    report.run.threads = thread_count(control);
    report.run.total = total.seconds();
    fill_report(report, "render", scene, options.common, picture);
    write_report(report, picture);
    return kExitDone;
}

} // namespace porthole::cli
