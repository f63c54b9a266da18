// The plan of a view: which pixels the targets fill, what hides them, the hole through it and
// how deep it goes. One value, made by one function, for every caller that looks at a view.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "porthole/base/cut.h"
#include "porthole/hole/hole.h"
#include "porthole/hole/shape.h"
#include "porthole/scene/scene.h"
#include "porthole/trace/bvh.h"
#include "porthole/trace/layers.h"
#include "porthole/trace/solid.h"
#include "porthole/trace/visibility.h"

namespace porthole {

enum class ContourMethod : std::uint8_t {
    exact, ///< targets projected, rays only where rounding could matter; equals `full` on every view
    full,  ///< every pixel traced against the targets: the oracle
    fast,  ///< targets projected, without those rays: a pixel whose centre is on an edge may be wrong
    paper  ///< contours followed as the paper does; targets that step 1 misses are missed
};

enum class HoleStyle : std::uint8_t {
    cutaway, ///< countersunk: a readable window, a chamfer at the rim as wide as the wall deserves, steps
    hole,    ///< straight walls around the targets' silhouette, width clamped at every contour pixel
    paper,   ///< N_k, P_k, F_k, one width per target, flat shading
    ghost    ///< no hole: what lies in front of targets is drawn as a thin shell; planned as `hole`, never refused
};

enum class Tight : std::uint8_t {
    refuse, ///< a target without room stays closed, and the report says so
    open,   ///< it is opened all the same
    ghost   ///< the whole picture is planned and drawn in style ghost instead
};

/// A length as users give it: "54px", "5%" of the picture's height, "3mm" at the targets' depth.
struct Length {
    enum class Unit : std::uint8_t { pixel, percent, millimetre } unit = Unit::percent;
    double value = 5;
};

struct PlanParams {
    ContourMethod contours = ContourMethod::exact;
    HoleStyle style = HoleStyle::cutaway;
    std::optional<Length> depth; ///< width of the band; unset: 5 % (cutaway: thin lines 3 %), 4 px (paper)
    Tight tight = Tight::refuse;
    CapOverrides solidity; ///< parts that the user says are solids or shells

    // Of style cutaway alone.
    HoleShape shape = HoleShape::smooth;
    std::optional<Length> bevel;     ///< width of the chamfer; 0: straight walls; unset: by the wall's thickness
    std::optional<double> angle_deg; ///< between wall and ray, (0, 90): instead of a chamfer by thickness
    bool steps = true;               ///< layers that enclose one another open one step after the other
};

/// What does not depend on the view: who is a target, who may be cut. Move-only; needs its
/// MeshBvhs alive.
struct Subject {
    const MeshBvhs* meshes = nullptr;
    std::vector<PartId> targets; ///< increasing
    std::vector<CutRole> roles;  ///< by part: fixed (targets, kept parts) or cut_set (may be cut)
    Bvh whole;                   ///< every part, with those roles as masks
    Bvh target_bvh;              ///< the targets only
    ClusterBoxes boxes;          ///< of the targets
    Bounds3d bounds;             ///< of every part
    [[nodiscard]] const Scene& scene() const { return meshes->scene(); }
    [[nodiscard]] float tolerance() const { return float(1e-6 * bounds.diagonal()); }
};

/// @param keep      parts that stay whole.
/// @param cut_only  if not empty, only these may be cut. Precedence: target, keep, cut_only.
[[nodiscard]] Subject make_subject(const MeshBvhs& meshes, std::span<const PartId> targets,
                                   std::span<const PartId> keep = {}, std::span<const PartId> cut_only = {},
                                   const Control& control = {});

/// Where one target alone would be seen.
struct TargetView {
    PartId part = kNoPart;
    Mask alone;                      ///< 1 at pixel centres (or, if thin, pixels with a sub-pixel sample) it covers
    std::int64_t pixels_alone = 0;   ///< of those, inside the picture
    std::int64_t pixels_outside = 0; ///< of those, in the margin around the picture
    std::int64_t fine_samples = 0;   ///< thin targets: sub-pixel samples that hit, inside the picture
    bool thin = false;               ///< under 16 pixels: seen through sub-pixel samples
    bool absent = false;             ///< no sample hits it
    bool refused = false;            ///< no room for a hole
    PartId hidden_by = kNoPart;      ///< another target that covers over half of its pixels
};

/// Slivers of cut parts that float in the hole, see crumbs.h.
struct CrumbCount {
    std::int64_t removed = 0, removed_px = 0;
    std::int64_t kept = 0, kept_px = 0; ///< such as would open the model to the background
};

struct ViewPlan {
    View view;
    bool ghost = false; ///< the cut set is to be drawn as a thin shell; hole and cut only say where it hides
                        ///< the targets
    int depth_px = 0;   ///< width of the band asked for, or chosen
    Rect whole;         ///< picture and margin
    Rect window;        ///< the part of picture and margin that the hole can touch; all images below but `enclosing`
    std::vector<TargetView> targets; ///< in the order of Subject::targets
    std::vector<PartId> opened;      ///< targets neither absent nor refused
    IdBuffer target_ids;             ///< opened targets only
    Spans spans;                     ///< what lies in front of them
    std::vector<PartId> cut_set;     ///< parts that are cut, increasing
    Mask enclosing;                  ///< E, also around the window as far as it matters to the hole
    std::vector<Contour> contours;   ///< of the targets
    int closing_px = 0;              ///< style cutaway: radius by which the targets were closed
    IdBuffer core;                   ///< style cutaway: M, with the nearest target pixel's part and depth
    std::vector<LayerDepths> walls;  ///< style cutaway: first wall of each level of the cut, outside the targets
    Hole hole;                       ///< empty if nothing hides the targets
    std::vector<int> paper_depth_px; ///< style paper: k per opened target
    Cut cut;                         ///< empty if nothing is to be cut
    std::vector<MeshSolid> solids;   ///< by mesh, judged for the cut set; empty before plan_caps()
    CapRules caps;                   ///< of the cut set; plan_caps()
    CrumbCount crumbs;               ///< remove_crumbs()

