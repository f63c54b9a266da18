#include "porthole/io/polygon.h"

#include <algorithm>
#include <cmath>

namespace porthole {
namespace {

/// Normal of a polygon that need not be planar, twice its area long (Newell).
Vec3d newell_normal(std::span<const Vec3f> corners) {
    const Vec3d origin(corners[0]);
    Vec3d sum;
    for (std::size_t i = 1; i + 1 < corners.size(); ++i)
        sum += cross(Vec3d(corners[i]) - origin, Vec3d(corners[i + 1]) - origin);
    return sum;
}

double signed_area(Vec2d a, Vec2d b, Vec2d c) { return (b.x - a.x) * (c.y - a.y) - (b.y - a.y) * (c.x - a.x); }

} // namespace

std::span<const Vec3u> Triangulator::triangulate(std::span<const Vec3f> corners) {
    triangles_.clear();
    const auto n = static_cast<std::uint32_t>(corners.size());
    if (n < 3) return {};
    const auto fan = [&] {
        for (std::uint32_t i = 1; i + 1 < n; ++i) triangles_.push_back({0, i, i + 1});
    };
    if (n == 3) {
        fan();
        return triangles_;
    }

    // Drop the axis along which the polygon faces most, keeping its orientation.
    const Vec3d normal = newell_normal(corners);
    const Vec3d size{std::abs(normal.x), std::abs(normal.y), std::abs(normal.z)};
    if (!is_finite(normal) || size == Vec3d{}) {
        fan();
        return triangles_;
    }
    const int drop = size.x >= size.y && size.x >= size.z ? 0 : size.y >= size.z ? 1 : 2;
    const int u = normal[drop] > 0 ? (drop + 1) % 3 : (drop + 2) % 3;
    const int v = 3 - drop - u;
    points_.resize(n);
    for (std::uint32_t i = 0; i < n; ++i) points_[i] = {double(corners[i][u]), double(corners[i][v])};

    previous_.resize(n);
    next_.resize(n);
    is_reflex_.assign(n, 0);
    reflex_.clear();
    for (std::uint32_t i = 0; i < n; ++i) {
        previous_[i] = i == 0 ? n - 1 : i - 1;
        next_[i] = i + 1 == n ? 0 : i + 1;
        if (signed_area(points_[previous_[i]], points_[i], points_[next_[i]]) < 0) {
            is_reflex_[i] = 1;
            reflex_.push_back(i);
        }
    }
    if (reflex_.empty()) {
        fan();
    } else if (budget_ <= 0) {
        ++gave_up_;
        fan();
    } else {
        cut_ears();
    }
    return triangles_;
}

/// Whether corner i can be cut off: it is convex and no reflex corner lies in its triangle.
bool Triangulator::is_ear(std::uint32_t i) {
    if (is_reflex_[i]) return false;
    const Vec2d a = points_[previous_[i]], b = points_[i], c = points_[next_[i]];
    const double low = std::min({a.x, b.x, c.x}), high = std::max({a.x, b.x, c.x});
    const auto first = std::lower_bound(reflex_.begin(), reflex_.end(), low,
                                        [&](std::uint32_t r, double x) { return points_[r].x < x; });
    for (auto r = first; r != reflex_.end() && points_[*r].x <= high; ++r) {
        --budget_;
        if (!is_reflex_[*r]) continue;
        const Vec2d p = points_[*r];
        if (p == a || p == b || p == c) continue;
        if (signed_area(a, b, p) >= 0 && signed_area(b, c, p) >= 0 && signed_area(c, a, p) >= 0) return false;
    }
    return true;
}

/// Cutting an ear changes only whether its two neighbours are ears (O'Rourke, "Computational
/// Geometry in C", 1.4), so each corner is asked a few times in all.
void Triangulator::cut_ears() {
    const auto n = static_cast<std::uint32_t>(points_.size());
    std::sort(reflex_.begin(), reflex_.end(),
              [&](std::uint32_t a, std::uint32_t b) { return points_[a].x < points_[b].x; });

    std::vector<std::uint32_t> ears; // candidates, last in first out
    queued_.assign(n, 0);
    const auto offer = [&](std::uint32_t i) {
        if (queued_[i] || is_reflex_[i]) return;
        queued_[i] = 1;
        ears.push_back(i);
    };
    for (std::uint32_t i = n; i-- > 0;) offer(i);

    std::uint32_t left = n, somewhere = 0;
    bool clean = true;
    while (left > 3) {
        std::uint32_t ear = n;
        while (!ears.empty() && ear == n) {
            const std::uint32_t candidate = ears.back();
            ears.pop_back();
            queued_[candidate] = 0;
            if (budget_ > 0 && is_ear(candidate)) ear = candidate;
        }
        if (ear == n) {
            // Self-crossing, rounding, or out of budget: cut something, so that it ends.
            ear = somewhere;
            clean = false;
        }
        const std::uint32_t before = previous_[ear], after = next_[ear];
        triangles_.push_back({before, ear, after});
        next_[before] = after;
        previous_[after] = before;
        is_reflex_[ear] = 0;
        --left;
        somewhere = after;
        for (const std::uint32_t i : {before, after}) {
            // A reflex corner may turn convex; a convex one never turns reflex but by rounding.
            if (signed_area(points_[previous_[i]], points_[i], points_[next_[i]]) >= 0) is_reflex_[i] = 0;
            offer(i);
        }
    }
    triangles_.push_back({previous_[somewhere], somewhere, next_[somewhere]});
    if (!clean && budget_ <= 0) ++gave_up_;
}

} // namespace porthole
