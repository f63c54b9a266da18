#include "porthole/trace/outline.h"

#include <algorithm>
#include <atomic>
#include <cmath>

#include "porthole/trace/packet.h"

namespace porthole {

namespace {

constexpr std::size_t kSeeds = 4096;  ///< vertices a part, at most
constexpr std::size_t kCertain = 512; ///< of so many one is traced wherever it falls
constexpr std::size_t kChunk = 64;    ///< packets handed to a thread at a time

/// Calls body(first, last) for pieces of [0, n), on several threads.
template <typename Body> void for_each_chunk(std::size_t n, const Control& control, const Body& body) {
    parallel_for((n + kChunk - 1) / kChunk, control,
                 [&](std::size_t k) { body(k * kChunk, std::min(n, (k + 1) * kChunk)); });
}

/// Traces the blocks, given by their block coordinates, into `ids`.
/// @return rays
std::int64_t trace_blocks(const Bvh& bvh, const View& view, std::span<const Vec2i> blocks, IdBuffer& ids,
                          const Control& control) {
    std::atomic<std::int64_t> rays{0};
    for_each_chunk(blocks.size(), control, [&](std::size_t first, std::size_t last) {
        RayHit16 packet;
        float depth_per_t[kLanes];
        std::int64_t n = 0;
        for (std::size_t k = first; k < last; ++k) {
            const int x0 = 4 * blocks[k].x, y0 = 4 * blocks[k].y;
            n += set_block_rays(packet, depth_per_t, view, x0, y0, ids.window());
            intersect(bvh, packet, Coherence::coherent);
            for (int i = 0; i < kLanes; ++i) {
                const int x = x0 + (i & 3), y = y0 + (i >> 2);
                if (!packet.active(i)) continue;
                ids.id(x, y) = packet.hit(i) ? packet.part(i) : kNoPart;
                ids.depth(x, y) = packet.hit(i) ? packet.tfar[i] * depth_per_t[i] : kInfinity;
            }
        }
        rays += n;
    });
    return rays;
}

/// The work of trace_outline().
class Follower {
public:
    Follower(const Bvh& bvh, const View& view, Rect window, const BlockMask& blocks, const Control& control)
        : bvh_(bvh), view_(view), marked_(blocks.marked), control_(control), done_(blocks.blocks, 0) {
        outline_.ids = IdBuffer(window);
        // Corners of 8x8 blocks, up to those right of and below the last ones.
        const Rect b = blocks.blocks;
        corners_ = Image<PartId>({b.x0 >> 1, b.y0 >> 1, ((b.x1 - 1) >> 1) + 2, ((b.y1 - 1) >> 1) + 2}, kNoPart);
    }

    Outline follow(std::span<const Vec2i> seeds) {
        trace_corners();
        std::vector<Vec2i> wave = blocks_that_differ();
        // Most vertices lie inside; some of those find holes.
        for (std::size_t i = 0; i < seeds.size(); ++i)
            if (const Vec2i p = seeds[i]; i % kCertain == 0 || is_outside({p.x >> 3, p.y >> 3}))
                add({p.x >> 2, p.y >> 2}, wave);
        while (!wave.empty()) {
            outline_.rays += trace_blocks(bvh_, view_, wave, outline_.ids, control_);
            wave = disagreeing(wave);
        }
        fill_inferred();
        return std::move(outline_);
    }

private:
    /// The pixel of a corner: beyond the window the nearest in it.
    [[nodiscard]] Vec2i pixel_of(Vec2i corner) const {
        const Rect w = outline_.ids.window();
        return {std::clamp(8 * corner.x, w.x0, w.x1 - 1), std::clamp(8 * corner.y, w.y0, w.y1 - 1)};
    }

