// Line work: outlines, steps and creases found by rays, to a fraction of a pixel.
#pragma once

#include <functional>

#include "porthole/base/ids.h"
#include "porthole/base/view.h"
#include "porthole/render/primary.h"
#include "porthole/render/strokes.h"

namespace porthole {

/// What one ray tells about lines.
struct LineSample {
    PartId part = kNoPart;
    bool cap = false; ///< on the cut surface of the part
    bool in_hole = false;
    bool on_target = false;
    bool masked = false; ///< sees what has no lines, nor borders with them
    float outer = 0;     ///< how much the end of a cut surface at what is seen here is the rim, [0, 1]
    float depth = kInfinity;
    Vec3f position, normal, flat_normal; ///< as in SurfacePoint; unused where nothing is hit
};

/// Looks at up to sixteen positions; fills the active lanes.
using LineTrace = std::function<void(const Samples16& samples, LineSample* seen)>;

/// Rays through everything in `bvh`, which see the surface after `layer` others; counts them in
/// `rays`. Keeps references.
[[nodiscard]] LineTrace plain_trace(const Bvh& bvh, const View& view, const std::vector<Placement>& placements,
                                    RayCounts& rays, int layer = 0);

/// How dark lines are, by what they separate: share of the light taken, [0, 1]; 0: not drawn.
struct LineRules {
    float half_width = 0.5f; ///< pixels
    float outline = 0;       ///< a part and the background
    float part = 0;          ///< two parts that meet
    float step = 0;          ///< nearer and farther surfaces, of one part or of two
    float crease = 0;        ///< two faces that meet at an edge
    float cap = 0;           ///< where a cut surface ends or bends
    float cap_part = 0;      ///< cut surfaces of two parts
    float rim = 0;           ///< where a cut surface ends at a surface that is whole
    float rim_half_width = 0.75f;
    bool shy = false;  ///< none of them may cover targets; else only those at caps
    float dash_px = 0; ///< length of dashes; 0: solid
    /// Whether only cut surfaces have lines: then nothing else is looked at closely.
    [[nodiscard]] bool caps_only() const { return outline == 0 && part == 0 && step == 0 && crease == 0; }
    /// Whether a line between two samples is wanted, the nearer one first; empty: all are.
    std::function<bool(const LineSample& nearer, const LineSample& farther)> wanted;
};

/// The ink of one tile, apart for lines that must not cover targets.
struct LineInk {
    Ink open, shy;
    explicit LineInk(Rect tile) : open(tile), shy(tile) {}
};

/// Finds the lines of one tile and lays them as ink; those at caps as shy ink.
///
/// One ray a pixel tells where something changes; there the rays are twice as dense each way,
/// and on each link of that lattice which joins different surfaces the place of the change is
/// bisected to 1/32 px. The crossings of each cell are joined as in marching squares, so a line is
/// as smooth as what it follows. A change within one part counts as a step if it is still there
/// at the end of the bisection, and fades in with its size, as creases do with their angle:
/// no line starts or ends abruptly because of a threshold. Lines fade out where they crowd, as on
/// surfaces of two parts that coincide, those without a step first.
/// The ink depends on the rays alone, not on the tile: neighbours fit.
///
/// @param tile    of the picture.
/// @param inside  whether a pixel is looked at; asked for pixels a few off the tile, too.
/// Not found: things so thin that no pixel centre near them meets them.
void find_lines(const View& view, Rect tile, const std::function<bool(int x, int y)>& inside, const LineTrace& trace,
                const LineRules& rules, LineInk& ink);

} // namespace porthole