    struct Rays {
        std::int64_t targets = 0, alone = 0, spans = 0, enclosing = 0, loose = 0;
        std::int64_t walls = 0; ///< style cutaway
        std::int64_t paper_step1 = 0, paper_step2 = 0, caps = 0;
    } rays;

    [[nodiscard]] bool nothing_revealed() const { return opened.empty(); }
    [[nodiscard]] bool nothing_to_cut() const { return cut.empty(); }
};

/// Where each target alone would be seen: ViewPlan::targets before any is refused.
/// @throws Error usage E0120 (depth out of range); Cancelled.
/// Cost: rays where the targets' boxes are.
[[nodiscard]] std::vector<TargetView> view_targets(const Subject& subject, const View& view,
                                                   const PlanParams& params = {}, const Control& control = {});

/// Plans the hole of one view. The same bits for any number of threads.
/// @throws Error usage E0120 (depth, bevel or angle out of range); Cancelled.
/// Cost: rays at the targets' pixels and around them, not a full frame; see ViewPlan::rays.
/// Safe to call concurrently on one subject.
/// @param plain  ids of all parts in the picture, if they are known: spares rays, changes nothing else.
[[nodiscard]] ViewPlan plan_view(const Subject& subject, const View& view, const PlanParams& params = {},
                                 const Control& control = {}, const IdBuffer* plain = nullptr);

/// The targets' contours by themselves, as a picture in motion wants them.
struct TargetContours {
    std::vector<Contour> contours; ///< the pixels are those of find_contours() of the target ids in the picture;
                                   ///< pieces at its edge may come in another order
    std::int64_t rays = 0;
};

/// Contours of all targets in the picture. Methods exact and fast are those of cover(): rays decide, or
/// guesses do.
/// Cost: see cover(); full, one ray a pixel.
[[nodiscard]] TargetContours find_target_contours(const Subject& subject, const View& view,
                                                  ContourMethod method = ContourMethod::exact,
                                                  const Control& control = {});

/// Decides which parts of the cut set are capped: fills solids, caps and cut.cap of a plan.
/// Not part of plan_view(), as views that are only weighed need no caps.
/// Cost: find_solids(), find_holders() and classify() of the cut set.
void plan_caps(const Subject& subject, ViewPlan& plan, const CapOverrides& overrides = {}, const Control& control = {});

/// Width of the band in pixels that `params` ask for in `view`.
[[nodiscard]] int band_depth_px(const Subject& subject, const View& view, const PlanParams& params);

} // namespace porthole
