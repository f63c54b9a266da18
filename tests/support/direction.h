// What --camera auto settles on if every candidate is weighed in full.
#pragma once

#include <algorithm>
#include <cmath>
#include <numeric>
#include <vector>

#include "porthole/viewpoint.h"

namespace porthole::test {

/// Oracle of best_direction().
inline Vec3f weighed_direction(const Subject& subject, const FrameSubject& frame, const CameraParams& camera, int width,
                               int height, const PlanParams& params) {
    const std::vector<Vec3f> directions = candidate_directions();
    const auto ranked = [&](std::vector<std::size_t> candidates, int width_px, HoleStyle style) {
        const double scale = std::min(1.0, double(width_px) / width);
        const int w = int(std::lround(width * scale)), h = int(std::lround(height * scale));
        PlanParams small = params;
        small.style = style;
        std::vector<ViewScore> scores(directions.size());
        std::int64_t largest = 0;
        for (const std::size_t i : candidates) {
            const View view = view_from_direction(frame, directions[i], camera, w, h);
            scores[i] =
                score_view(subject, plan_view(subject, view, small), trace_ids(subject.whole, view, view.window()));
            largest = std::max(largest, scores[i].target_pixels);
        }
        std::sort(candidates.begin(), candidates.end(), [&](std::size_t a, std::size_t b) {
            if (scores[a].refused != scores[b].refused) return scores[b].refused;
            const double va = scores[a].value(largest), vb = scores[b].value(largest);
            return va != vb ? va > vb : a < b;
        });
        return candidates;
    };
    std::vector<std::size_t> all(directions.size());
    std::iota(all.begin(), all.end(), std::size_t{0});
    std::vector<std::size_t> best =
        ranked(all, 256, params.style == HoleStyle::cutaway ? HoleStyle::hole : params.style);
    best.resize(std::min<std::size_t>(best.size(), 5));
    return directions[ranked(best, 512, params.style).front()];
}

} // namespace porthole::test
