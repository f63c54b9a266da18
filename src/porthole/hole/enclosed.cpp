// Background that the enclosing object surrounds.
#include <algorithm>
#include <array>
#include <cstring>
#include <unordered_map>

#include "porthole/hole/hole.h"

namespace porthole {
namespace {

/// Runs of background pixels, joined where they touch from row to row.
class BackgroundRuns {
public:
    /// @param whole  a run that meets its edge is open.
    BackgroundRuns(const Mask& hit, Rect whole) : window_(hit.window()) {
        const Rect w = window_;
        std::size_t above = 0, row_begin = 0;
        for (std::int32_t y = w.y0; y < w.y1; ++y) {
            above = row_begin, row_begin = runs.size();
            rows_.push_back(std::int32_t(row_begin));
            const std::uint8_t* row = hit.row(y);
            for (std::int32_t x = 0; x < w.width();) {
                const void* zero = std::memchr(row + x, 0, std::size_t(w.width() - x));
                if (!zero) break;
                const auto begin = std::int32_t(static_cast<const std::uint8_t*>(zero) - row);
                x = first_set(row, begin, w.width());
                const bool at_edge =
                    y == whole.y0 || y == whole.y1 - 1 || w.x0 + begin == whole.x0 || w.x0 + x == whole.x1;
                runs.push_back({begin, x, y, at_edge ? 0 : std::int32_t(runs.size())});
            }
            // Runs of both rows are in order of x: walk them side by side.
            for (std::size_t a = above, b = row_begin; a < row_begin && b < runs.size();) {
                if (runs[a].begin < runs[b].end && runs[b].begin < runs[a].end) join(std::int32_t(a), std::int32_t(b));
                runs[a].end < runs[b].end ? ++a : ++b;
            }
        }
    }

    struct Run {
        std::int32_t begin = 0, end = 0; ///< from the window's left edge
        std::int32_t y = 0;
        std::int32_t parent = 0; ///< run 0 stands for the open background
    };
    std::vector<Run> runs{Run{}};

    [[nodiscard]] std::int32_t root(std::int32_t i) {
        while (parent(i) != i) i = parent(i) = parent(parent(i));
        return i;
    }
    void join(std::int32_t a, std::int32_t b) {
        a = root(a), b = root(b);
        // Smaller index on top: the open background stays a root.
        parent(std::max(a, b)) = std::min(a, b);
    }
    /// The run that holds a background pixel of the window.
    [[nodiscard]] std::int32_t run_at(Vec2i p) const {
        const auto first = runs.begin() + rows_[std::size_t(p.y - window_.y0)];
        const auto after = std::upper_bound(first, runs.end(), p, [](Vec2i q, const Run& r) { return q.y < r.y; });
        const auto next =
            std::upper_bound(first, after, p.x - window_.x0, [](std::int32_t x, const Run& r) { return x < r.begin; });
        return std::int32_t(next - runs.begin()) - 1;
    }

private:
    std::int32_t& parent(std::int32_t i) { return runs[std::size_t(i)].parent; }
    static std::int32_t first_set(const std::uint8_t* row, std::int32_t x, std::int32_t end) {
        for (std::uint64_t eight = 0; x + 8 <= end; x += 8) {
            std::memcpy(&eight, row + x, 8);
            if (eight != 0) break;
        }
        while (x < end && row[x] == 0) ++x;
        return x;
    }
    Rect window_;
    std::vector<std::int32_t> rows_; ///< first run of each row, or of a later one
};

/// Follows regions that leave the window, until it is known whether they reach the edge of `whole`.
class Beyond {
public:
    Beyond(const Mask& hit, Rect whole, const HitBeyond& hit_beyond, BackgroundRuns& background)
        : hit_(hit), window_(hit.window()), whole_(whole), hit_beyond_(hit_beyond), background_(background) {
        for (std::int32_t i = 1; i < std::int32_t(background.runs.size()); ++i)
            for_each_exit(i, [&](Vec2i p) { exits_[background_.root(i)].push_back(p); });
    }

