#include <algorithm>
#include <array>
#include <cassert>
#include <cstdlib>
#include <unordered_set>

#include "porthole/hole/contour.h"
#include "porthole/hole/directions.h"

namespace porthole {
namespace {

constexpr std::int32_t kMacroPixel = 8, kSmallestBlock = 2;

/// Ids as they become known; asks for each pixel once.
class LazyIds {
public:
    LazyIds(const TraceIds& trace, Rect window) : known(window, kNoPart), traced(window, 0), trace_(trace) {}

    /// Makes the ids of `pixels` (inside the window, repeats allowed) known.
    void request(std::span<const Vec2i> pixels) {
        missing_.clear();
        for (const Vec2i p : pixels) {
            if (traced(p.x, p.y)) continue;
            traced(p.x, p.y) = 1;
            missing_.push_back(p);
        }
        if (missing_.empty()) return;
        const std::vector<PartId> ids = trace_(missing_);
        assert(ids.size() == missing_.size());
        for (std::size_t i = 0; i < missing_.size(); ++i) known(missing_[i].x, missing_[i].y) = ids[i];
        rays += std::int64_t(missing_.size());
    }
    PartId operator()(Vec2i p) {
        if (!known.contains(p.x, p.y)) return kNoPart;
        if (!traced(p.x, p.y)) request({&p, 1});
        return known(p.x, p.y);
    }

    Image<PartId> known;
    Mask traced;
    std::int64_t rays = 0;

private:
    const TraceIds& trace_;
    std::vector<Vec2i> missing_;
};

struct Block {
    std::int32_t x = 0, y = 0; ///< top left before clamping: a multiple of the size
};

std::array<Vec2i, 4> corners(Rect r) {
    return {Vec2i{r.x0, r.y0}, Vec2i{r.x1 - 1, r.y0}, Vec2i{r.x0, r.y1 - 1}, Vec2i{r.x1 - 1, r.y1 - 1}};
}

/// The blocks of one size whose corners see different ids, in the order given.
std::vector<Block> useful_blocks(const std::vector<Block>& blocks, std::int32_t size, Rect window, LazyIds& ids) {
    const auto clamped = [&](Block b) { return Rect{b.x, b.y, b.x + size, b.y + size}.intersected(window); };
    std::vector<Vec2i> wanted;
    for (const Block b : blocks) {
        const auto c = corners(clamped(b));
        wanted.insert(wanted.end(), c.begin(), c.end());
    }
    ids.request(wanted);
    std::vector<Block> useful;
    for (const Block b : blocks) {
        const auto c = corners(clamped(b));
        if (!std::all_of(c.begin(), c.end(), [&](Vec2i p) { return ids(p) == ids(c[0]); })) useful.push_back(b);
    }
    return useful;
}

/// Step 1: the departure pixel of every id that a smallest block sees beside another.
std::vector<Vec2i> find_departures(Rect window, LazyIds& ids) {
    std::vector<Block> blocks;
    const auto grid_floor = [](std::int32_t v) { return v & ~(kMacroPixel - 1); };
    for (std::int32_t y = grid_floor(window.y0); y < window.y1; y += kMacroPixel)
        for (std::int32_t x = grid_floor(window.x0); x < window.x1; x += kMacroPixel) blocks.push_back({x, y});

    // Level by level, so that rays come in bulk; sub blocks keep the place of their block, so
    // the smallest ones come out in the order of a recursive walk.
    std::int32_t size = kMacroPixel;
    for (;; size /= 2) {
        const std::vector<Block> useful = useful_blocks(blocks, size, window, ids);
        blocks.clear();
        if (size == kSmallestBlock) {
            blocks = useful;
            break;
        }
        const std::int32_t half = size / 2;
        for (const Block b : useful)
            for (const Block sub : {b, Block{b.x + half, b.y}, Block{b.x, b.y + half}, Block{b.x + half, b.y + half}})
                if (!Rect{sub.x, sub.y, sub.x + half, sub.y + half}.intersected(window).empty()) blocks.push_back(sub);
    }

    std::vector<Vec2i> departures;
    std::unordered_set<PartId> seen;
    for (const Block b : blocks)
        for (const Vec2i p : corners(Rect{b.x, b.y, b.x + size, b.y + size}.intersected(window))) {
            const PartId id = ids(p);
            if (id != kNoPart && seen.insert(id).second) departures.push_back(p);
        }
    return departures;
}

/// Step 2: the code direction technique. `v_buffer` is 1 on accepted pixels.
Contour follow_directions(Vec2i departure, LazyIds& ids, Mask& v_buffer) {
    Contour contour;
    const PartId id = ids(departure);
    Vec2i current = departure;
    const auto acceptable = [&](int i) {
        const Vec2i n = neighbour(current, i);
        // In this order: every id asked for may cost a ray.
        return v_buffer.contains(n.x, n.y) && !v_buffer(n.x, n.y) && ids(n) == id &&
               ids(neighbour(current, i - 1)) != ids(neighbour(current, i + 1));
    };
    for (;;) {
        contour.pixels.push_back(current);
        v_buffer(current.x, current.y) = 1;
        int i = 0;
        while (i < 8 && !acceptable(i)) ++i;
        if (i == 8) break;
        current = neighbour(current, i);
    }
    const Vec2i way = departure - current;
    contour.closed = contour.pixels.size() >= 3 && std::abs(way.x) <= 1 && std::abs(way.y) <= 1;
    return contour;
}

} // namespace

PaperContours find_contours_paper(const TraceIds& trace, Rect window) {
    PaperContours result;
    LazyIds ids(trace, window);
    if (!window.empty()) {
        const std::vector<Vec2i> departures = find_departures(window, ids);
        result.step1_rays = ids.rays;
        Mask v_buffer(window, 0);
        for (const Vec2i departure : departures) {
            result.contours.push_back(follow_directions(departure, ids, v_buffer));
            result.ids.push_back(ids(departure));
        }
        result.step2_rays = ids.rays - result.step1_rays;
    }
    result.known = std::move(ids.known);
    result.traced = std::move(ids.traced);
    return result;
}

} // namespace porthole
