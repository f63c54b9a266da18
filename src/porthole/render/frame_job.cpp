#include "porthole/render/frame_job.h"

#include <algorithm>
#include <cassert>

#include "porthole/render/picture_job.h"

namespace porthole {

/// The plain picture and, over it, that of the hole.
struct FrameJob::Pictures {
    View view;
    PictureJob plain;
    std::optional<PictureJob> hole;
    const Bvh* opened;
    Rect hole_window;
    bool has_cut;

    explicit Pictures(const Shot& shot)
        : view(shot.view), plain({.bvh = *shot.whole,
                                  .targets = shot.cut ? nullptr : shot.targets,
                                  .view = view,
                                  .params = shot.params,
                                  .covering = shot.cut,
                                  .preview = true}),
          opened(shot.opened), has_cut(shot.cut != nullptr) {
        if (!shot.cut) return;
        const PictureJob::Of of{*shot.opened, shot.targets, view,         shot.params, shot.cut,
                                shot.caps,    nullptr,      &plain.ids(), true};
        hole_window = PictureJob::window(of);
        if (!hole_window.empty()) hole.emplace(of);
    }

    [[nodiscard]] FrameStep next() const { return hole ? std::min(plain.next(), hole->next()) : plain.next(); }
    [[nodiscard]] bool done() const { return plain.done() && (!hole || hole->done()); }
    void run(FrameStep last, const Control& control) {
        if (!hole) return plain.run(last, control);
        Control half = control;
        const auto report = [&](const PictureJob& other) {
            if (control.progress)
                half.progress = [&](std::string_view stage, double share) {
                    control.progress(stage, 0.5 * (share + std::min(1.0, other.share())));
                };
        };
        report(*hole);
        plain.run(last, half);
        // Lines are drawn where the hole shows another surface than was there. No more than once: nothing
        // is inferred there then.
        if (plain.done()) plain.trace_ids(*opened, hole_window, control);
        report(plain);
        hole->run(last, half);
    }
    /// Of the last step; `plain_frame` holds the picture around the hole.
    [[nodiscard]] Frame with_hole(Frame frame) const {
        if (has_cut) frame.inside = Mask(view.window(), 0);
        if (hole) hole->lay_over(frame);
        return frame;
    }
};

FrameJob::FrameJob(const Shot& shot, std::uint64_t generation) : generation_(generation) {
    assert(shot.whole && !shot.cut == !shot.opened);
    pictures_ = within_memory(shot.view, [&] { return std::make_unique<Pictures>(shot); });
}
FrameJob::FrameJob(FrameJob&&) noexcept = default;
FrameJob& FrameJob::operator=(FrameJob&&) noexcept = default;
FrameJob::~FrameJob() = default;

bool FrameJob::step(const Control& control) {
    if (step_ == FrameStep::complete) return false;
    const FrameStep next = pictures_->next();
    within_memory(pictures_->view, [&] { pictures_->run(next, control); });
    step_ = pictures_->done() ? FrameStep::complete : next;
    return true;
}

FrameStamp FrameJob::stamp() const { return {generation_, step_}; }

Frame FrameJob::frame() const& {
    if (step_ == FrameStep::none) return {};
    return pictures_->with_hole(pictures_->plain.plain_frame());
}

Frame FrameJob::frame() && {
    if (step_ != FrameStep::complete) return std::as_const(*this).frame();
    return pictures_->with_hole(pictures_->plain.take_plain_frame());
}

} // namespace porthole
