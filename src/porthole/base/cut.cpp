#include "porthole/base/cut.h"

#include <cmath>

namespace porthole {

float Cut::distance_at(float x, float y) const {
    const Rect w = distance.window();
    // Pixel centres are the grid points.
    const float gx = x - 0.5f, gy = y - 0.5f;
    const float fx = std::floor(gx), fy = std::floor(gy);
    if (!(fx >= float(w.x0)) || !(fy >= float(w.y0)) || !(fx < float(w.x1 - 1)) || !(fy < float(w.y1 - 1))) {
        // On the last row or column only the pixel itself is known.
        const bool inside = x >= float(w.x0) && y >= float(w.y0) && x < float(w.x1) && y < float(w.y1);
        return inside ? distance(int(std::floor(x)), int(std::floor(y))) : 1.0f;
    }
    const int ix = int(fx), iy = int(fy);
    const float ax = gx - fx, ay = gy - fy;
    if (ax == 0 && ay == 0) return distance(ix, iy);
    const float top = distance(ix, iy) * (1 - ax) + distance(ix + 1, iy) * ax;
    const float bottom = distance(ix, iy + 1) * (1 - ax) + distance(ix + 1, iy + 1) * ax;
    return top * (1 - ay) + bottom * ay;
}

namespace {

/// The pixel of the hole that is nearest to a point whose own pixel's centre lies outside; the
/// own pixel if there is none.
Vec2i nearest_inside(const Image<float>& distance, float x, float y) {
    const int ix = int(std::floor(x)), iy = int(std::floor(y));
    Vec2i nearest{ix, iy};
    if (distance.at_or(ix, iy, 1.0f) <= 0) return nearest;
    float best = kInfinity;
    for (int dy = -1; dy <= 1; ++dy)
        for (int dx = -1; dx <= 1; ++dx) {
            if (distance.at_or(ix + dx, iy + dy, 1.0f) > 0) continue;
            const float ex = float(ix + dx) + 0.5f - x, ey = float(iy + dy) + 0.5f - y;
            const float d2 = ex * ex + ey * ey;
            if (d2 < best) best = d2, nearest = {ix + dx, iy + dy};
        }
    return nearest;
}

constexpr float kLightSlack = 1; ///< pixel sizes

/// Floors that differ by more pixel sizes than this are a step, not a slope.
constexpr float kStep = 16;

} // namespace

CutDepth Cut::depth_at(float x, float y, std::size_t which) const {
    const CutLevel& profiles = levels[which];
    const float inside = -distance_at(x, y);
    const auto result = [&](const CutProfile& p) { return CutDepth{p.depth(inside), p.on_chamfer(inside)}; };
    const float gx = x - 0.5f, gy = y - 0.5f;
    const float fx = std::floor(gx), fy = std::floor(gy);
    const int ix = int(fx), iy = int(fy);
    const float ax = gx - fx, ay = gy - fy;
    if (ax == 0 && ay == 0 && profiles.contains(ix, iy) && profiles(ix, iy).floor > -kInfinity)
        return result(profiles(ix, iy));
    const float weights[4] = {(1 - ax) * (1 - ay), ax * (1 - ay), (1 - ax) * ay, ax * ay};
    CutProfile mean{0, 0, 0, 0, 0};
    float sum = 0, front_sum = 0, nearest_floor = kInfinity, farthest_floor = -kInfinity;
    for (int i = 0; i < 4; ++i) {
        const int px = ix + (i & 1), py = iy + (i >> 1);
        if (!(weights[i] > 0) || !profiles.contains(px, py)) continue;
        const CutProfile& p = profiles(px, py);
        if (p.floor == -kInfinity) continue;
        if (weights[i] == 1.0f) return result(p);
        sum += weights[i];
        mean.start += weights[i] * p.start, mean.width += weights[i] * p.width;
        if (p.floor < nearest_floor) nearest_floor = p.floor;
        if (p.floor > farthest_floor) farthest_floor = p.floor;
        mean.floor += weights[i] * p.floor;
        if (p.front == -kInfinity) continue;
        front_sum += weights[i];
        mean.front += weights[i] * p.front, mean.slope += weights[i] * p.slope;
    }
    if (sum > 0 && !(farthest_floor - nearest_floor > kStep * view.pixel_size(nearest_floor))) {
        mean.start /= sum, mean.width /= sum, mean.floor /= sum;
        if (front_sum > 0)
            mean.front /= front_sum, mean.slope /= front_sum;
        else
            mean.front = -kInfinity, mean.width = 0;
        return result(mean);
    }
    const Vec2i own = nearest_inside(distance, x, y);
    return profiles.contains(own.x, own.y) ? result(profiles(own.x, own.y)) : CutDepth{};
}

float Cut::loose_depth_at(float x, float y) const {
    const Vec2i own = nearest_inside(distance, x, y);
    return loose_depth.at_or(own.x, own.y, -kInfinity);
}

bool Cut::removes(Vec3f world, PartId part) const {
    const CutRole which = role[porthole::index(part)];
    if (which == CutRole::fixed || empty()) return false;
    const PixelPoint p = view.project(world);
    if (!(p.depth > 0) && !view.orthographic) return false;
    if (!(std::abs(p.x) < 1e8f) || !(std::abs(p.y) < 1e8f)) return false;
    const float depth = p.depth - kLightSlack * view.pixel_size(p.depth);
    if (which == CutRole::cut_set && !ranges.empty()) {
        const CutRange range = ranges[level_of(part)].at_or(int(std::floor(p.x)), int(std::floor(p.y)), CutRange{});
        if (depth < range.near) return true;
        if (!(depth < range.far)) return false;
    }
    if (distance_at(p.x, p.y) > 0) return false;
    return depth < (which == CutRole::loose ? loose_depth_at(p.x, p.y) : depth_at(p.x, p.y, level_of(part)).depth);
}

void index_ranges(Cut& cut) {
    cut.ranges.clear();
    const Rect w = cut.distance.window();
    for (const CutLevel& profiles : cut.levels) {
        Image<CutRange>& ranges = cut.ranges.emplace_back(w);
        for (int y = w.y0 + 1; y < w.y1 - 1; ++y)
            for (int x = w.x0 + 1; x < w.x1 - 1; ++x) {
                // Anywhere in the pixel the depth is a mean of floors around it, or one of them, if
                // all of them lie beyond the chamfer; outside the hole nothing is gone.
                CutRange range{kInfinity, -kInfinity};
                float shallowest = kInfinity, chamfer_end = -kInfinity, deepest = -kInfinity;
                for (int dy = -1; dy <= 1; ++dy)
                    for (int dx = -1; dx <= 1; ++dx) {
                        const CutProfile& p = profiles(x + dx, y + dy);
                        const float inside = -cut.distance(x + dx, y + dy);
                        shallowest = std::min(shallowest, inside), deepest = std::max(deepest, inside);
                        chamfer_end = std::max(chamfer_end, p.start + p.width);
                        range.near = std::min(range.near, p.floor), range.far = std::max(range.far, p.floor);
                    }
                // Interpolated values stay between those of the pixels, but for their rounding.
                const auto rounding = [](float v) { return std::isfinite(v) ? 1e-6f * std::abs(v) : 0.0f; };
                if (deepest < 0)
                    ranges(x, y).far = -kInfinity;
                else if (shallowest >= chamfer_end + 1e-3f)
                    ranges(x, y) = {range.near - rounding(range.near), range.far + rounding(range.far)};
            }
    }
}

} // namespace porthole
