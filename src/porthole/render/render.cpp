#include "porthole/render/render.h"

#include <cassert>

#include "porthole/render/picture_job.h"

namespace porthole {

namespace {

Frame plain_picture(const PictureJob::Of& of, const Control& control) {
    return within_memory(of.view, [&] {
        PictureJob job(of);
        job.run(FrameStep::complete, control);
        return job.take_plain_frame();
    });
}

} // namespace

Frame render(const Bvh& bvh, const Bvh* targets, const View& view, const RenderParams& params, const Cut* cut,
             const Frame* under, const Control& control, const Caps* caps) {
    assert(!cut == !under);
    if (!cut) return plain_picture({.bvh = bvh, .targets = targets, .view = view, .params = params}, control);
    check(params);
    return within_memory(view, [&] {
        Frame frame = *under;
        frame.rays = {};
        frame.inside = Mask(view.window(), 0);
        const PictureJob::Of hole{bvh, targets, view, params, cut, caps, nullptr, &frame.ids};
        const Rect window = PictureJob::window(hole);
        if (window.empty()) return frame;
        // Lines are drawn where the hole shows another surface than was there.
        frame.rays.primary = trace_inferred_ids(bvh, view, frame, window, control);
        PictureJob job(hole);
        job.run(FrameStep::complete, control);
        job.lay_over(frame);
        return frame;
    });
}

Frame render_around(const Bvh& bvh, const View& view, const RenderParams& params, const Cut& cut,
                    const Control& control) {
    return plain_picture({.bvh = bvh, .view = view, .params = params, .covering = &cut}, control);
}

} // namespace porthole
