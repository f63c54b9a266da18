#include "porthole/trace/visibility.h"

#include <algorithm>
#include <atomic>
#include <bit>
#include <cmath>
#include <numeric>

#include "porthole/trace/packet.h"

namespace porthole {

namespace {

constexpr int kTile = 64;

int floor_div4(int a) { return a >> 2; } // arithmetic shift: rounds down for negative pixels too

/// Calls body(x0, y0) for the 4x4 blocks, aligned to multiples of 4, that meet `tile`.
template <typename Body> void for_each_block(Rect tile, Body&& body) {
    for (int by = floor_div4(tile.y0); 4 * by < tile.y1; ++by)
        for (int bx = floor_div4(tile.x0); 4 * bx < tile.x1; ++bx) body(4 * bx, 4 * by);
}

/// Whether wanted(x, y) for some pixel of the 4x4 block that lies in `tile`.
template <typename Wanted> bool any_in_block(Rect tile, int x0, int y0, const Wanted& wanted) {
    const Rect block = Rect{x0, y0, x0 + 4, y0 + 4}.intersected(tile);
    for (int y = block.y0; y < block.y1; ++y)
        for (int x = block.x0; x < block.x1; ++x)
            if (wanted(x, y)) return true;
    return false;
}

void store_ids(const RayHit16& rays, const float (&depth_per_t)[kLanes], int x0, int y0, IdBuffer& ids) {
    for (int i = 0; i < kLanes; ++i) {
        if (!rays.hit(i)) continue;
        const int x = x0 + (i & 3), y = y0 + (i >> 2);
        ids.id(x, y) = rays.part(i);
        ids.depth(x, y) = rays.tfar[i] * depth_per_t[i];
    }
}

void add(std::int64_t* rays, const std::atomic<std::int64_t>& n) {
    if (rays) *rays += n.load();
}

/// Ids of the marked blocks of `window`, of all of them without `blocks`.
IdBuffer traced_ids(const Bvh& bvh, const View& view, Rect window, const BlockMask* blocks, const Control& control,
                    std::int64_t* rays) {
    IdBuffer ids(window);
    std::atomic<std::int64_t> traced{0};
    parallel_for_tiles(window, kTile, control, [&](Rect tile) {
        RayHit16 packet;
        float depth_per_t[kLanes];
        std::int64_t n = 0;
        for_each_block(tile, [&](int x0, int y0) {
            if (blocks && !blocks->marked(floor_div4(x0), floor_div4(y0))) return;
            n += set_block_rays(packet, depth_per_t, view, x0, y0, tile);
            intersect(bvh, packet, Coherence::coherent);
            store_ids(packet, depth_per_t, x0, y0, ids);
        });
        traced += n;
    });
    add(rays, traced);
    return ids;
}

} // namespace

IdBuffer trace_ids(const Bvh& bvh, const View& view, Rect window, const Control& control, std::int64_t* rays) {
    return traced_ids(bvh, view, window, nullptr, control, rays);
}

IdBuffer trace_ids_in_blocks(const Bvh& bvh, const View& view, Rect window, const BlockMask& blocks,
                             const Control& control, std::int64_t* rays) {
    return traced_ids(bvh, view, window, &blocks, control, rays);
}

std::vector<PartId> trace_ids_at(const Bvh& bvh, const View& view, std::span<const Vec2i> pixels, std::uint32_t mask) {
    const FlushDenormals flush;
    std::vector<PartId> ids(pixels.size(), kNoPart);
    RayHit16 packet;
    float x[kLanes] = {}, y[kLanes] = {}, depth_per_t[kLanes];
    for (std::size_t first = 0; first < pixels.size(); first += kLanes) {
        const int n = int(std::min<std::size_t>(kLanes, pixels.size() - first));
        for (int i = 0; i < n; ++i) {
            const Vec2i p = pixels[first + std::size_t(i)];
            x[i] = float(p.x) + 0.5f, y[i] = float(p.y) + 0.5f;
        }
        set_rays(packet, depth_per_t, view, x, y, mask);
        for (int i = n; i < kLanes; ++i) packet.clear(i);
        intersect(bvh, packet, Coherence::incoherent);
        for (int i = 0; i < n; ++i)
            if (packet.hit(i)) ids[first + std::size_t(i)] = packet.part(i);
    }
    return ids;
}

Spans trace_spans(const Bvh& bvh, std::uint32_t mask, const View& view, const IdBuffer& targets, float tolerance,
                  const Control& control, std::int64_t* rays) {
    Spans spans;
    spans.nearest = Image<float>(targets.window(), kInfinity);
    std::vector<std::atomic<std::int64_t>> pixels(bvh.scene().parts.size());
    // Depth gaps are not negative, so their bits order as integers.
    std::vector<std::atomic<std::uint32_t>> gaps(bvh.scene().parts.size());
    std::atomic<std::int64_t> traced{0};

    parallel_for_tiles(targets.window(), kTile, control, [&](Rect tile) {
        RayHit16 packet;
        float depth_per_t[kLanes], depth[kLanes];
        std::vector<std::pair<PartId, int>> met; // part and lane, each pair once
        std::int64_t n = 0;
        for_each_block(tile, [&](int x0, int y0) {
            if (!any_in_block(tile, x0, y0, [&](int x, int y) { return targets.id(x, y) != kNoPart; })) return;
            bool any = false;
            set_block_rays(packet, depth_per_t, view, x0, y0, tile, mask);
            for (int i = 0; i < kLanes; ++i) {
                if (!packet.active(i)) continue;
                const int x = x0 + (i & 3), y = y0 + (i >> 2);
                if (targets.id(x, y) == kNoPart) {
                    packet.clear(i);
                    continue;
                }
                depth[i] = targets.depth(x, y);
                const float clear = std::max(tolerance, depth[i] * 8 * std::numeric_limits<float>::epsilon());
                packet.tfar[i] = (depth[i] - clear) / depth_per_t[i];
                any |= packet.active(i);
                ++n;
            }
            if (!any) return;
            met.clear();
            for_each_crossing(bvh, packet, [&](const Crossing& c) {
                const int lane = c.lane;
                const float d = c.t * depth_per_t[lane];
                float& nearest = spans.nearest(x0 + (lane & 3), y0 + (lane >> 2));
                nearest = std::min(nearest, d);
                const std::uint32_t gap = std::bit_cast<std::uint32_t>(std::max(0.0f, depth[lane] - d));
                std::atomic<std::uint32_t>& greatest = gaps[index(c.part)];
                std::uint32_t seen = greatest.load(std::memory_order_relaxed);
                while (seen < gap && !greatest.compare_exchange_weak(seen, gap, std::memory_order_relaxed)) {
                }
                met.emplace_back(c.part, lane);
            });
            std::sort(met.begin(), met.end());
            met.erase(std::unique(met.begin(), met.end()), met.end());
            for (const auto& [part, lane] : met) pixels[index(part)].fetch_add(1, std::memory_order_relaxed);
        });
        traced += n;
    });

    for (std::uint32_t i = 0; i < pixels.size(); ++i)
        if (const std::int64_t n = pixels[i].load(); n > 0)
            spans.parts.push_back({PartId{i}, n, std::bit_cast<float>(gaps[i].load())});
    add(rays, traced);
    return spans;
}

Mask trace_coverage(const Bvh& bvh, const View& view, Rect window, const BlockMask* blocks, const Control& control,
                    std::int64_t* rays) {
    Mask hit(window, 0);
    std::atomic<std::int64_t> traced{0};
    parallel_for_tiles(window, kTile, control, [&](Rect tile) {
        RayHit16 packet;
        float depth_per_t[kLanes];
        std::int64_t n = 0;
        for_each_block(tile, [&](int x0, int y0) {
            if (blocks && !blocks->marked(floor_div4(x0), floor_div4(y0))) return;
            n += set_block_rays(packet, depth_per_t, view, x0, y0, tile);
            occluded_by_any(bvh, packet);
            for (int i = 0; i < kLanes; ++i)
                if (packet.tfar[i] == -kInfinity && packet.tnear[i] == 0) hit(x0 + (i & 3), y0 + (i >> 2)) = 1;
        });
        traced += n;
    });
    add(rays, traced);
    return hit;
}

Image<float> trace_farthest(const Bvh& bvh, const View& view, const Mask& mask, const Image<float>& limit,
                            const Control& control, std::int64_t* rays) {
    Image<float> farthest(mask.window(), -kInfinity);
    std::atomic<std::int64_t> traced{0};
    parallel_for_tiles(mask.window(), kTile, control, [&](Rect tile) {
        RayHit16 packet;
        float depth_per_t[kLanes];
        std::int64_t n = 0;
        for_each_block(tile, [&](int x0, int y0) {
            if (!any_in_block(tile, x0, y0, [&](int x, int y) { return mask(x, y) != 0; })) return;
            bool any = false;
            set_block_rays(packet, depth_per_t, view, x0, y0, tile);
            for (int i = 0; i < kLanes; ++i) {
                if (!packet.active(i)) continue;
                const int x = x0 + (i & 3), y = y0 + (i >> 2);
                if (!mask(x, y)) {
                    packet.clear(i);
                    continue;
                }
                packet.tfar[i] = limit(x, y) / depth_per_t[i];
                any |= packet.active(i);
                ++n;
            }
            if (!any) return;
            for_each_crossing(bvh, packet, [&](const Crossing& c) {
                float& d = farthest(x0 + (c.lane & 3), y0 + (c.lane >> 2));
                d = std::max(d, c.t * depth_per_t[c.lane]);
            });
        });
        traced += n;
    });
    add(rays, traced);
    return farthest;
}

Mask trace_beyond(const Bvh& bvh, const View& view, const Mask& mask, const Image<float>& from, const Control& control,
                  std::int64_t* rays) {
    Mask beyond(mask.window(), 0);
    std::atomic<std::int64_t> traced{0};
    parallel_for_tiles(mask.window(), kTile, control, [&](Rect tile) {
        RayHit16 packet;
        float depth_per_t[kLanes];
        std::int64_t n = 0;
        for_each_block(tile, [&](int x0, int y0) {
            if (!any_in_block(tile, x0, y0, [&](int x, int y) { return mask(x, y) != 0; })) return;
            set_block_rays(packet, depth_per_t, view, x0, y0, tile);
            for (int i = 0; i < kLanes; ++i) {
                if (!packet.active(i)) continue;
                const int x = x0 + (i & 3), y = y0 + (i >> 2);
                if (!mask(x, y) || !(from(x, y) < kInfinity)) {
                    packet.clear(i);
                    continue;
                }
                packet.tnear[i] = std::max(0.0f, from(x, y) / depth_per_t[i]);
                ++n;
            }
            occluded_by_any(bvh, packet);
            for (int i = 0; i < kLanes; ++i)
                if (packet.tfar[i] == -kInfinity && packet.tnear[i] < kInfinity)
                    beyond(x0 + (i & 3), y0 + (i >> 2)) = 1;
        });
        traced += n;
    });
    add(rays, traced);
    return beyond;
}

Mask trace_back_faces(const Bvh& bvh, const View& view, const Mask& mask, const Image<float>& from,
                      const Image<float>& until, const Control& control) {
    Mask behind(mask.window(), 0);
    parallel_for_tiles(mask.window(), kTile, control, [&](Rect tile) {
        RayHit16 packet;
        float depth_per_t[kLanes];
        for_each_block(tile, [&](int x0, int y0) {
            if (!any_in_block(tile, x0, y0, [&](int x, int y) { return mask(x, y) != 0; })) return;
            set_block_rays(packet, depth_per_t, view, x0, y0, tile);
            for (int i = 0; i < kLanes; ++i) {
                if (!packet.active(i)) continue;
                const int x = x0 + (i & 3), y = y0 + (i >> 2);
                if (mask(x, y) && from(x, y) < kInfinity)
                    packet.tnear[i] = std::max(0.0f, from(x, y) / depth_per_t[i]);
                else
                    packet.clear(i);
            }
            intersect(bvh, packet, Coherence::coherent);
            for (int i = 0; i < kLanes; ++i) {
                if (!packet.hit(i)) continue;
                const int x = x0 + (i & 3), y = y0 + (i >> 2);
                const Affine3f a(bvh.scene().parts[index(packet.part(i))].world_from_mesh);
                const Vec3f normal = transform_normal(a, Vec3f{packet.ng_x[i], packet.ng_y[i], packet.ng_z[i]});
                const float facing = dot(normal, packet.direction(i)) * a.determinant();
                // Two computations of one surface may differ in their last bits.
                const float limit = until(x, y) * (1 + 8 * std::numeric_limits<float>::epsilon());
                behind(x, y) = facing > 0 && packet.tfar[i] * depth_per_t[i] <= limit;
            }
        });
    });
    return behind;
}

FineCoverage trace_fine(const Bvh& bvh, const View& view, Rect window, const Control& control, std::int64_t* rays) {
    FineCoverage fine;
    fine.hits = Image<std::uint16_t>(window, 0);
    fine.depth = Image<float>(window, kInfinity);
    std::atomic<std::int64_t> samples{0};
    parallel_for_tiles(window, kTile, control, [&](Rect tile) {
        RayHit16 packet;
        float depth_per_t[kLanes];
        std::int64_t n = 0;
        for (int y = tile.y0; y < tile.y1; ++y)
            for (int x = tile.x0; x < tile.x1; ++x) {
                float px[kLanes], py[kLanes];
                for (int i = 0; i < kLanes; ++i) {
                    const Vec2f p = fine_position(x, y, i);
                    px[i] = p.x, py[i] = p.y;
                }
                set_rays(packet, depth_per_t, view, px, py);
                intersect(bvh, packet, Coherence::coherent);
                for (int i = 0; i < kLanes; ++i) {
                    if (!packet.hit(i)) continue;
                    fine.hits(x, y) = std::uint16_t(fine.hits(x, y) | 1u << i);
                    fine.depth(x, y) = std::min(fine.depth(x, y), packet.tfar[i] * depth_per_t[i]);
                    ++n;
                }
            }
        samples += n;
    });
    fine.samples = samples;
    if (rays) *rays += std::int64_t(window.width()) * window.height() * kLanes;
    return fine;
}

} // namespace porthole
