#include "porthole/viewpoint.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "porthole/hole/metrics.h"

namespace porthole {

namespace {

double entropy(const IdBuffer& ids, std::size_t parts) {
    std::vector<std::int64_t> pixels(parts, 0);
    std::int64_t all = 0;
    for (const PartId id : ids.id.pixels())
        if (id != kNoPart) ++pixels[index(id)], ++all;
    if (parts < 2 || all == 0) return 0;
    double h = 0;
    for (const std::int64_t n : pixels)
        if (n > 0) h -= double(n) / double(all) * std::log(double(n) / double(all));
    return h / std::log(double(parts));
}

/// The opened scene's ids as far as the plan knows them: inside the hole the targets, and
/// nothing cuttable in front of the floor.
IdBuffer opened_ids(const ViewPlan& plan, const IdBuffer& before) {
    IdBuffer after = before;
    if (plan.cut.empty()) return after;
    const Rect r = plan.window.intersected(before.window());
    for (int y = r.y0; y < r.y1; ++y)
        for (int x = r.x0; x < r.x1; ++x) {
            if (plan.target_ids.id(x, y) != kNoPart) {
                if (after.depth(x, y) < plan.target_ids.depth(x, y) &&
                    plan.cut.role[index(after.id(x, y))] == CutRole::fixed)
                    continue;
                after.id(x, y) = plan.target_ids.id(x, y);
                after.depth(x, y) = plan.target_ids.depth(x, y);
            } else if (plan.hole.mask(x, y) && before.id(x, y) != kNoPart) {
                const PartId id = before.id(x, y);
                const CutRole role = plan.cut.role[index(id)];
                const float limit = role == CutRole::fixed ? -kInfinity
                                    : role == CutRole::cut_set
                                        ? plan.cut.levels[plan.cut.level_of(id)](x, y).depth(-plan.cut.distance(x, y))
                                        : plan.cut.loose_depth(x, y);
                if (before.depth(x, y) < limit) after.id(x, y) = kNoPart, after.depth(x, y) = kInfinity;
            }
        }
    return after;
}

} // namespace

double ViewScore::value(std::int64_t largest_area) const {
    if (target_pixels == 0 || largest_area == 0) return 0;
    const double v2 = visible * visible;
    return v2 * v2 * std::sqrt(double(target_pixels) / double(largest_area)) * (0.1 + ring) *
           std::sqrt(std::max(0.0, 1 - context_removed)) * (0.5 + 0.5 * entropy) * pose;
}

double pose_of(Vec3f toward_eye) {
    const double elevation = std::asin(std::clamp(double(toward_eye.y), -1.0, 1.0)) * 180 / double(kPi);
    double liked = 1;
    if (elevation < -1e-3)
        liked = 0.5;
    else if (elevation < 5)
        liked = 0.75 + 0.05 * elevation;
    else if (elevation > 50)
        liked = 1 - 0.75 * (elevation - 50) / 40;
    if (toward_eye.z < -1e-3f) liked *= 0.85;
    const double along_axis = std::max({std::abs(toward_eye.x), std::abs(toward_eye.y), std::abs(toward_eye.z)});
    return liked * (0.7 + 0.3 * std::clamp((1 - along_axis) / 0.15, 0.0, 1.0));
}

ViewScore score_view(const Subject& subject, const ViewPlan& plan, const IdBuffer& ids) {
    ViewScore score;
    score.pose = pose_of(-plan.view.forward());
    const IdBuffer after = opened_ids(plan, ids);

    double visible = 0;
    for (const TargetView& target : plan.targets) {
        score.refused |= target.refused || target.absent;
        score.target_pixels += target.pixels_alone;
        if (target.pixels_alone == 0) continue;
        std::int64_t seen = 0;
        const Rect r = target.alone.window().intersected(ids.window());
        for (int y = r.y0; y < r.y1; ++y)
            for (int x = r.x0; x < r.x1; ++x) seen += target.alone(x, y) && after.id(x, y) == target.part;
        visible += double(seen) / double(target.pixels_alone);
    }
    if (!plan.targets.empty()) score.visible = visible / double(plan.targets.size());

    const std::vector<float> rings = ring_shares(plan.hole, plan.target_ids, after, subject.roles, plan.depth_px);
    double sum = 0;
    std::int64_t n = 0;
    for (const float r : rings)
        if (r >= 0) sum += r, ++n;
    if (n > 0) score.ring = sum / double(n);

    std::vector<std::uint8_t> is_target(subject.scene().parts.size(), 0);
    for (const PartId id : subject.targets) is_target[index(id)] = 1;
    score.context_removed = std::max(0.0, context_removed(ids.id, after.id, is_target));
    score.entropy = entropy(ids, subject.scene().parts.size());
    return score;
}

Vec3f best_direction(const Subject& subject, const FrameSubject& frame, const CameraParams& camera, int width,
                     int height, const PlanParams& params, const Control& control) {
    const std::vector<Vec3f> directions = candidate_directions();

    // Scores of some candidates at a given width, side by side; each is planned by one thread.
    const auto scores_at = [&](const std::vector<std::size_t>& candidates, int width_px, HoleStyle style) {
        const double scale = std::min(1.0, double(width_px) / width);
        const int w = std::max(1, int(std::lround(width * scale))), h = std::max(1, int(std::lround(height * scale)));
        PlanParams small = params;
        small.style = style;
        if (small.depth && small.depth->unit == Length::Unit::pixel)
            small.depth->value = std::max(1.0, small.depth->value * scale);
        if (small.bevel && small.bevel->unit == Length::Unit::pixel) small.bevel->value *= scale;
        std::vector<ViewScore> scores(candidates.size());
        parallel_for(candidates.size(), control, [&](std::size_t i) {
            const Control one{control.stop, {}, 1};
            const View view = view_from_direction(frame, directions[candidates[i]], camera, w, h);
            scores[i] = score_view(subject, plan_view(subject, view, small, one),
                                   trace_ids(subject.whole, view, view.window(), one));
        });
        return scores;
    };
    // Candidates from best to worst.
    const auto ranked = [&](const std::vector<std::size_t>& candidates, const std::vector<ViewScore>& scores) {
        std::int64_t largest = 0;
        for (const ViewScore& s : scores) largest = std::max(largest, s.target_pixels);
        std::vector<std::size_t> order(candidates.size());
        std::iota(order.begin(), order.end(), std::size_t{0});
        std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) {
            if (scores[a].refused != scores[b].refused) return scores[b].refused;
            const double va = scores[a].value(largest), vb = scores[b].value(largest);
            return va != vb ? va > vb : candidates[a] < candidates[b];
        });
        for (std::size_t& i : order) i = candidates[i];
        return order;
    };

    std::vector<std::size_t> all(directions.size());
    std::iota(all.begin(), all.end(), std::size_t{0});
    // Straight walls are cheaper to plan and lead to the same few.
    const HoleStyle rough = params.style == HoleStyle::cutaway ? HoleStyle::hole : params.style;
    std::vector<std::size_t> best = ranked(all, scores_at(all, 256, rough));
    best.resize(std::min<std::size_t>(best.size(), 5));
    return directions[ranked(best, scores_at(best, 512, params.style)).front()];
}

} // namespace porthole
