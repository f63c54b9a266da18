#include "porthole/report.h"

#include <algorithm>
#include <cmath>

#include "porthole/hole/distance.h"
#include "porthole/hole/metrics.h"

namespace porthole {

namespace {

std::optional<double> ratio(std::int64_t part, std::int64_t whole) {
    if (whole == 0) return std::nullopt;
    return double(part) / double(whole);
}

struct Summary {
    std::optional<double> min, p5, mean, max;
};

Summary summarise(std::vector<float> values) {
    if (values.empty()) return {};
    std::sort(values.begin(), values.end());
    double sum = 0;
    for (const float v : values) sum += v;
    return {values.front(), values[(values.size() - 1) / 20], sum / double(values.size()), values.back()};
}

/// Of the sub-pixel samples of a thin target those where it is what one sees.
std::int64_t fine_samples_seen(const Bvh& bvh, const ViewPlan& plan, const TargetView& target, bool opened) {
    std::int64_t seen = 0;
    const Rect box = target.alone.window().intersected(plan.view.window());
    const FlushDenormals flush;
    for (int y = box.y0; y < box.y1; ++y)
        for (int x = box.x0; x < box.x1; ++x) {
            if (!target.alone(x, y)) continue;
            RayHit16 rays;
            for (int i = 0; i < kLanes; ++i) {
                const Vec2f p = fine_position(x, y, i);
                const Ray ray = plan.view.ray(p.x, p.y);
                // Opened: in front of a target sample everything that may be cut is gone, so
                // only fixed parts can hide it.
                rays.set(i, ray.origin, ray.direction, 0.0f, kInfinity, opened ? kMaskFixed : kMaskAll);
            }
            intersect(bvh, rays, Coherence::coherent);
            for (int i = 0; i < kLanes; ++i) seen += rays.hit(i) && rays.part(i) == target.part;
        }
    return seen;
}

TargetReport measure_target(const Subject& subject, const ViewPlan& plan, const Bvh& bvh, const TargetView& target,
                            std::span<const float> rings, const Frame& before, const Frame& after) {
    TargetReport r;
    r.part = target.part;
    r.path = subject.scene().parts[index(target.part)].path;
    r.pixels_alone = target.pixels_alone;
    r.thin = target.thin;
    r.depth_asked_px = plan.depth_px;
    r.alone = encode_runs(target.alone);
    if (target.pixels_alone + target.pixels_outside > 0)
        r.off_image_share = double(target.pixels_outside) / double(target.pixels_alone + target.pixels_outside);
    if (target.absent)
        r.refused = "absent";
    else if (target.refused)
        r.refused = "no room";

    // A refused target is not one of the group; when all are, the plan's ids still show them.
    const auto is_nearest = [&](int x, int y) {
        return !target.refused && plan.target_ids.id.at_or(x, y, kNoPart) == target.part;
    };
    Mask nearest_of_all(target.alone.window().intersected(plan.target_ids.window()), 0);
    const Rect around = nearest_of_all.window();
    for (int y = around.y0; y < around.y1; ++y)
        for (int x = around.x0; x < around.x1; ++x) nearest_of_all(x, y) = is_nearest(x, y);
    r.mask = encode_runs(nearest_of_all);

    const Rect box = target.alone.window().intersected(before.ids.window());
    std::int64_t seen_before = 0, seen_after = 0, among = 0, among_seen = 0;
    for (int y = box.y0; y < box.y1; ++y)
        for (int x = box.x0; x < box.x1; ++x) {
            const bool alone = target.alone(x, y) != 0;
            seen_before += alone && before.ids.id(x, y) == target.part;
            seen_after += alone && after.ids.id(x, y) == target.part;
            const bool nearest = is_nearest(x, y);
            among += nearest;
            among_seen += nearest && after.ids.id(x, y) == target.part;
        }
    if (target.thin) {
        r.visible_before = ratio(fine_samples_seen(bvh, plan, target, false), target.fine_samples);
        r.visible_after = r.refused.empty() ? ratio(fine_samples_seen(bvh, plan, target, true), target.fine_samples)
                                            : r.visible_before;
        r.visible_among_targets = r.visible_after;
    } else {
        r.visible_before = ratio(seen_before, target.pixels_alone);
        r.visible_after = ratio(seen_after, target.pixels_alone);
        r.visible_among_targets = ratio(among_seen, among);
    }

    for (const Contour& contour : plan.contours) {
        const bool own =
            !contour.pixels.empty() && plan.target_ids.id(contour.pixels[0].x, contour.pixels[0].y) == target.part;
        if (!own) continue;
        r.components += contour.outer;
        r.closed = r.closed && contour.closed;
    }
    std::vector<float> clearance, width, ring;
    std::int64_t covered = 0;
    for (std::size_t i = 0; i < plan.hole.band.size(); ++i) {
        const BandPixel& c = plan.hole.band[i];
        if (c.target != target.part) continue;
        ++r.contour_pixels;
        if (!c.covered) continue;
        ++covered;
        if (std::isfinite(c.clearance_px)) clearance.push_back(c.clearance_px);
        width.push_back(c.width_px);
        if (rings[i] >= 0) ring.push_back(rings[i]);
    }
    r.covered = ratio(covered, r.contour_pixels);
    if (clearance.size() == width.size()) {
        const Summary s = summarise(clearance);
        r.clearance_min_px = s.min, r.clearance_p5_px = s.p5, r.clearance_mean_px = s.mean;
    } else if (!clearance.empty()) {
        // Some pixels have no border in reach: the mean is infinite.
        const Summary s = summarise(clearance);
        r.clearance_min_px = s.min;
        if (clearance.size() * 20 >= width.size()) r.clearance_p5_px = s.p5;
    }
    const Summary w = summarise(width);
    r.depth_used_min_px = w.min, r.depth_used_mean_px = w.mean, r.depth_used_max_px = w.max;
    const Summary s = summarise(ring);
    r.ring_mean = s.mean, r.ring_p5 = s.p5, r.ring_min = s.min;
    return r;
}

/// Share of the covered contour pixels that have the inside of a cut part within the depth.
std::optional<double> wall_visible(const Subject& subject, const ViewPlan& plan, const Frame& after,
                                   const Control& control) {
    const Rect window = plan.hole.window.intersected(after.ids.window());
    Mask band(window, 0);
    Image<float> from(window), seen(window);
    for (int y = window.y0; y < window.y1; ++y)
        for (int x = window.x0; x < window.x1; ++x) {
            const PartId id = after.ids.id(x, y);
            band(x, y) = plan.hole.mask(x, y) && id != kNoPart && plan.cut.role[index(id)] == CutRole::cut_set;
            if (band(x, y)) from(x, y) = plan.cut.levels[plan.cut.level_of(id)](x, y).depth(-plan.cut.distance(x, y));
            seen(x, y) = after.ids.depth(x, y);
        }
    const Bvh cut_set = build_bvh(*subject.meshes, plan.cut_set);
    Mask wall = trace_back_faces(cut_set, plan.view, band, from, seen, control);
    for (int y = window.y0; y < window.y1; ++y)
        for (int x = window.x0; x < window.x1; ++x)
            if (after.inside.at_or(x, y, 0) == Frame::cap) wall(x, y) = 1;
    std::vector<Vec2i> covered;
    for (const BandPixel& c : plan.hole.band)
        if (c.covered && window.contains(c.pixel.x, c.pixel.y)) covered.push_back(c.pixel);
    const std::vector<std::int64_t> distances = squared_distances(wall, covered);
    const std::int64_t reach = std::int64_t(plan.depth_px) * plan.depth_px;
    return ratio(std::count_if(distances.begin(), distances.end(), [&](std::int64_t d) { return d <= reach; }),
                 std::int64_t(covered.size()));
}

CapReport report_caps(const Scene& scene, const ViewPlan& plan, const Frame& after) {
    CapReport r;
    const auto path = [&](PartId id) { return scene.parts[index(id)].path; };
    for (const PartId id : plan.cut_set) {
        if (plan.cut.cap_of(id) == CapRule::solid) r.solids.push_back(path(id));
        if (plan.cut.cap_of(id) == CapRule::shell) r.shells.push_back(path(id));
    }
    for (const PartId id : plan.caps.open) r.open.push_back(path(id));
    for (const PartId id : plan.caps.partly_open) r.partly_open.push_back(path(id));
    for (const PartId id : plan.caps.around_eye) r.around_eye.push_back(path(id));
    const std::span<const std::uint8_t> inside = after.inside.pixels();
    r.cap_pixels = std::count(inside.begin(), inside.end(), std::uint8_t(Frame::cap));
    r.open_back_pixels = std::count(inside.begin(), inside.end(), std::uint8_t(Frame::open_back));
    return r;
}

PictureReport measure_picture(const Subject& subject, const ViewPlan& plan, const Frame& before, const Frame& after,
                              const Control& control) {
    PictureReport r;
    const Image<PartId>&w = before.ids.id, &o = after.ids.id;
    r.outline_iou = outline_iou(w, o);
    std::vector<std::uint8_t> is_target(subject.scene().parts.size(), 0);
    for (const PartId id : subject.targets) is_target[index(id)] = 1;
    if (const double removed = context_removed(w, o, is_target); removed >= 0) r.context_removed = removed;

    std::vector<std::uint8_t> seen_before(is_target.size(), 0), seen_after(is_target.size(), 0);
    for (std::size_t i = 0; i < w.pixels().size(); ++i) {
        if (w.pixels()[i] != kNoPart) seen_before[index(w.pixels()[i])] = 1;
        if (o.pixels()[i] != kNoPart) seen_after[index(o.pixels()[i])] = 1;
        r.see_through_px += w.pixels()[i] != kNoPart && o.pixels()[i] == kNoPart;
    }
    for (std::size_t i = 0; i < seen_before.size(); ++i)
        if (seen_before[i] && !seen_after[i]) r.parts_lost.push_back(subject.scene().parts[i].path);

    r.crumbs = plan.crumbs;
    r.mask = encode_runs(plan.hole.mask);
    if (!plan.cut.empty()) {
        const Rect box = plan.hole.window.intersected(w.window());
        for (int y = box.y0; y < box.y1; ++y)
            for (int x = box.x0; x < box.x1; ++x) r.hole_pixels += plan.hole.mask(x, y);
        r.wall_visible = wall_visible(subject, plan, after, control);
    }
    return r;
}

} // namespace

Report measure(const Subject& subject, const ViewPlan& plan, const Bvh& bvh, const Frame& before, const Frame& after,
               const Control& control) {
    const Scene& scene = subject.scene();
    Report report;
    report.model.parts = std::int64_t(scene.parts.size());
    report.model.triangles = std::int64_t(triangle_count(scene));
    report.view = plan.view;
    report.nothing_to_cut = plan.nothing_to_cut();

    std::vector<float> rings;
    if (!plan.hole.empty()) rings = ring_shares(plan.hole, plan.target_ids, after.ids, subject.roles, plan.depth_px);
    for (const TargetView& target : plan.targets) {
        report.targets.push_back(measure_target(subject, plan, bvh, target, rings, before, after));
        if (target.hidden_by != kNoPart)
            report.warnings.push_back({"W0103", "--target",
                                       "target '" + scene.parts[index(target.hidden_by)].path + "' hides target '" +
                                           scene.parts[index(target.part)].path +
                                           "'; targets never cut each other: ask for one of them"});
    }
    report.caps = report_caps(scene, plan, after);
    for (const PartId id : plan.cut_set) report.cut_parts.push_back(scene.parts[index(id)].path);
    report.picture = measure_picture(subject, plan, before, after, control);
    report.plan_rays = plan.rays;
    report.frame_rays = before.rays;
    if (!plan.cut.empty()) report.frame_rays += after.rays;
    return report;
}

} // namespace porthole
