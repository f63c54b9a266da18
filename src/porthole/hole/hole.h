// The hole: the band around covered contours, how deep it goes, and who had no room.
#pragma once

#include <cstdint>
#include <functional>
#include <span>
#include <vector>

#include "porthole/base/ids.h"
#include "porthole/hole/contour.h"

namespace porthole {

struct HoleParams {
    int depth_px = 54;  ///< wanted band, pixels, [1, 4096]
    float blur_px = 27; ///< radius of the two box blurs that smooth the floor depth outside the
                        ///< targets, rounded to whole pixels, [0, 4096]
};

/// What the band knows of one contour pixel.
struct BandPixel {
    Vec2i pixel;
    PartId target = kNoPart;
    bool covered = false;           ///< an occluder lies in front of it
    float clearance_px = kInfinity; ///< D(c): to the nearest pixel of the window outside the enclosing object
    float width_px = 0;             ///< r(c) = min(depth, D(c)/3); 0 if not covered
};

/// How far Hole::distance is exact outside the hole, pixels; farther off it stays at this.
inline constexpr float kRimReach = 4;

struct Hole {
    Rect window;
    Rect bounds;              ///< smallest box of the pixels inside; empty if there are none
    Mask mask;                ///< 1 inside: targets' pixels and band
    Image<float> floor_depth; ///< z(p): on the mask, metres along camera -z; the target's own depth on target
                              ///< pixels; +infinity elsewhere
    Image<float> distance;    ///< signed distance to the rim in pixels, <= 0 exactly where mask = 1; see grow_hole
    Image<float> width; ///< r of the disc that owns the pixel, at least 1/2, within kRimReach of a disc; 0 elsewhere
    std::vector<BandPixel> band; ///< every contour pixel once, in scan order
    [[nodiscard]] bool empty() const { return bounds.empty(); }
};

/// The enclosing object E: pixels of `hit` (!= 0 where a ray against the cut set hits) and the
/// background regions they enclose. A 4-connected background region that touches the
/// window's edge is not enclosed. Values 0 and 1. Cost: linear in the window.
[[nodiscard]] Mask fill_enclosed(const Mask& hit);

/// Whether a ray through a pixel beyond the window hits.
using HitBeyond = std::function<bool(Vec2i)>;

/// fill_enclosed() of all of `whole`, cropped to the window of `hit`, without knowing the rest of it:
/// a region that runs into the window's edge is followed beyond, towards the nearest edge of
/// `whole` first, until it meets that edge or ends.
/// @param whole       contains the window.
/// @param hit_beyond  is asked about pixels of `whole` outside the window, in an order that depends on
///                    nothing but the answers; more than once about some.
[[nodiscard]] Mask fill_enclosed(const Mask& hit, Rect whole, const HitBeyond& hit_beyond);

/// How far around the picture targets, occluders and E must be traced for the hole inside the
/// picture to be the same as if everything were: a disc reaches one depth in from outside the
/// picture, its clearance counts up to three depths farther out, the blurs read two radii more.
[[nodiscard]] int hole_margin_px(const HoleParams& params);

/// The hole through which the target parts become visible: the targets' own pixels and the
/// union of discs of radius r(c) = min(depth, D(c)/3) around every covered contour pixel c.
/// In integers: p is in the band iff for some c 9|p-c|^2 <= min(9 depth^2, D^2(c)). So the
/// enclosing object keeps its outline, and a band pixel is never nearer to it than twice the
/// band's width there (the paper's k <= d/2, at every pixel).
///
/// The floor depth of a band pixel is the target depth at the contour pixel whose disc owns it
/// (the nearest in the power sense; the leftmost, then the topmost of several), then box-blurred
/// twice with radius params.blur_px, reading targets and band, writing outside the targets.
///
/// The signed distance is made for bilinear interpolation at the rim. In the band and outside
/// it is the distance to the circle of the disc that is nearest in the power sense: smooth,
/// and zero on the rim of the union of discs. Contour pixels without a disc count as discs of
/// radius 1/2, so that there the rim runs midway between the target's pixels and the outside
/// ones. On target pixels it is minus the distance to the nearest such circle's far side, but
/// -0.5 and 0.5 - sqrt(2) on those with a 4- or else 8-neighbour outside the hole.
///
/// @param contours   from find_contours(targets.id).
/// @param targets    ids and depths when only the targets are traced; or of a larger core, from
///                   fill_core: then that is what the band grows from and "target" means here.
/// @param covered    1 at target pixels that an occluder hides; same window as `targets`.
/// @param enclosing  E, from fill_enclosed; a window that holds the others'. Where it is 1 everywhere D is infinite.
/// @return the hole in the same window; empty() if no target is in view.
/// @throws Error usage E0120 if windows differ, a contour pixel is not a target's, or a parameter
///         is out of range.
/// Cost: linear in the window's pixels, whatever the depth. Safe to call concurrently.
/// Source: Dandachy et al., N_k, P_k, F_k and d. Differs: the paper steps along three of eight
/// directions, wider on diagonals and with gaps; this is an exact power distance transform,
/// clamped at every pixel, not once.
[[nodiscard]] Hole grow_hole(std::span<const Contour> contours, const IdBuffer& targets, const Mask& covered,
                             const Mask& enclosing, const HoleParams& params = {});

/// Which targets have no room: over half of their covered contour pixels have r < 1 px, and those
/// are over a quarter of all. Flecks in front of a target that is seen anyway need no room around
/// them (DESIGN 2.4 knows no such quarter; an insect in clear amber was refused for its bubbles).
/// In order of id.
[[nodiscard]] std::vector<PartId> targets_without_room(const Hole& hole);

struct PaperHole {
    /// Mask: pixels of accepted targets and of their N_k, P_k, F_k. floor_depth = +infinity
    /// everywhere (occluders go along the whole ray); distance: to the border of the mask.
    Hole hole;
    struct PerTarget {
        PartId target = kNoPart;
        int depth_px = 0;              ///< k reached; 0: refused
        float distance_px = kInfinity; ///< d(k), of k = 1 if refused
    };
    std::vector<PerTarget> targets; ///< in the order of the contours
};

/// The paper's hole: outgoing normals of the tangent (+-2), P and F = outgoing -1, +1 mod 8,
/// points C + k N_0, C + k P_0, C + k F_0 for depth 1..k; per target the largest k <= depth_px
/// with k <= d(k)/2, stopping at the first failure; k = 0 is a refusal (that target's pixels
/// stay out of the mask).
///
/// Frozen readings: tangent = following - current; the last pixel of an open chain reuses the
/// tangent before, that of a closed one points to the departure. Outgoing is the one of tangent
/// +-2 whose pixel has another id; both if both, none if none. Points that fall on a target's
/// pixel or beyond the window are not pixels of the hole; d(k) is taken over the rest of depth
/// k, infinite if there are none, and zero if one of them lies outside E.
///
/// @param contours  from find_contours_paper, with their ids.
/// @param targets   complete ids of the targets, for the outgoing test and the targets' pixels.
/// @param enclosing E; its border: pixels of E with a 4-neighbour outside E (a window edge is
///                  no border). No border: d is infinite.
/// @param covered   1 at target pixels that an occluder hides, for Hole::band alone: the paper
///                  does not ask. Empty: those in E count as covered.
/// @throws Error usage E0120 as grow_hole.
[[nodiscard]] PaperHole grow_hole_paper(const PaperContours& contours, const IdBuffer& targets, const Mask& enclosing,
                                        int depth_px = 4, const Mask& covered = {});

} // namespace porthole