    void trace_corners() {
        // What is not marked is outside and need not be traced.
        std::vector<Vec2i> points;
        const Rect c = corners_.window();
        for (int y = c.y0; y < c.y1; ++y)
            for (int x = c.x0; x < c.x1; ++x) {
                const Vec2i p = pixel_of({x, y});
                if (marked_(p.x >> 2, p.y >> 2)) points.push_back({x, y});
            }
        const std::size_t packets = (points.size() + kLanes - 1) / kLanes;
        for_each_chunk(packets, control_, [&](std::size_t first, std::size_t last) {
            RayHit16 packet;
            float x[kLanes] = {}, y[kLanes] = {}, depth_per_t[kLanes];
            for (std::size_t k = first; k < last; ++k) {
                const std::size_t begin = k * kLanes;
                const int n = int(std::min<std::size_t>(kLanes, points.size() - begin));
                for (int i = 0; i < n; ++i) {
                    const Vec2i p = pixel_of(points[begin + std::size_t(i)]);
                    x[i] = float(p.x) + 0.5f, y[i] = float(p.y) + 0.5f;
                }
                set_rays(packet, depth_per_t, view_, x, y);
                for (int i = n; i < kLanes; ++i) packet.clear(i);
                intersect(bvh_, packet, Coherence::coherent);
                for (int i = 0; i < n; ++i)
                    if (packet.hit(i)) {
                        const Vec2i p = points[begin + std::size_t(i)];
                        corners_(p.x, p.y) = packet.part(i);
                    }
            }
        });
        outline_.rays += std::int64_t(points.size());
    }

    /// Of the 8x8 block that holds a block, what it is taken for.
    [[nodiscard]] PartId corner(int x, int y) const { return corners_(x >> 1, y >> 1); }

    void add(Vec2i block, std::vector<Vec2i>& wave) {
        if (!marked_.at_or(block.x, block.y, 0) || done_(block.x, block.y)) return;
        done_(block.x, block.y) = 1;
        wave.push_back(block);
    }

    /// Whether all corners of the 8x8 block are outside.
    [[nodiscard]] bool is_outside(Vec2i b) const {
        const Rect c = corners_.window();
        if (b.x < c.x0 || b.x + 1 >= c.x1 || b.y < c.y0 || b.y + 1 >= c.y1) return false;
        return corners_(b.x, b.y) == kNoPart && corners_(b.x + 1, b.y) == kNoPart &&
               corners_(b.x, b.y + 1) == kNoPart && corners_(b.x + 1, b.y + 1) == kNoPart;
    }

    std::vector<Vec2i> blocks_that_differ() {
        std::vector<Vec2i> wave;
        const Rect c = corners_.window();
        for (int y = c.y0; y + 1 < c.y1; ++y)
            for (int x = c.x0; x + 1 < c.x1; ++x) {
                const bool inside = corners_(x, y) != kNoPart;
                if ((corners_(x + 1, y) != kNoPart) == inside && (corners_(x, y + 1) != kNoPart) == inside &&
                    (corners_(x + 1, y + 1) != kNoPart) == inside)
                    continue;
                for (const Vec2i b : {Vec2i{0, 0}, Vec2i{1, 0}, Vec2i{0, 1}, Vec2i{1, 1}})
                    add({2 * x + b.x, 2 * y + b.y}, wave);
            }
        return wave;
    }

    /// The blocks beside those of the last wave for which something else was inferred.
    std::vector<Vec2i> disagreeing(std::span<const Vec2i> wave) {
        std::vector<Vec2i> next;
        const Image<PartId>& ids = outline_.ids.id;
        for (const Vec2i b : wave) {
            const auto look = [&](Vec2i beside, Vec2i from, Vec2i step) {
                if (!marked_.at_or(beside.x, beside.y, 0) || done_(beside.x, beside.y)) return;
                const bool inside = corner(beside.x, beside.y) != kNoPart;
                for (int i = 0; i < 4; ++i) {
                    const Vec2i p = from + Vec2i{i * step.x, i * step.y};
                    if (!ids.contains(p.x, p.y) || (ids(p.x, p.y) != kNoPart) == inside) continue;
                    add(beside, next);
                    return;
                }
            };
            const Vec2i p{4 * b.x, 4 * b.y};
            look({b.x - 1, b.y}, p, {0, 1}), look({b.x + 1, b.y}, p + Vec2i{3, 0}, {0, 1});
            look({b.x, b.y - 1}, p, {1, 0}), look({b.x, b.y + 1}, p + Vec2i{0, 3}, {1, 0});
        }
        return next;
    }

    void fill_inferred() {
        outline_.inferred = {done_.window(), Mask(done_.window(), 0)};
        const Rect b = done_.window();
        for (int y = b.y0; y < b.y1; ++y)
            for (int x = b.x0; x < b.x1; ++x) {
                const PartId id = corner(x, y);
                if (id == kNoPart || done_(x, y) || !marked_(x, y)) continue;
                outline_.inferred.marked(x, y) = 1;
                const Rect r = Rect{4 * x, 4 * y, 4 * x + 4, 4 * y + 4}.intersected(outline_.ids.window());
                for (int py = r.y0; py < r.y1; ++py) std::fill_n(&outline_.ids.id(r.x0, py), r.width(), id);
            }
    }

