#include "porthole/trace/layers.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <limits>

#include "porthole/trace/visibility.h"

namespace porthole {

namespace {

constexpr int kTile = 64;

/// Calls body(tile, x0, y0) for the 4x4 blocks, aligned to multiples of 4, that hold a pixel of
/// `where`, tile by tile.
template <typename Body> void for_each_marked_block(const Mask& where, const Control& control, Body&& body) {
    parallel_for_tiles(where.window(), kTile, control, [&](Rect tile) {
        for (int by = tile.y0 >> 2; 4 * by < tile.y1; ++by)
            for (int bx = tile.x0 >> 2; 4 * bx < tile.x1; ++bx) {
                const Rect block = Rect{4 * bx, 4 * by, 4 * bx + 4, 4 * by + 4}.intersected(tile);
                bool any = false;
                for (int y = block.y0; y < block.y1 && !any; ++y)
                    any = std::any_of(&where(block.x0, y), &where(block.x0, y) + block.width(),
                                      [](std::uint8_t m) { return m != 0; });
                if (any) body(block);
            }
    });
}

/// Rays through the pixels of `where` in a block, which end at `until(x, y)`.
/// @return number of active lanes
template <typename Until> int set_rays(RayHit16& rays, float (&depth_per_t)[kLanes], Vec2i (&pixel)[kLanes],
                                       const View& view, Rect block, const Mask& where, const Until& until) {
    int lane = 0;
    for (int y = block.y0; y < block.y1; ++y)
        for (int x = block.x0; x < block.x1; ++x) {
            if (!where(x, y)) continue;
            const Ray ray = view.ray(float(x) + 0.5f, float(y) + 0.5f);
            rays.set(lane, ray.origin, ray.direction, 0, until(x, y) / ray.depth_per_t);
            depth_per_t[lane] = ray.depth_per_t;
            pixel[lane] = {x, y};
            if (rays.active(lane)) ++lane;
        }
    for (int i = lane; i < kLanes; ++i) rays.clear(i);
    return lane;
}

} // namespace

std::vector<LayerDepths> trace_layers(const Bvh& bvh, const View& view, const Mask& where, const Image<float>& until,
                                      std::span<const std::uint8_t> level, std::size_t levels, float tolerance,
                                      const Control& control, std::int64_t* rays) {
    std::vector<LayerDepths> layers(levels,
                                    {Image<float>(where.window(), kInfinity), Image<float>(where.window(), kInfinity)});
    std::atomic<std::int64_t> traced{0};
    for_each_marked_block(where, control, [&](Rect block) {
        RayHit16 packet;
        float depth_per_t[kLanes];
        Vec2i pixel[kLanes];
        const int n =
            set_rays(packet, depth_per_t, pixel, view, block, where, [&](int x, int y) { return until(x, y); });
        if (n == 0) return;
        traced += n;
        std::vector<std::pair<float, std::uint8_t>> met[kLanes]; // depth and level
        for_each_crossing(bvh, packet, [&](const Crossing& c) {
            const std::uint8_t k = level.empty() ? std::uint8_t{0} : level[index(c.part)];
            met[c.lane].emplace_back(c.t * depth_per_t[c.lane], k);
        });
        for (int i = 0; i < n; ++i) {
            std::sort(met[i].begin(), met[i].end());
            const Vec2i p = pixel[i];
            for (auto at = met[i].begin(); at != met[i].end(); ++at) {
                LayerDepths& layer = layers[at->second];
                if (layer.first(p.x, p.y) < kInfinity) continue;
                const float first = at->first;
                layer.first(p.x, p.y) = first;
                const float apart = std::max(tolerance, first * 8 * std::numeric_limits<float>::epsilon());
                const auto next =
                    std::find_if(at, met[i].end(), [&](const auto& m) { return m.first > first + apart; });
                if (next != met[i].end()) layer.next(p.x, p.y) = next->first;
            }
        }
    });
    if (rays) *rays += traced;
    return layers;
}

std::vector<std::vector<PartExtent>> trace_extents(const Bvh& bvh, const View& view, std::span<const Vec2i> pixels,
                                                   const Control& control, std::int64_t* rays) {
    std::vector<std::vector<PartExtent>> extents(pixels.size());
    const std::size_t packets = (pixels.size() + kLanes - 1) / kLanes;
    parallel_for(packets, control, [&](std::size_t k) {
        RayHit16 packet;
        float depth_per_t[kLanes];
        for (std::size_t i = 0; i < kLanes; ++i) {
            const std::size_t at = k * kLanes + i;
            if (at >= pixels.size()) {
                packet.clear(int(i));
                continue;
            }
            const Ray ray = view.ray(float(pixels[at].x) + 0.5f, float(pixels[at].y) + 0.5f);
            packet.set(int(i), ray.origin, ray.direction, 0, kInfinity);
            depth_per_t[i] = ray.depth_per_t;
        }
        for_each_crossing(bvh, packet, [&](const Crossing& c) {
            std::vector<PartExtent>& met = extents[k * kLanes + std::size_t(c.lane)];
            const float depth = c.t * depth_per_t[c.lane];
            const auto it = std::lower_bound(met.begin(), met.end(), c.part,
                                             [](const PartExtent& e, PartId part) { return e.part < part; });
            if (it == met.end() || it->part != c.part)
                met.insert(it, {c.part, depth, depth});
            else
                it->first = std::min(it->first, depth), it->last = std::max(it->last, depth);
        });
    });
    if (rays) *rays += std::int64_t(pixels.size());
    return extents;
}

CutEffect trace_cut_effect(const Bvh& cut_set, const Bvh& whole, const Cut& cut, const Mask& where,
                           const Control& control, std::int64_t* rays) {
    const Rect w = where.window();
    CutEffect effect{Image<float>(w, -kInfinity), Image<std::uint8_t>(w, 0), {}};
    const auto depth_at = [&](int x, int y, std::size_t level) {
        return cut.levels[level](x, y).depth(-cut.distance(x, y));
    };
    Image<float> deepest(w, -kInfinity); // over the levels
    for (int y = w.y0; y < w.y1; ++y)
        for (int x = w.x0; x < w.x1; ++x) {
            if (!where(x, y)) continue;
            for (std::size_t k = 0; k < cut.levels.size(); ++k)
                deepest(x, y) = std::max(deepest(x, y), depth_at(x, y, k));
        }

    std::atomic<std::int64_t> traced{0};
    for_each_marked_block(where, control, [&](Rect block) {
        RayHit16 packet;
        float depth_per_t[kLanes];
        Vec2i pixel[kLanes];
        const int n =
            set_rays(packet, depth_per_t, pixel, cut.view, block, where, [&](int x, int y) { return deepest(x, y); });
        if (n == 0) return;
        traced += n;
        float limit[kLanes][kMostLevels];
        for (int i = 0; i < n; ++i)
            for (std::size_t k = 0; k < cut.levels.size(); ++k) limit[i][k] = depth_at(pixel[i].x, pixel[i].y, k);
        for_each_crossing(cut_set, packet, [&](const Crossing& c) {
            const float depth = c.t * depth_per_t[c.lane];
            const std::size_t level = cut.level_of(c.part);
            const Vec2i p = pixel[c.lane];
            if (!(depth < limit[c.lane][level]) || !(depth > effect.farthest(p.x, p.y))) return;
            effect.farthest(p.x, p.y) = depth;
            effect.farthest_level(p.x, p.y) = std::uint8_t(level);
        });
    });

    // Mostly there is something behind all that may be cut; only where there is not, what is
    // left of the levels and kept parts has to be looked for.
    effect.left = trace_beyond(whole, cut.view, where, deepest, control, rays);
    Mask unsure(w);
    for (std::size_t i = 0; i < unsure.pixels().size(); ++i) {
        if (!where.pixels()[i] || effect.left.pixels()[i]) continue;
        const bool untouched = effect.farthest.pixels()[i] == -kInfinity;
        effect.left.pixels()[i] = untouched;
        unsure.pixels()[i] = !untouched;
    }
    for_each_marked_block(unsure, control, [&](Rect block) {
        RayHit16 packet;
        float depth_per_t[kLanes];
        Vec2i pixel[kLanes];
        const int n =
            set_rays(packet, depth_per_t, pixel, cut.view, block, unsure, [&](int x, int y) { return deepest(x, y); });
        traced += n;
        for_each_crossing(whole, packet, [&](const Crossing& c) {
            const Vec2i p = pixel[c.lane];
            const float depth = c.t * depth_per_t[c.lane];
            const CutRole role = cut.role[index(c.part)];
            const bool gone = role == CutRole::cut_set ? depth < depth_at(p.x, p.y, cut.level_of(c.part))
                              : role == CutRole::loose ? depth < effect.farthest(p.x, p.y)
                                                       : false;
            if (!gone) effect.left(p.x, p.y) = 1;
        });
    });
    if (rays) *rays += traced;
    return effect;
}

} // namespace porthole
