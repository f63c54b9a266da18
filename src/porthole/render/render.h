// Whitted-style rendering: nearest hit, shadows, ambient occlusion, reflection, refraction,
// antialiasing where neighbours differ; with a cut, what lies behind it.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "porthole/base/cut.h"
#include "porthole/base/parallel.h"
#include "porthole/base/view.h"
#include "porthole/scene/scene.h"
#include "porthole/trace/bvh.h"
#include "porthole/trace/caps.h"

namespace porthole {

enum class Emphasis : std::uint8_t { accent, saturate, none };
enum class Shading : std::uint8_t { raytraced, flat };

/// Which pixels are traced; the others take their colour from those around. See docs/method.md.
enum class Refine : std::uint8_t {
    full,     ///< all of them: the oracle
    adaptive, ///< blocks of 4x4 where neighbouring ones differ
    paper1,   ///< the paper's first version: macro pixels, each compared with three neighbours
    paper2,   ///< its second: guide pixels of a block
    expansion ///< selective expansion: blocks that a first sampling hits, grown until nothing new is hit
};

/// Whether pixels are traced as the paper does: one ray at the centre of each, whatever the samples.
[[nodiscard]] constexpr bool is_selective(Refine refine) {
    return refine == Refine::paper1 || refine == Refine::paper2 || refine == Refine::expansion;
}

/// How the paper's ways go about it.
struct RefineParams {
    enum class Surface : std::uint8_t {
        part, ///< pixels see the same surface when they see the same part
        face  ///< or the same triangle
    };
    int macro_px = 8;     ///< size of a macro pixel, a power of two, [1, 256]
    int threshold_px = 1; ///< smallest block, not subdivided, a power of two, at most macro_px
    Surface surface = Surface::part;
    /// Of paper2: 3 to 64 positions in a block, from (0, 0), its first pixel, to (1, 1), its last one;
    /// not all on one line.
    std::vector<Vec2f> guides{{0, 0}, {1, 0}, {0, 1}, {1, 1}};
};

/// How the cut through solid material is drawn.
enum class CapStyle : std::uint8_t {
    own,  ///< the part's colour, darker or greyer than its outside
    tint, ///< RenderParams::cap_tint
    hatch ///< lines of constant width on the screen, in every part's own direction
};
enum class Lines : std::uint8_t {
    none,
    rim, ///< of the hole: its rim, and where its cut surfaces end; none with flat shading
    all  ///< outlines, steps and creases of all parts as well, outside the hole too
};

struct RenderParams {
    int samples = 16;     ///< most samples per pixel, [1, 4096], spent where neighbours differ, and twice as many in
                          ///< the hole; 1: one at each centre
    bool uniform = false; ///< all the samples in every pixel, whatever `refine` says: the oracle of antialiasing, dear
    int ao_samples = 4;   ///< ambient occlusion rays per pixel, [0, 256]; sixteen neighbours share theirs
    bool shadows = true;
    int max_bounces = 6; ///< reflections, refractions and blended surfaces along one path, [0, 64]
    Refine refine = Refine::adaptive;
    RefineParams refine_by;
    Shading shading = Shading::raytraced; ///< flat: colour times facing, no secondary rays (the paper's "full mode")
    Emphasis emphasis = Emphasis::accent; ///< of the targets, seen through the hole
    Lines lines = Lines::rim;
    CapStyle cap = CapStyle::own;
    Vec3f cap_tint{0.55f, 0.09f, 0.05f}; ///< linear
    float rim_px = 1.5f; ///< width of the dark line along the hole's rim, inside it, in pixels of a picture up to 1080
                         ///< high, in higher ones as much wider, [0, 100]; without it, shells of one colour swallow
                         ///< the hole. Never on a target
    Vec3f background{1, 1, 1}; ///< linear; seen, tinted, through coloured glass
};

struct RayCounts {
    std::int64_t primary = 0, shadow = 0, ambient = 0, reflection = 0, refraction = 0;
    RayCounts& operator+=(const RayCounts& r) {
        primary += r.primary, shadow += r.shadow, ambient += r.ambient;
        reflection += r.reflection, refraction += r.refraction;
        return *this;
    }
    [[nodiscard]] std::int64_t all() const { return primary + shadow + ambient + reflection + refraction; }
};

/// A rendered picture with its ids.
struct Frame {
    /// Display-linear Rec.709 in [0, 1], premultiplied alpha: after the shoulder that keeps
    /// highlights from clipping, so that the samples of a pixel are averaged as the screen
    /// adds light. Alpha 0 where nothing is hit: the background is not in it, except for the
    /// tint that coloured glass gives it.
    Image<Vec4f> color;
    IdBuffer ids; ///< at pixel centres: nearest part that is not cut away, and its depth
    /// What pixel centres in the hole see of parts that are cut.
    enum Inside : std::uint8_t {
        cap = 1,      ///< the cut through solid material
        open_back = 2 ///< the back of a part that has no caps: open, or around the eye
    };
    Mask inside;   ///< 0 elsewhere; empty without a hole
    Mask inferred; ///< 1 where id and depth were not traced but taken from around; empty: all were
    RayCounts rays;
};

/// Draws `view` of everything in `bvh`.
///
/// Without a cut this is the plain picture. With one, only samples inside the hole start
/// rays that the cut opens; the caller draws the plain frame first and hands it as `under`:
/// pixels without any sample in the hole are copied from it bit for bit, so the picture
/// outside the hole *is* the plain picture.
///
/// @param bvh      every part, built with the roles of `cut` when there is one.
/// @param targets  hierarchy of the opened targets only. With a cut each sample inside or at
///                 the rim of the hole asks it first; without one its parts are emphasised
///                 wherever they are seen. May be null without a cut.
/// @param cut      may be null.
/// @param caps     of the cut, from trace_caps(); null or empty: nothing is capped. Its mesh has
///                 been added to `bvh` if shadows and mirrors are to see it.
/// @param under    plain frame of the same view and params; null exactly when `cut` is.
/// @return colour, ids at pixel centres, rays spent (of this call).
/// @throws Error usage E0140 when a parameter is out of range; limit E0902 when memory runs out;
///         Cancelled.
/// The same bits for any number of threads. Reports progress as stage "render".
/// Cost: 1920x1080 of an assembly of 500 thousand triangles takes about 0.6 CPU-seconds; 34
/// bytes a pixel of the picture (with a cut: of the hole's box) on top of the frame while it runs.
[[nodiscard]] Frame render(const Bvh& bvh, const Bvh* targets, const View& view, const RenderParams& params,
                           const Cut* cut, const Frame* under, const Control& control = {}, const Caps* caps = nullptr);

/// The plain picture as render() needs it `under` a hole: with all its ids, but without colour
/// where the hole will cover it. Everywhere else the bits are those of the plain picture.
[[nodiscard]] Frame render_around(const Bvh& bvh, const View& view, const RenderParams& params, const Cut& cut,
                                  const Control& control = {});

/// Traces the ids of `frame` in `window` that were inferred, so that what is measured was traced;
/// none are inferred then.
/// @param bvh  what `frame` shows outside its hole: nothing is inferred inside.
/// @return rays traced. @throws Cancelled. Cost: one coherent ray a pixel of the 4x4 blocks with
///         inferred ones.
std::int64_t trace_inferred_ids(const Bvh& bvh, const View& view, Frame& frame, Rect window,
                                const Control& control = {});

} // namespace porthole
