// porthole reveal: the picture with a hole through which the targets are seen.
#include "porthole/reveal.h"

#include <cmath>
#include <filesystem>

#include "picture.h"
#include "porthole/debug.h"
#include "porthole/io/files.h"
#include "porthole/io/image_file.h"
#include "porthole/scene/select.h"
#include "session.h"

namespace porthole::cli {

namespace {

std::vector<PartId> select_and_tell(const Scene& scene, const std::vector<std::string>& selectors,
                                    const std::string& option, Output& out) {
    for (const SelectorMatch& match : match_selectors(scene, selectors, option)) {
        const std::string name = match.selector.size() > 60 ? match.selector.substr(0, 60) + "..." : match.selector;
        out.info(option + ' ' + escaped(name) + ": " + with_commas(std::int64_t(match.parts.size())) +
                 (match.parts.size() == 1 ? " part" : " parts"));
        for (std::size_t i = 0; i < match.parts.size() && i < 20; ++i)
            out.detail("  #" + std::to_string(index(match.parts[i])) + ' ' +
                       escaped(scene.parts[index(match.parts[i])].path));
    }
    return select_parts(scene, selectors, option);
}

void write_debug_pictures(const RevealOptions& options, const Revealed& revealed) {
    std::error_code failed;
    std::filesystem::create_directories(options.debug_dir, failed);
    if (failed) throw Error(ErrorKind::output, "E0801", options.debug_dir, "cannot be made: " + failed.message());
    const Frame* const after = revealed.plan.nothing_revealed() ? nullptr : &revealed.frame;
    for (const NamedPicture& p : debug_pictures(revealed.plan, nullptr, after, &revealed.inferred))
        write_file((std::filesystem::path(options.debug_dir) / (p.name + ".png")).string(), encode_png(p.picture, 4),
                   options.picture.no_clobber);
}

/// Says what became of the targets. @return how many were neither absent nor refused.
std::size_t tell_targets(Report& report, const RevealOptions& options) {
    std::size_t opened = 0;
    for (const TargetReport& target : report.targets) {
        if (target.refused.empty()) {
            ++opened;
        } else if (target.refused == "absent") {
            report.warnings.push_back({"W0104", target.path, "absent: no pixel of this target is in the picture"});
        } else {
            report.warnings.push_back(
                {"W0105", target.path,
                 "refused: " + target.refused + " for a hole" +
                     (options.plan.tight == Tight::refuse
                          ? "; --tight open opens it all the same, --tight ghost shows it through thin walls"
                          : "")});
        }
    }
    return opened;
}

std::string percent(double share) {
    // Rounded towards what is not yet reached: "100 %" means all of it.
    return std::to_string(int(std::floor(share * 100 + 1e-9))) + " %";
}

std::string summary(const Report& report, bool ghost) {
    double before = 0, after = 0;
    int n = 0;
    for (const TargetReport& target : report.targets)
        if (target.refused.empty() && target.visible_before && target.visible_after)
            before += *target.visible_before, after += *target.visible_after, ++n;
    if (n == 0) return "no target is seen";
    return with_commas(n) + (n == 1 ? " target" : " targets") + ", visible " + percent(before / n) + " -> " +
           percent(after / n) +
           (report.nothing_to_cut ? "; nothing hides them, so there is no hole"
            : ghost               ? "; through " + with_commas(std::int64_t(report.cut_parts.size())) + " thin parts"
                                  : "; hole of " + with_commas(report.picture.hole_pixels) + " px through " +
                          with_commas(std::int64_t(report.cut_parts.size())) + " parts");
}

} // namespace

int run_reveal(const RevealOptions& options, Output& out, const Control& control) {
    const Stopwatch total;
    const PictureOptions& picture = options.picture;
    check_outputs(picture, memory_limit(options.common));
    const Scene scene = load(options.common, out, control);
    require_parts(scene);
    ModelDigest digest = digest_model(options.common, picture, control);
    const double loaded = total.seconds();

    RevealParams params;
    params.targets = select_and_tell(scene, options.target, "--target", out);
    params.keep = select_and_tell(scene, options.keep, "--keep", out);
    params.cut_only = select_and_tell(scene, options.cut_only, "--cut-only", out);
    params.keep_see_through = options.keep_see_through;
    params.rest = options.rest;
    params.camera = picture.camera;
    params.width = picture.size.x, params.height = picture.size.y;
    params.plan = options.plan;
    params.plan.solidity.solid = select_and_tell(scene, options.solid, "--solid", out);
    params.plan.solidity.shell = select_and_tell(scene, options.shell, "--shell", out);
    params.render = picture.render;
    params.compare_full = picture.compare_full;

    const Stopwatch building;
    out.progress("build", 0);
    const MeshBvhs meshes = build_mesh_bvhs(scene, {.isa = picture.isa}, control);
    const double built = building.seconds();
    Revealed revealed = reveal(meshes, params, control);
    out.done();
    Report& report = revealed.report;
    const std::size_t opened = tell_targets(report, options);
    for (const Warning& warning : report.warnings) out.warning(warning);

    const Stopwatch writing;
    if (!options.debug_dir.empty()) write_debug_pictures(options, revealed);
    if (!picture.output.empty() && opened > 0) {
        out.progress("write", 0);
        write_picture(revealed.frame, picture, report.picture, control);
        out.done(picture.output == "-" ? "standard output" : escaped(picture.output));
    }
    report.run.load = loaded, report.run.build = built;
    report.run.write = writing.seconds(), report.run.total = total.seconds();
    fill_report(report, "reveal", scene, options.common, picture, std::move(digest));
    write_report(report, picture);

    if (opened == 0) {
        out.error({ErrorKind::usage, "E0130", escaped(scene.source),
                   "nothing revealed: every target is absent or refused; no picture was written"});
        return kExitNothingRevealed;
    }
    out.info(summary(report, revealed.plan.ghost) + ", " + in_seconds(report.run.total));
    if (report.refinement) out.info(summary(*report.refinement, params.render.refine));
    return options.strict && opened < report.targets.size() ? kExitNothingRevealed : kExitDone;
}

} // namespace porthole::cli
