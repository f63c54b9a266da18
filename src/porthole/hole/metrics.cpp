#include "porthole/hole/metrics.h"

#include <algorithm>
#include <cmath>

namespace porthole {

std::vector<float> ring_shares(const Hole& hole, const IdBuffer& targets, const IdBuffer& opened,
                               std::span<const CutRole> roles, int depth_px) {
    std::vector<float> shares(hole.band.size(), -1.0f);
    const Rect window = hole.window.intersected(opened.window());
    if (window.empty()) return shares;

    // Per pixel the depth from which on it is clear; -1 marks targets, which are not counted.
    Image<float> blocking(window, kInfinity);
    for (int y = window.y0; y < window.y1; ++y)
        for (int x = window.x0; x < window.x1; ++x) {
            const PartId id = opened.id(x, y);
            if (targets.id(x, y) != kNoPart)
                blocking(x, y) = -1;
            else if (id != kNoPart && roles[index(id)] != CutRole::fixed)
                blocking(x, y) = opened.depth(x, y);
        }

    std::vector<int> half_width(std::size_t(depth_px) + 1);
    for (int dy = 0; dy <= depth_px; ++dy)
        half_width[std::size_t(dy)] = int(std::sqrt(double(depth_px) * depth_px - double(dy) * dy));

    for (std::size_t i = 0; i < hole.band.size(); ++i) {
        const BandPixel& c = hole.band[i];
        if (!c.covered || !window.contains(c.pixel.x, c.pixel.y)) continue;
        // The floor is smoothed over the band, so the last part in a thousand does not count.
        const float limit = hole.floor_depth(c.pixel.x, c.pixel.y) * (1 - 1e-3f);
        int counted = 0, clear = 0;
        for (int y = std::max(c.pixel.y - depth_px, window.y0); y <= std::min(c.pixel.y + depth_px, window.y1 - 1);
             ++y) {
            const int half = half_width[std::size_t(std::abs(y - c.pixel.y))];
            const int x0 = std::max(c.pixel.x - half, window.x0), x1 = std::min(c.pixel.x + half, window.x1 - 1);
            const float* row = &blocking(x0, y);
            for (int k = 0; k <= x1 - x0; ++k) {
                counted += row[k] >= 0;
                clear += row[k] >= limit;
            }
        }
        if (counted > 0) shares[i] = float(clear) / float(counted);
    }
    return shares;
}

double outline_iou(const Image<PartId>& before, const Image<PartId>& after) {
    const auto filled = [](const Image<PartId>& ids) {
        Mask mask(ids.window(), 0);
        for (std::size_t i = 0; i < mask.pixels().size(); ++i) mask.pixels()[i] = ids.pixels()[i] != kNoPart;
        return fill_enclosed(mask);
    };
    const Mask a = filled(before), b = filled(after);
    std::int64_t both = 0, either = 0;
    for (std::size_t i = 0; i < a.pixels().size(); ++i) {
        both += a.pixels()[i] & b.pixels()[i];
        either += a.pixels()[i] | b.pixels()[i];
    }
    return either ? double(both) / double(either) : 1.0;
}

double context_removed(const Image<PartId>& before, const Image<PartId>& after,
                       std::span<const std::uint8_t> is_target) {
    std::int64_t context = 0, removed = 0;
    for (std::size_t i = 0; i < before.pixels().size(); ++i) {
        const PartId w = before.pixels()[i];
        if (w == kNoPart || is_target[index(w)]) continue;
        ++context;
        removed += after.pixels()[i] != w;
    }
    return context ? double(removed) / double(context) : -1.0;
}

} // namespace porthole
