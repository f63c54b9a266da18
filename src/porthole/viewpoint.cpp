#include "porthole/viewpoint.h"

#include <algorithm>
#include <cmath>
#include <mutex>
#include <numeric>
#include <span>

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

/// Candidates looked at in one size.
struct Round {
    const Subject& subject;
    const FrameSubject& frame;
    const CameraParams& camera;
    int width = 1, height = 1;
    PlanParams params;

    /// @param width, height  of the picture wanted, pixels
    Round(const Subject& of, const FrameSubject& framing, const CameraParams& by, int full_width, int full_height,
          int width_px, const PlanParams& wanted, HoleStyle style)
        : subject(of), frame(framing), camera(by), params(wanted) {
        const double scale = std::min(1.0, double(width_px) / full_width);
        width = std::max(1, int(std::lround(full_width * scale)));
        height = std::max(1, int(std::lround(full_height * scale)));
        params.style = style;
        if (params.depth && params.depth->unit == Length::Unit::pixel)
            params.depth->value = std::max(1.0, params.depth->value * scale);
        if (params.bevel && params.bevel->unit == Length::Unit::pixel) params.bevel->value *= scale;
    }
    [[nodiscard]] View view(Vec3f toward_eye) const {
        return view_from_direction(frame, toward_eye, camera, width, height);
    }
};

/// How good a candidate can be at best, by the targets alone.
ViewScore best_score(const Round& round, const View& view, const Control& control) {
    ViewScore score;
    score.visible = 1;
    score.pose = pose_of(-view.forward());
    score.entropy = 1 + 1e-9; // what rounding can make of it
    for (const TargetView& target : view_targets(round.subject, view, round.params, control)) {
        score.refused |= target.absent;
        score.target_pixels += target.pixels_alone;
    }
    return score;
}

/// What a candidate is worth: those that refuse a target come last, ties by lowest index.
struct Rank {
    bool refused = true;
    double value = 0;
    std::size_t candidate = 0;
    [[nodiscard]] bool before(const Rank& other) const {
        if (refused != other.refused) return other.refused;
        return value != other.value ? value > other.value : candidate < other.candidate;
    }
};

/// The best of several threads' candidates.
class Leaders {
public:
    explicit Leaders(std::size_t most) : most_(most) {}
    /// Whether a candidate that is at best worth `rank` may still come among them.
    [[nodiscard]] bool may_join(const Rank& rank) const {
        const std::lock_guard lock(mutex_);
        return ranks_.size() < most_ || rank.before(ranks_.back());
    }
    void join(const Rank& rank) {
        const std::lock_guard lock(mutex_);
        const auto before = [](const Rank& a, const Rank& b) { return a.before(b); };
        ranks_.insert(std::upper_bound(ranks_.begin(), ranks_.end(), rank, before), rank);
        if (ranks_.size() > most_) ranks_.pop_back();
    }
    [[nodiscard]] std::vector<std::size_t> candidates() const {
        std::vector<std::size_t> out;
        for (const Rank& rank : ranks_) out.push_back(rank.candidate);
        return out;
    }

private:
    std::size_t most_;
    std::vector<Rank> ranks_; ///< best first
    mutable std::mutex mutex_;
};

/// The best `most` of the candidates, best first. A candidate is weighed only as far as it takes to
/// know that others are better, the most promising ones first; which ones are left out depends on
/// the threads, what comes back does not.
std::vector<std::size_t> best_of(const Round& round, std::span<const Vec3f> directions,
                                 std::span<const std::size_t> candidates, std::size_t most, const Control& control) {
    struct Candidate {
        std::size_t index = 0;
        View view;
        ViewScore best;
    };
    const Control one{control.stop, {}, 1};
    std::vector<Candidate> rated(candidates.size());
    parallel_for(rated.size(), control, [&](std::size_t i) {
        const View view = round.view(directions[candidates[i]]);
        rated[i] = {candidates[i], view, best_score(round, view, one)};
    });
    std::int64_t largest = 0;
    for (const Candidate& c : rated) largest = std::max(largest, c.best.target_pixels);
    const auto rank = [&](const Candidate& c, const ViewScore& score) {
        return Rank{score.refused, score.value(largest), c.index};
    };
    std::sort(rated.begin(), rated.end(),
              [&](const Candidate& a, const Candidate& b) { return rank(a, a.best).before(rank(b, b.best)); });

    Leaders leaders(most);
    const Subject& subject = round.subject;
    const auto weigh = [&](Candidate& c, const Control& by) {
        if (!leaders.may_join(rank(c, c.best))) return;
        const IdBuffer ids = trace_ids(subject.whole, c.view, c.view.window(), by);
        c.best.entropy = entropy(ids, subject.scene().parts.size());
        if (!leaders.may_join(rank(c, c.best))) return;
        const ViewPlan plan = plan_view(subject, c.view, round.params, by, &ids);
        leaders.join(rank(c, score_view(subject, plan, ids)));
    };
    // Side by side, one thread each; of the last ones, too few for that, several threads each.
    const auto threads = std::size_t(thread_count(control));
    const std::size_t last = rated.size() % threads, first = rated.size() - last;
    parallel_for(first, control, [&](std::size_t i) { weigh(rated[i], one); });
    if (last == 0) return leaders.candidates();
    const Control several{control.stop, {}, int(threads / last)};
    parallel_for(last, {control.stop, {}, int(last)}, [&](std::size_t i) { weigh(rated[first + i], several); });
    return leaders.candidates();
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
    const auto round_at = [&](int width_px, HoleStyle style) {
        return Round(subject, frame, camera, width, height, width_px, params, style);
    };
    std::vector<std::size_t> all(directions.size());
    std::iota(all.begin(), all.end(), std::size_t{0});
    // Straight walls are cheaper to plan and lead to the same few.
    const HoleStyle rough = params.style == HoleStyle::cutaway ? HoleStyle::hole : params.style;
    const std::vector<std::size_t> best = best_of(round_at(256, rough), directions, all, 5, control);
    return directions[best_of(round_at(512, params.style), directions, best, 1, control).front()];
}

} // namespace porthole
