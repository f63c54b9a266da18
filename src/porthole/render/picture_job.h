// All passes of one picture in their order: the one flow behind render() and FrameJob.
#pragma once

#include <functional>
#include <optional>

#include "porthole/base/tile_loop.h"
#include "porthole/render/adaptive.h"
#include "porthole/render/frame_job.h"
#include "porthole/render/linework.h"
#include "porthole/render/preview.h"

namespace porthole {

/// @throws Error usage E0140 when a parameter is out of range.
void check(const RenderParams& params);

/// A lattice that is traced first where not all is decided by it.
struct Lattice {
    BlockMap map;
    Mask blocks; ///< its blocks, and lone_blocks()

    explicit Lattice(const Picture& picture);
};
/// One picture, plain or of a hole, drawn pass by pass. Not for copying: its parts refer to one another.
class PictureJob {
public:
    struct Of {
        const Bvh& bvh;
        const Bvh* targets = nullptr;
        const View& view;
        const RenderParams& params;
        const Cut* cut = nullptr;        ///< the hole that is drawn; null: the plain picture
        const Caps* caps = nullptr;      ///< of the cut
        const Cut* covering = nullptr;   ///< of a plain picture: the hole that will cover it; may be null
        const IdBuffer* plain = nullptr; ///< with a cut: the ids without it, in time for the lines
        bool preview = false;            ///< whether there is a preview
    };
    /// The pixels that have to be drawn; empty if the hole is.
    [[nodiscard]] static Rect window(const Of& of);
    /// @throws Error usage E0140 when a parameter is out of range.
    explicit PictureJob(const Of& of); ///< with a window that is not empty
    PictureJob(const PictureJob&) = delete;
    PictureJob& operator=(const PictureJob&) = delete;

    [[nodiscard]] bool done() const { return at_ == passes_.size(); }
    /// The step that is next; complete if none is.
    [[nodiscard]] FrameStep next() const { return done() ? FrameStep::complete : passes_[at_].step; }
    /// Runs the passes of steps up to `last`. @throws Cancelled: then call it again, or never.
    void run(FrameStep last, const Control& control);
    /// Traces the ids in `window` that were inferred, once the picture is done: what is drawn over it
    /// looks at them. @throws Cancelled: then call it again, or never.
    void trace_ids(const Bvh& bvh, Rect window, const Control& control);
    [[nodiscard]] double share() const { return share_; } ///< of all the work that is done

    [[nodiscard]] const IdBuffer& ids() const { return picture_.buffer.ids; }
    /// The plain picture after the last step: its preview until more is there.
    [[nodiscard]] Frame plain_frame() const;
    /// The same once it is done, without a copy; nothing is left.
    [[nodiscard]] Frame take_plain_frame();
    /// Lays the picture of the hole over the plain one. Rays are added.
    void lay_over(Frame& frame) const;

private:
    using Run = void (PictureJob::*)(const Control&);
    struct Pass {
        FrameStep step;
        double share; ///< of the work
        Run run;
    };
    template <typename Body> void for_levels(int end, const Control& control, Body&& body);
    template <typename Body> void for_tiles(const Control& control, Body&& body);
    [[nodiscard]] const BlockMap& lattice_map() const { return adaptive_ ? adaptive_->map() : lattice_->map; }
    void trace_lattice(const Control&);
    void shade_lattice(const Control&);
    void interpolate(const Control&);
    void gather(const Control&);
    void look(const Control&);
    void choose_tints(const Control&);
    void draw_by_macro_pixels(const Control&);
    void shade(const Control&);
    void infer(const Control&);
    void mark_edges(const Control&);
    void antialias(const Control&);
    void find_rim(const Control&);
    void draw_lines(const Control&);

    const Bvh& bvh_;
    const Bvh* targets_;
    const View view_;
    const RenderParams params_;
    const Cut* cut_;
    const IdBuffer* plain_;
    Camera camera_;
    Picture picture_;
    Lighting lighting_;
    Occlusion occlusion_;
    std::vector<Placement> placements_;
    std::vector<Tint> tints_;
    Stage stage_;
    std::optional<AdaptiveGather> adaptive_; ///< with Refine::adaptive
    std::optional<Lattice> lattice_;         ///< of the preview of other pictures
    std::optional<Preview> preview_;
    RimLine rim_;
    std::vector<Pass> passes_;
    std::size_t at_ = 0;
    double share_ = 0;
    TileLoop loop_;
    int level_ = 0;                           ///< of lattices, in passes that go through them
    std::atomic<std::int64_t> tiles_done_{0}; ///< of the pass that runs
};

/// Calls draw(). @throws Error limit E0902 where that runs out of memory.
template <typename Draw> auto within_memory(const View& view, Draw&& draw) {
    try {
        return draw();
    } catch (const std::bad_alloc&) {
        throw Error(ErrorKind::limit, "E0902", "render",
                    "memory ran out for a picture of " + std::to_string(view.width) + " x " +
                        std::to_string(view.height));
    }
}

} // namespace porthole
