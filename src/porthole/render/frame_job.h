// A picture in steps: shown early, then refined without starting over.
#pragma once

#include <compare>
#include <memory>

#include "porthole/render/render.h"

namespace porthole {

/// How far a picture is.
enum class FrameStep : std::uint8_t {
    none,
    preview,     ///< blocks of 4x4 pixels every 16 are traced, all else is interpolated, across edges too
    refined,     ///< what RenderParams::refine asks for, a sample a pixel
    antialiased, ///< more samples where they are needed
    complete     ///< lines too: what render() returns
};

/// Which of two pictures is to be shown: the greater one, of the newer camera, or farther on.
struct FrameStamp {
    std::uint64_t generation = 0;
    FrameStep step = FrameStep::none;
    friend auto operator<=>(const FrameStamp&, const FrameStamp&) = default;
};

/// What is drawn. What it points to has to outlive the job.
struct Shot {
    const Bvh* whole = nullptr;   ///< every part
    const Bvh* targets = nullptr; ///< as render() wants them
    View view;
    RenderParams params;
    const Cut* cut = nullptr;    ///< null: a plain picture
    const Bvh* opened = nullptr; ///< every part, with the roles of `cut`; null exactly when `cut` is
    const Caps* caps = nullptr;  ///< of the cut; may be null
};

/// Draws a picture step by step.
///
/// Every step ends in a complete picture. What earlier steps traced, later ones keep: but for what
/// mirrors and glass show in the preview, no ray is traced twice. The picture of the last step is
/// that of render() without a cut, of render_around() and render() over it with one, bit for bit,
/// its rays included. The hole has the same steps as what is around it. Steps without work are
/// left out: the paper's ways of refinement have no preview.
///
/// When step() throws Cancelled, what is finished is kept: step() called again goes on where the
/// job was stopped, to the same bits, and frame() is still that of the last step, in places ahead of
/// it. (The paper's ways begin the step again.) Or the job is thrown away. After any other
/// exception it has to be.
///
/// One thread at a time; step() itself uses as many as `control` says, and gives the same bits
/// for any number. A stop asked for on another thread is obeyed when the tiles of 64x64 pixels in
/// work are done. Cost: a preview of 1920x1080 traces 6.5 % of the pixels at most, as much more of a
/// narrow hole as it needs; 26 more bytes a pixel until the next step is done.
///
///   FrameJob job({.whole = &bvh, .view = view}, ++generation);
///   while (job.step(control))
///       if (job.stamp() > shown) show(job.frame()), shown = job.stamp();
class FrameJob {
public:
    /// @throws Error usage E0140 when a parameter is out of range; limit E0902 when memory runs out.
    explicit FrameJob(const Shot& shot, std::uint64_t generation = 0);
    FrameJob(FrameJob&&) noexcept;
    FrameJob& operator=(FrameJob&&) noexcept;
    ~FrameJob();

    /// Draws as far as the next step. Reports progress as stage "render", [0, 1] over all steps.
    /// @return false if the picture was complete already.
    /// @throws Cancelled; Error limit E0902 when memory runs out.
    bool step(const Control& control = {});
    [[nodiscard]] FrameStamp stamp() const;
    /// The picture of the last step; empty before the first. `inferred` is 1 where ids were not
    /// traced, in the hole too; rays are those of all steps so far, those for a preview alone in
    /// its own picture only.
    [[nodiscard]] Frame frame() const&;
    /// The same without a copy; the job can only be destroyed then.
    [[nodiscard]] Frame frame() &&;

private:
    struct Pictures;
    std::unique_ptr<Pictures> pictures_;
    std::uint64_t generation_ = 0;
    FrameStep step_ = FrameStep::none;
};

} // namespace porthole
