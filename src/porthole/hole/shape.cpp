#include "porthole/hole/shape.h"

#include <algorithm>
#include <vector>

#include "porthole/hole/distance.h"
#include "porthole/hole/masks.h"

namespace porthole {
namespace {

/// floor(a / b), b > 0.
std::int64_t floor_divide(std::int64_t a, std::int64_t b) { return a / b - (a % b < 0 ? 1 : 0); }
std::int64_t ceil_divide(std::int64_t a, std::int64_t b) { return -floor_divide(-a, b); }

/// Of each row of a group its first and last pixel.
struct GroupRows {
    std::int32_t y0 = 0;
    std::vector<std::int32_t> first, last; ///< first > last: none
};

std::vector<GroupRows> rows_of(const Mask& mask, const Components& groups) {
    std::vector<GroupRows> rows(std::size_t(groups.count));
    const Rect w = mask.window();
    for (std::int32_t y = w.y0; y < w.y1; ++y)
        for (std::int32_t x = w.x0; x < w.x1; ++x) {
            if (!mask(x, y)) continue;
            GroupRows& group = rows[std::size_t(groups.label(x, y))];
            if (group.first.empty()) group.y0 = y;
            const auto row = std::size_t(y - group.y0);
            if (group.first.size() <= row) {
                group.first.resize(row + 1, w.x1);
                group.last.resize(row + 1, w.x0 - 1);
            }
            group.first[row] = std::min(group.first[row], x);
            group.last[row] = std::max(group.last[row], x);
        }
    return rows;
}

/// Lower hull of the points (i, value[i]) over the rows that have one, as row indices. `sign` -1: upper.
std::vector<std::int32_t> chain(const GroupRows& rows, const std::vector<std::int32_t>& value, std::int64_t sign) {
    std::vector<std::int32_t> hull;
    const auto x = [&](std::int32_t i) { return sign * value[std::size_t(i)]; };
    for (std::int32_t i = 0; i < std::int32_t(value.size()); ++i) {
        if (rows.first[std::size_t(i)] > rows.last[std::size_t(i)]) continue;
        while (hull.size() >= 2) {
            const std::int32_t a = hull[hull.size() - 2], b = hull.back();
            // b stays only if it lies strictly below the line from a to i.
            if ((x(b) - x(a)) * (i - a) < (x(i) - x(a)) * (b - a)) break;
            hull.pop_back();
        }
        hull.push_back(i);
    }
    return hull;
}

} // namespace

Mask closed_mask(const Mask& mask, int radius_px) {
    Mask closed(mask.window());
    std::transform(mask.pixels().begin(), mask.pixels().end(), closed.pixels().begin(),
                   [](std::uint8_t m) { return std::uint8_t(m != 0); });
    const Rect box = bounds_of(closed);
    if (radius_px <= 0 || box.empty()) return closed;

    // One pixel more than the dilation reaches, so that what is outside it is known.
    Mask dilated(box.grown(radius_px + 1));
    for (std::int32_t y = box.y0; y < box.y1; ++y) std::copy_n(&closed(box.x0, y), box.width(), &dilated(box.x0, y));
    const std::int64_t radius2 = std::int64_t(radius_px) * radius_px;
    const Image<std::int64_t> to_mask = distance_transform(dilated);
    for (std::size_t i = 0; i < dilated.pixels().size(); ++i) dilated.pixels()[i] = to_mask.pixels()[i] > radius2;
    const Image<std::int64_t> to_outside = distance_transform(dilated);
    for (std::int32_t y = box.y0; y < box.y1; ++y)
        for (std::int32_t x = box.x0; x < box.x1; ++x) closed(x, y) = to_outside(x, y) > radius2;
    return closed;
}

Components connected_components(const Mask& mask) {
    Components components{Image<std::int32_t>(mask.window(), -1), 0};
    const Rect w = mask.window();
    std::vector<Vec2i> open;
    for (std::int32_t y = w.y0; y < w.y1; ++y)
        for (std::int32_t x = w.x0; x < w.x1; ++x) {
            if (!mask(x, y) || components.label(x, y) >= 0) continue;
            components.label(x, y) = components.count;
            open.push_back({x, y});
            while (!open.empty()) {
                const Vec2i p = open.back();
                open.pop_back();
                for (std::int32_t dy = -1; dy <= 1; ++dy)
                    for (std::int32_t dx = -1; dx <= 1; ++dx) {
                        const std::int32_t qx = p.x + dx, qy = p.y + dy;
                        if (!w.contains(qx, qy) || !mask(qx, qy) || components.label(qx, qy) >= 0) continue;
                        components.label(qx, qy) = components.count;
                        open.push_back({qx, qy});
                    }
            }
            ++components.count;
        }
    return components;
}

Mask hull_mask(const Mask& mask, const Components& groups) {
    Mask hull(mask.window());
    for (const GroupRows& rows : rows_of(mask, groups)) {
        if (rows.first.empty()) continue;
        const std::vector<std::int32_t> left = chain(rows, rows.first, 1), right = chain(rows, rows.last, -1);
        std::size_t l = 0, r = 0;
        for (std::int32_t i = 0; i < std::int32_t(rows.first.size()); ++i) {
            const auto bound = [&](const std::vector<std::int32_t>& corners, std::size_t& at,
                                   const std::vector<std::int32_t>& x, auto&& divide) {
                while (at + 1 < corners.size() && corners[at + 1] <= i) ++at;
                const std::int32_t a = corners[at], xa = x[std::size_t(a)];
                if (a == i) return xa;
                const std::int32_t b = corners[at + 1];
                return xa + std::int32_t(divide(std::int64_t(x[std::size_t(b)] - xa) * (i - a), std::int64_t(b - a)));
            };
            const std::int32_t x0 = bound(left, l, rows.first, ceil_divide);
            const std::int32_t x1 = bound(right, r, rows.last, floor_divide);
            for (std::int32_t x = x0; x <= x1; ++x) hull(x, rows.y0 + i) = 1;
        }
    }
    return hull;
}

Mask box_mask(const Mask& mask, const Components& groups) {
    Mask boxes(mask.window());
    for (const GroupRows& rows : rows_of(mask, groups)) {
        if (rows.first.empty()) continue;
        const std::int32_t x0 = *std::min_element(rows.first.begin(), rows.first.end());
        const std::int32_t x1 = *std::max_element(rows.last.begin(), rows.last.end()) + 1;
        for (std::size_t i = 0; i < rows.first.size(); ++i)
            std::fill_n(&boxes(x0, rows.y0 + std::int32_t(i)), x1 - x0, std::uint8_t{1});
    }
    return boxes;
}

IdBuffer fill_core(const IdBuffer& targets, const Mask& core) {
    IdBuffer filled = targets;
    const Rect w = targets.window(), box = bounds_of(core);
    // Only a target pixel with a neighbour outside can be nearest to a pixel outside.
    std::vector<PowerSite> sites;
    for (std::int32_t y = box.y0; y < box.y1; ++y)
        for (std::int32_t x = box.x0; x < box.x1; ++x) {
            if (targets.id(x, y) == kNoPart) continue;
            bool border = false;
            for (const Vec2i step : {Vec2i{1, 0}, Vec2i{-1, 0}, Vec2i{0, 1}, Vec2i{0, -1}})
                border |= w.contains(x + step.x, y + step.y) && targets.id(x + step.x, y + step.y) == kNoPart;
            if (border) sites.push_back({{x, y}, 0});
        }
    if (sites.empty()) return filled;
    const PowerDistance nearest = power_distance_transform(box, sites, 1);
    for (std::int32_t y = box.y0; y < box.y1; ++y)
        for (std::int32_t x = box.x0; x < box.x1; ++x) {
            if (!core(x, y) || targets.id(x, y) != kNoPart) continue;
            const Vec2i from = sites[std::size_t(nearest.nearest(x, y))].center;
            filled.id(x, y) = targets.id(from.x, from.y);
            filled.depth(x, y) = targets.depth(from.x, from.y);
        }
    return filled;
}

} // namespace porthole
