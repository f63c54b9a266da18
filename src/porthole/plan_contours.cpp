#include "porthole/plan.h"
#include "porthole/trace/coverage.h"

namespace porthole {

TargetContours find_target_contours(const Subject& subject, const View& view, ContourMethod method,
                                    const Control& control) {
    TargetContours found;
    const Bvh& bvh = subject.target_bvh;
    if (method == ContourMethod::paper) {
        PaperContours paper = find_contours_paper(
            [&](std::span<const Vec2i> pixels) { return trace_ids_at(bvh, view, pixels); }, view.window());
        return {std::move(paper.contours), paper.step1_rays + paper.step2_rays};
    }
    if (method == ContourMethod::full) {
        found.contours = find_contours(trace_ids(bvh, view, view.window(), control, &found.rays).id);
        return found;
    }

    const Doubt doubt = method == ContourMethod::fast ? Doubt::guess : Doubt::trace;
    const Coverage targets =
        cover(bvh, subject.targets, subject.boxes, view, view.window(), doubt, control, &found.rays);
    found.contours = find_contours(targets.hit, targets.window);
    return found;
}

} // namespace porthole