    void follow_all() {
        for (std::int32_t i = 1; i < std::int32_t(background_.runs.size()); ++i)
            if (background_.root(i) == i && exits_.contains(i)) follow(i);
    }

private:
    struct Known {
        std::int32_t followed_for = 0; ///< region that was last followed through it
        std::int32_t region = -1;      ///< a run of the region it belongs to, once seen to be background
    };

    /// Calls visit(pixel) for the pixels beyond the window beside those of a run.
    template <typename Visit> void for_each_exit(std::int32_t i, const Visit& visit) const {
        const BackgroundRuns::Run& run = background_.runs[std::size_t(i)];
        const std::int32_t begin = window_.x0 + run.begin, end = window_.x0 + run.end;
        const auto out = [&](std::int32_t x, std::int32_t y) {
            if (whole_.contains(x, y) && !window_.contains(x, y)) visit(Vec2i{x, y});
        };
        out(begin - 1, run.y), out(end, run.y);
        for (const std::int32_t y : {run.y - 1, run.y + 1})
            if (y < window_.y0 || y >= window_.y1)
                for (std::int32_t x = begin; x < end; ++x) out(x, y);
    }

    void follow(std::int32_t region) {
        open_ = exits_[region];
        while (!open_.empty() && background_.root(region) != 0) {
            const Vec2i p = open_.back();
            open_.pop_back();
            Known& known = pixels_[key(p)];
            if (known.followed_for == region || (known.region < 0 && hit_beyond_(p))) continue;
            if (known.region < 0) known.region = region;
            known.followed_for = region;
            background_.join(known.region, region);
            look_around(p, region);
        }
    }

    void look_around(Vec2i p, std::int32_t region) {
        // The way to the nearest edge is tried first.
        std::array<std::pair<std::int32_t, Vec2i>, 4> ways{{{p.x - whole_.x0, {-1, 0}},
                                                            {whole_.x1 - 1 - p.x, {1, 0}},
                                                            {p.y - whole_.y0, {0, -1}},
                                                            {whole_.y1 - 1 - p.y, {0, 1}}}};
        std::stable_sort(ways.begin(), ways.end(), [](const auto& a, const auto& b) { return a.first > b.first; });
        for (const auto& [to_edge, step] : ways) {
            const Vec2i q = p + step;
            if (to_edge == 0) {
                background_.join(0, region);
            } else if (!window_.contains(q.x, q.y)) {
                open_.push_back(q);
            } else if (!hit_(q.x, q.y)) {
                const std::int32_t other = background_.root(background_.run_at(q));
                if (other == background_.root(region)) continue;
                background_.join(other, region);
                const auto more = exits_.find(other);
                if (more != exits_.end()) open_.insert(open_.end(), more->second.begin(), more->second.end());
            }
        }
    }

    static std::uint64_t key(Vec2i p) { return std::uint64_t(std::uint32_t(p.y)) << 32 | std::uint32_t(p.x); }

    const Mask& hit_;
    Rect window_, whole_;
    const HitBeyond& hit_beyond_;
    BackgroundRuns& background_;
    std::unordered_map<std::int32_t, std::vector<Vec2i>> exits_; ///< by the root the region had at first
    std::unordered_map<std::uint64_t, Known> pixels_;            ///< beyond the window
    std::vector<Vec2i> open_;
};

Mask filled(const Mask& hit, BackgroundRuns& background) {
    Mask filled(hit.window());
    std::transform(hit.pixels().begin(), hit.pixels().end(), filled.pixels().begin(),
                   [](std::uint8_t h) { return std::uint8_t(h != 0); });
    for (std::size_t i = 1; i < background.runs.size(); ++i) {
        if (background.root(std::int32_t(i)) == 0) continue;
        const BackgroundRuns::Run& run = background.runs[i];
        std::uint8_t* row = filled.row(run.y);
        std::fill(row + run.begin, row + run.end, std::uint8_t(1));
    }
    return filled;
}

} // namespace

Mask fill_enclosed(const Mask& hit) {
    BackgroundRuns background(hit, hit.window());
    return filled(hit, background);
}

Mask fill_enclosed(const Mask& hit, Rect whole, const HitBeyond& hit_beyond) {
    BackgroundRuns background(hit, whole);
    Beyond(hit, whole, hit_beyond, background).follow_all();
    return filled(hit, background);
}

} // namespace porthole
