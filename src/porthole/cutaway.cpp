// Style cutaway: the countersunk porthole.
#include <algorithm>
#include <cmath>
#include <limits>
#include <string>

#include "porthole/base/error.h"
#include "porthole/hole/blur.h"
#include "porthole/hole/distance.h"
#include "porthole/hole/masks.h"
#include "porthole/hole/profile.h"
#include "porthole/plan_steps.h"

namespace porthole {

namespace {

constexpr double kClosing = 0.12;       ///< radius of the closing, of the picture's height
constexpr double kMostAdded = 2;        ///< pixels that the closing may add, times the targets' own
constexpr float kClearBands = 3;        ///< parts nearer than this to the floor beside targets are not cut for it
constexpr double kLineBand = 0.03;      ///< band around thin targets, of the picture's height
constexpr double kLineWidthPx = 3;      ///< thin: narrower than this on average
constexpr double kLineLength = 0.1;     ///< and longer than this, of the picture's height
constexpr float kLeastChamfer = 0.011f; ///< of the picture's height
constexpr float kLeastChamferPx = 5;
constexpr float kSmoothing = 0.6f; ///< radius of the maps' smoothing, of the band

Mask mask_of(const Image<PartId>& ids) {
    Mask mask(ids.window());
    std::transform(ids.pixels().begin(), ids.pixels().end(), mask.pixels().begin(),
                   [](PartId id) { return std::uint8_t(id != kNoPart); });
    return mask;
}

std::int64_t count(const Mask& mask) { return std::count(mask.pixels().begin(), mask.pixels().end(), std::uint8_t{1}); }

/// The targets closed by the greatest radius that does not blow them up.
Mask closed_targets(const Mask& targets, ViewPlan& plan) {
    const std::int64_t own = count(targets);
    for (plan.closing_px = closing_radius_px(plan.view);; plan.closing_px /= 2) {
        Mask closed = closed_mask(targets, plan.closing_px);
        if (plan.closing_px == 0 || double(count(closed) - own) <= kMostAdded * double(own)) return closed;
    }
}

Mask core_mask(const Mask& targets, HoleShape shape, ViewPlan& plan) {
    if (shape == HoleShape::silhouette) return targets;
    Mask closed = closed_targets(targets, plan);
    if (shape == HoleShape::smooth) return closed;
    const Components groups = connected_components(closed);
    return shape == HoleShape::hull ? hull_mask(targets, groups) : box_mask(targets, groups);
}

/// Whether the targets are lines rather than areas or dots: a wide window around them would show
/// more of everything else than of them. A line w pixels wide has two contour pixels per w of its own.
bool are_lines(const ViewPlan& plan) {
    const double border = double(contour_pixels(plan.contours).size());
    const double pixels = double(count(mask_of(plan.target_ids.id)));
    return 2 * pixels < kLineWidthPx * border && border > 2 * kLineLength * plan.view.height;
}

/// Takes out of `core` what is not within the enclosing object and `clear_px` away from its
/// outline, unless it is a target's.
void keep_clear(Mask& core, const Image<PartId>& targets, const Mask& enclosing, int clear_px) {
    std::vector<Vec2i> added;
    const Rect box = bounds_of(core);
    for (int y = box.y0; y < box.y1; ++y)
        for (int x = box.x0; x < box.x1; ++x)
            if (core(x, y) && targets(x, y) == kNoPart) added.push_back({x, y});
    const std::vector<std::int64_t> clearance2 = squared_distances(complement(enclosing), added);
    const std::int64_t least = std::int64_t(clear_px) * clear_px;
    for (std::size_t i = 0; i < added.size(); ++i)
        if (clearance2[i] < least) core(added[i].x, added[i].y) = 0;
}

void merge(std::vector<PartId>& parts, const std::vector<PartSpan>& spans) {
    for (const PartSpan& span : spans) parts.push_back(span.part);
    std::sort(parts.begin(), parts.end());
    parts.erase(std::unique(parts.begin(), parts.end()), parts.end());
}

/// Roles of the parts and the shape of the hole; no levels yet.
Cut uncut(const Subject& subject, const ViewPlan& plan) {
    Cut cut;
    cut.view = plan.view;
    cut.role = subject.roles;
    for (CutRole& role : cut.role)
        if (role == CutRole::cut_set) role = CutRole::loose;
    for (const PartId id : plan.cut_set) cut.role[index(id)] = CutRole::cut_set;
    cut.distance = plan.hole.distance;
    return cut;
}

/// Loose parts go where the cut set does, but what lies on the last surface cut, as the floor on
/// which a cut thing stood, stays whatever the rounding. And where the cut would leave nothing to
/// see, its last surface stays: no hole shows the background through the object.
void settle_last_surfaces(const Subject& subject, const Bvh& cut_bvh, ViewPlan& plan, const Control& control) {
    const CutEffect effect =
        trace_cut_effect(cut_bvh, subject.whole, plan.cut, plan.hole.mask, control, &plan.rays.loose);
    plan.cut.loose_depth = effect.farthest;
    for (std::size_t i = 0; i < effect.left.pixels().size(); ++i) {
        float& loose = plan.cut.loose_depth.pixels()[i];
        if (loose == -kInfinity) continue;
        const bool beside_targets = plan.target_ids.id.pixels()[i] == kNoPart;
        if (beside_targets && !effect.left.pixels()[i]) {
            loose -= 1e-6f * std::abs(loose);
            plan.cut.levels[effect.farthest_level.pixels()[i]].pixels()[i].floor = loose;
        } else {
            loose -= std::max(subject.tolerance(), 8 * std::numeric_limits<float>::epsilon() * std::abs(loose));
        }
    }
}

RimParams rim_params(const Subject& subject, const View& view, const PlanParams& params) {
    RimParams rim;
    rim.least_px = std::max(kLeastChamferPx, kLeastChamfer * float(view.height));
    const auto refuse = [](const char* option, const std::string& reason) {
        throw Error(ErrorKind::usage, "E0120", option, reason);
    };
    if (params.bevel) {
        const double width = length_px(subject, view, *params.bevel);
        if (!(width >= 0) || !(width <= 4096))
            refuse("--bevel", "the chamfer would be " + std::to_string(width) + " px wide; 0 to 4096 px are possible");
        rim.bevel_px = float(width);
    }
    if (params.angle_deg) {
        const double angle = *params.angle_deg;
        if (!(angle > 0) || !(angle < 90))
            refuse("--angle", std::to_string(angle) + " is not between 0 and 90 degrees");
        rim.angle = float(angle * double(kPi) / 180);
    }
    return rim;
}

} // namespace

int closing_radius_px(const View& view) { return int(std::lround(kClosing * view.height)); }

CutawayMargins cutaway_margins(const View& view, const PlanParams& params, const HoleParams& band) {
    // The profile's maps reach two smoothing radii beyond the picture.
    const int hole = hole_margin_px(band) + 2 * int(std::lround(kSmoothing * float(band.depth_px)));
    return {hole, hole + (params.shape == HoleShape::silhouette ? 0 : 2 * closing_radius_px(view))};
}

void plan_cutaway(const Subject& subject, const PlanParams& params, const HoleParams& most, Rect around,
                  const IdBuffer& ids, const IdBuffer* plain, ViewPlan& plan, const Control& control) {
    const View& view = plan.view;
    const float tolerance = subject.tolerance();
    RimParams rim = rim_params(subject, view, params);

    // What hides the targets, and what stands before the rest of the window that they make.
    plan.spans = trace_spans(subject.whole, kMaskCutSet, view, plan.target_ids, tolerance, control, &plan.rays.spans);
    if (plan.spans.parts.empty()) return;
    HoleParams band = most;
    if (!params.depth && are_lines(plan)) band.depth_px = std::max(1, int(std::lround(kLineBand * view.height)));
    plan.depth_px = band.depth_px;
    rim.blur_px = int(std::lround(kSmoothing * float(band.depth_px)));
    Mask core = cropped(core_mask(mask_of(ids.id), params.shape, plan), plan.window);
    plan.core = fill_core(plan.target_ids, core);
    const int floor_blur = int(std::lround(band.blur_px));
    plan.core.depth = blur_floor(std::move(plan.core.depth), core, plan.target_ids.id, bounds_of(core), floor_blur, 2);
    IdBuffer beside = plan.core;
    for (std::size_t i = 0; i < beside.id.pixels().size(); ++i) {
        if (plan.target_ids.id.pixels()[i] != kNoPart) beside.id.pixels()[i] = kNoPart;
        if (beside.id.pixels()[i] == kNoPart) continue;
        float& depth = beside.depth.pixels()[i];
        depth -= kClearBands * float(plan.depth_px) * view.pixel_size(depth);
    }
    merge(plan.cut_set, plan.spans.parts);
    merge(plan.cut_set,
          trace_spans(subject.whole, kMaskCutSet, view, beside, tolerance, control, &plan.rays.spans).parts);
    const Bvh cut_bvh = build_bvh(*subject.meshes, plan.cut_set);
    plan.enclosing = enclosing_object(subject.scene(), plan.cut_set, cut_bvh, view, around, plan.whole, control,
                                      plan.rays.enclosing, plain);

    keep_clear(core, plan.target_ids.id, plan.enclosing, plan.depth_px);
    for (std::size_t i = 0; i < core.pixels().size(); ++i)
        if (!core.pixels()[i]) plan.core.id.pixels()[i] = kNoPart, plan.core.depth.pixels()[i] = kInfinity;

    // The band around the core, where something covers it.
    const std::vector<Contour> contours = find_contours(plan.core.id);
    IdBuffer border(plan.window);
    for (const Vec2i p : contour_pixels(contours)) {
        if (plan.target_ids.id(p.x, p.y) != kNoPart) continue;
        border.id(p.x, p.y) = plan.core.id(p.x, p.y);
        border.depth(p.x, p.y) = plan.core.depth(p.x, p.y);
    }
    const Spans before_border = trace_spans(cut_bvh, kMaskAll, view, border, tolerance, control, &plan.rays.spans);
    Mask covered(plan.window);
    for (std::size_t i = 0; i < covered.pixels().size(); ++i)
        covered.pixels()[i] =
            plan.spans.nearest.pixels()[i] < kInfinity || before_border.nearest.pixels()[i] < kInfinity;
    plan.hole = grow_hole(contours, plan.core, covered, plan.enclosing, {.depth_px = band.depth_px, .blur_px = 0});
    plan.hole.distance = rim_distance(plan.hole);
    const Hole& hole = plan.hole;
    plan.hole.floor_depth =
        blur_floor(std::move(plan.hole.floor_depth), hole.mask, plan.target_ids.id, hole.bounds, floor_blur, 2);

    // The walls, and the cut through them.
    plan.cut = uncut(subject, plan);
    Mask beside_targets = hole.mask;
    for (std::size_t i = 0; i < beside_targets.pixels().size(); ++i)
        if (plan.target_ids.id.pixels()[i] != kNoPart) beside_targets.pixels()[i] = 0;
    const std::size_t levels = params.steps ? find_levels(subject, cut_bvh, plan, control) : 1;
    plan.walls = trace_layers(cut_bvh, view, beside_targets, hole.floor_depth, plan.cut.level, levels, tolerance,
                              control, &plan.rays.walls);
    std::vector<Wall> walls;
    for (const LayerDepths& layer : plan.walls) {
        Wall& wall = walls.emplace_back(Wall{layer.first, layer.next});
        for (std::size_t i = 0; i < wall.next.pixels().size(); ++i)
            wall.next.pixels()[i] = std::min(wall.next.pixels()[i], hole.floor_depth.pixels()[i]);
    }
    plan.cut.levels = rim_levels(hole, plan.core.id, view, walls, rim);
    settle_last_surfaces(subject, cut_bvh, plan, control);
}

} // namespace porthole