    const Bvh& bvh_;
    const View& view_;
    const Mask& marked_;
    const Control& control_;
    Image<PartId> corners_; ///< see pixel_of()
    Mask done_;             ///< blocks traced, or about to be
    Outline outline_;
};

} // namespace

std::vector<BlockMask> separate(const BlockMask& blocks) {
    const Rect w = blocks.blocks;
    std::vector<BlockMask> groups;
    Mask left = blocks.marked;
    std::vector<Vec2i> found;
    std::int64_t area = 0;
    for (int y0 = w.y0; y0 < w.y1; ++y0) {
        for (int x0 = w.x0; x0 < w.x1; ++x0) {
            if (!left(x0, y0)) continue;
            found.assign(1, {x0, y0});
            left(x0, y0) = 0;
            Rect box{x0, y0, x0 + 1, y0 + 1};
            for (std::size_t i = 0; i < found.size(); ++i) {
                const Vec2i p = found[i];
                box = {std::min(box.x0, p.x), std::min(box.y0, p.y), std::max(box.x1, p.x + 1),
                       std::max(box.y1, p.y + 1)};
                for (int y = std::max(p.y - 1, w.y0); y < std::min(p.y + 2, w.y1); ++y)
                    for (int x = std::max(p.x - 1, w.x0); x < std::min(p.x + 2, w.x1); ++x)
                        if (left(x, y)) {
                            left(x, y) = 0;
                            found.push_back({x, y});
                        }
            }
            area += std::int64_t(box.width()) * box.height();
            if (area > std::int64_t(w.width()) * w.height()) return {blocks};
            BlockMask& group = groups.emplace_back(BlockMask{box, Mask(box, 0)});
            for (const Vec2i p : found) group.marked(p.x, p.y) = 1;
        }
    }
    return groups;
}

Rect pixel_rect(const BlockMask& blocks, Rect window) {
    const Rect w = blocks.blocks;
    Rect b{w.x1, w.y1, w.x0, w.y0};
    for (int y = w.y0; y < w.y1; ++y)
        for (int x = w.x0; x < w.x1; ++x)
            if (blocks.marked(x, y))
                b = {std::min(b.x0, x), std::min(b.y0, y), std::max(b.x1, x + 1), std::max(b.y1, y + 1)};
    if (b.empty()) return {};
    return Rect{4 * b.x0, 4 * b.y0, 4 * b.x1, 4 * b.y1}.intersected(window);
}

Outline trace_outline(const Bvh& bvh, const View& view, Rect window, const BlockMask& blocks,
                      std::span<const Vec2i> seeds, const Control& control) {
    return Follower(bvh, view, window, blocks, control).follow(seeds);
}

void trace_inferred(Outline& outline, const Bvh& bvh, const View& view, const Control& control) {
    std::vector<Vec2i> blocks;
    Mask& marked = outline.inferred.marked;
    const Rect b = marked.window();
    for (int y = b.y0; y < b.y1; ++y)
        for (int x = b.x0; x < b.x1; ++x)
            if (marked(x, y)) blocks.push_back({x, y});
    outline.rays += trace_blocks(bvh, view, blocks, outline.ids, control);
    std::fill(marked.pixels().begin(), marked.pixels().end(), std::uint8_t{0});
}

std::vector<Vec2i> outline_seeds(const Scene& scene, std::span<const PartId> parts, const View& view) {
    std::vector<Vec2i> seeds;
    for (const PartId id : parts) {
        const Part& part = scene.parts[index(id)];
        const std::vector<Vec3f>& positions = scene.meshes[part.mesh].positions;
        const Affine3f place(part.world_from_mesh);
        const std::size_t n = std::min(kSeeds, positions.size());
        for (std::size_t i = 0; i < n; ++i) {
            const PixelPoint p = view.project(place.point(positions[i * positions.size() / n]));
            if (!(p.depth > 0) && !view.orthographic) continue;
            if (std::abs(p.x) < 1e8f && std::abs(p.y) < 1e8f)
                seeds.push_back({int(std::floor(p.x)), int(std::floor(p.y))});
        }
    }
    return seeds;
}

} // namespace porthole
