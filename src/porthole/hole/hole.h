// The hole: the band around covered contours, how deep it goes, and who had no room.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "porthole/base/ids.h"
#include "porthole/hole/contour.h"

namespace porthole {

struct HoleParams {
    int depth_px = 54; ///< wanted band, pixels, [1, 4096]
    float blur_px = 27; ///< radius of the two box blurs that smooth the floor depth outside the targets, >= 0
};

/// What the band knows of one contour pixel.
struct BandPixel {
    Vec2i pixel;
    PartId target = kNoPart;
    bool covered = false;        ///< an occluder lies in front of it
    float clearance_px = kInfinity; ///< D(c): to the nearest pixel outside the enclosing object
    float width_px = 0;          ///< r(c) = min(depth, D(c)/3); 0 if not covered
};

struct Hole {
    Rect window;
    Mask mask;                 ///< 1 inside: targets' pixels and band
    Image<float> floor_depth;  ///< z(p): on the mask, metres along camera -z; the target's own depth on target pixels; +infinity elsewhere
    Image<float> distance;     ///< signed distance to the rim in pixels, <= 0 exactly where mask = 1
    std::vector<BandPixel> band; ///< every contour pixel once, in scan order
    [[nodiscard]] bool empty() const { return band.empty(); }
};

/// The enclosing object E: pixels of `hit` (1 where a ray against the cut set hits) and the
/// background regions they enclose. A 4-connected background region that touches the
/// window's edge is not enclosed.
[[nodiscard]] Mask fill_enclosed(const Mask& hit);

/// The hole through which the target parts become visible: the targets' own pixels and the
/// union of discs of radius r(c) = min(depth, D(c)/3) around every covered contour pixel c.
/// In integers: p is in the band iff for some c 9|p-c|^2 <= min(9 depth^2, D^2(c)).
///
/// The floor depth of a band pixel is the greatest target depth among the contour pixels
/// whose disc covers it, then box-blurred twice with radius params.blur_px, reading targets
/// and band, writing outside the targets.
///
/// @param contours   from find_contours(targets.id).
/// @param targets    ids and depths when only the targets are traced.
/// @param covered    1 at target pixels that an occluder hides; same window as `targets`.
/// @param enclosing  E, from fill_enclosed; same window. Where it is 1 everywhere D is infinite.
/// @throws Error usage E0120 if windows differ or depth_px is out of range.
/// Cost: linear in the window's pixels plus contour length times depth. Safe concurrently.
/// Source: Dandachy et al., N_k, P_k, F_k and d. Differs: the paper steps along three of eight
/// directions, wider on diagonals and with gaps; this is an exact power distance transform,
/// clamped at every pixel, not once.
[[nodiscard]] Hole grow_hole(std::span<const Contour> contours, const IdBuffer& targets, const Mask& covered,
                             const Mask& enclosing, const HoleParams& params = {});

/// Which targets have no room: over half of their covered contour pixels have r < 1 px.
[[nodiscard]] std::vector<PartId> targets_without_room(const Hole& hole);

struct PaperHole {
    Hole hole; ///< band = pixels of N_k, P_k, F_k; floor_depth = +infinity on the mask (occluders go along the whole ray)
    struct PerTarget {
        PartId target = kNoPart;
        int depth_px = 0; ///< k reached; 0: refused
        float distance_px = kInfinity; ///< d(k)
    };
    std::vector<PerTarget> targets;
};

/// The paper's hole: outgoing normals of the tangent (+-2), P and F = outgoing -1, +1 mod 8,
/// points C + k N_0, C + k P_0, C + k F_0 for depth 1..k; per target the largest k <= depth_px
/// with k <= d(k)/2, stopping at the first failure; k = 0 is a refusal (that target's pixels
/// stay out of the mask).
/// @param contours  from find_contours_paper, with their ids.
/// @param targets   complete ids of the targets, for the outgoing test and the targets' pixels.
/// @param enclosing E; its border: pixels of E with a 4-neighbour outside E (a window edge is
///                  no border). No border: d is infinite.
[[nodiscard]] PaperHole grow_hole_paper(const PaperContours& contours, const IdBuffer& targets, const Mask& enclosing,
                                        int depth_px = 4);

} // namespace porthole
