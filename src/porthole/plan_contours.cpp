#include "porthole/plan.h"
#include "porthole/trace/outline.h"

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

    const BlockMask all = mark_blocks(subject.scene(), subject.targets, subject.boxes, view, view.window());
    const std::vector<Vec2i> seeds =
        method == ContourMethod::fast ? outline_seeds(subject.scene(), subject.targets, view) : std::vector<Vec2i>{};
    // Targets keep off the edge of their blocks, except at the picture's own.
    for (const BlockMask& blocks : separate(all)) {
        const Rect box = pixel_rect(blocks, view.window());
        std::vector<Contour> contours;
        if (method == ContourMethod::fast) {
            const Outline outline = trace_outline(bvh, view, box, blocks, seeds, control);
            found.rays += outline.rays;
            contours = find_contours(outline.ids.id);
        } else {
            contours = find_contours(trace_ids_in_blocks(bvh, view, box, blocks, control, &found.rays).id);
        }
        std::move(contours.begin(), contours.end(), std::back_inserter(found.contours));
    }
    return found;
}

} // namespace porthole
