#include "porthole/hole/distance.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "porthole/hole/masks.h"

namespace porthole {
namespace {

/// Rows or columns to the nearest site when there is none: more than any window is wide.
constexpr std::int32_t kNoSite = 1 << 29;

/// floor(a / b), b > 0.
std::int64_t floor_divide(std::int64_t a, std::int64_t b) {
    const std::int64_t q = a / b;
    return q - (a % b < 0 ? 1 : 0);
}

/// Lower envelope of the parabolas scale (p - x)^2 + f over the integers p in [0, end), pushed
/// from left to right. An integer where several are lowest belongs to the leftmost of them.
class Envelope {
public:
    struct Arc {
        std::int64_t f = 0;
        std::int32_t x = 0;
        std::int32_t first = 0; ///< lowest from here to the next arc's first
        std::int32_t id = 0;
    };

    Envelope(std::int32_t end, std::int64_t scale) : end_(end), scale_(scale), arcs_(std::size_t(end)) {}

    void clear() { size_ = 0; }

    void push(std::int32_t x, std::int64_t f, std::int32_t id) {
        std::int32_t first = 0;
        while (size_ > 0) {
            // The new parabola is strictly below an older one right of where they meet. If
            // that is so all along the older one's arc, no integer is left to it.
            const Arc& top = arcs_[size_ - 1];
            const std::int64_t rise = scale_ * (std::int64_t(x) * x - std::int64_t(top.x) * top.x) + f - top.f;
            const std::int64_t below_from = floor_divide(rise, 2 * scale_ * (x - top.x)) + 1;
            if (below_from > top.first) {
                if (below_from >= end_) return;
                first = std::int32_t(below_from);
                break;
            }
            --size_;
        }
        arcs_[size_++] = {f, x, first, id};
    }

    /// Calls visit(arc, begin, end) for each arc with its range of integers, left to right.
    template <typename Visit> void for_each_arc(const Visit& visit) const {
        for (std::size_t i = 0; i < size_; ++i)
            visit(arcs_[i], arcs_[i].first, i + 1 < size_ ? arcs_[i + 1].first : end_);
    }

private:
    std::int32_t end_;
    std::int64_t scale_;
    std::vector<Arc> arcs_;
    std::size_t size_ = 0;
};

/// Rows to the nearest site in the same column, for the rows [y0, y1) of the window.
Image<std::int32_t> column_distances(const Mask& sites, std::int32_t y0, std::int32_t y1) {
    const Rect w = sites.window();
    const auto width = std::size_t(w.width());
    Image<std::int32_t> result(Rect{w.x0, y0, w.x1, y1});
    std::vector<std::int32_t> nearest(width, kNoSite);
    for (std::int32_t y = w.y0; y < y1; ++y) {
        const std::uint8_t* site = sites.row(y);
        for (std::size_t i = 0; i < width; ++i) nearest[i] = site[i] ? 0 : std::min(nearest[i] + 1, kNoSite);
        if (y >= y0) std::copy(nearest.begin(), nearest.end(), result.row(y));
    }
    std::fill(nearest.begin(), nearest.end(), kNoSite);
    for (std::int32_t y = w.y1 - 1; y >= y0; --y) {
        const std::uint8_t* site = sites.row(y);
        for (std::size_t i = 0; i < width; ++i) nearest[i] = site[i] ? 0 : std::min(nearest[i] + 1, kNoSite);
        if (y >= y1) continue;
        std::int32_t* out = result.row(y);
        for (std::size_t i = 0; i < width; ++i) out[i] = std::min(out[i], nearest[i]);
    }
    return result;
}

void push_columns(const std::int32_t* distance, std::int32_t begin, std::int32_t end, Envelope& envelope) {
    for (std::int32_t x = begin; x < end; ++x)
        if (distance[x] < kNoSite) envelope.push(x, std::int64_t(distance[x]) * distance[x], x);
}

/// Site indices column by column; within a column by y, heavier first, then by index.
struct Columns {
    std::vector<std::size_t> begin; ///< of each column, and the end of the last
    std::vector<std::int32_t> sites;
};

Columns sort_into_columns(Rect window, std::span<const PowerSite> sites) {
    Columns columns;
    columns.begin.assign(std::size_t(window.width()) + 1, 0);
    for (const PowerSite& site : sites) ++columns.begin[std::size_t(site.center.x - window.x0) + 1];
    std::partial_sum(columns.begin.begin(), columns.begin.end(), columns.begin.begin());
    columns.sites.resize(sites.size());
    std::vector<std::size_t> free = columns.begin;
    for (std::size_t i = 0; i < sites.size(); ++i)
        columns.sites[free[std::size_t(sites[i].center.x - window.x0)]++] = std::int32_t(i);
    for (std::size_t x = 0; x + 1 < columns.begin.size(); ++x)
        std::sort(columns.sites.begin() + std::ptrdiff_t(columns.begin[x]),
                  columns.sites.begin() + std::ptrdiff_t(columns.begin[x + 1]), [&](std::int32_t a, std::int32_t b) {
                      const PowerSite &p = sites[std::size_t(a)], &q = sites[std::size_t(b)];
                      if (p.center.y != q.center.y) return p.center.y < q.center.y;
                      return p.weight != q.weight ? p.weight > q.weight : a < b;
                  });
    return columns;
}

} // namespace

std::int64_t integer_sqrt(std::int64_t n) {
    // Exact below 2^52: the double root is off by less than one.
    auto root = std::int64_t(std::sqrt(double(n)));
    while (root * root > n) --root;
    while ((root + 1) * (root + 1) <= n) ++root;
    return root;
}

Image<std::int64_t> distance_transform(const Mask& sites) {
    const Rect w = sites.window();
    Image<std::int64_t> result(w, kFar);
    if (sites.empty()) return result;
    const Image<std::int32_t> columns = column_distances(sites, w.y0, w.y1);
    Envelope envelope(w.width(), 1);
    for (std::int32_t y = w.y0; y < w.y1; ++y) {
        envelope.clear();
        push_columns(columns.row(y), 0, w.width(), envelope);
        std::int64_t* out = result.row(y);
        envelope.for_each_arc([&](const Envelope::Arc& arc, std::int32_t begin, std::int32_t end) {
            for (std::int32_t x = begin; x < end; ++x) out[x] = std::int64_t(x - arc.x) * (x - arc.x) + arc.f;
        });
    }
    return result;
}

std::vector<std::int64_t> squared_distances(const Mask& sites, std::span<const Vec2i> queries) {
    std::vector<std::int64_t> result(queries.size(), kFar);
    if (queries.empty() || sites.empty()) return result;
    const Rect w = sites.window();

    // Queries by row, then by column, as the envelope of a row is walked.
    std::vector<std::int32_t> order(queries.size());
    std::iota(order.begin(), order.end(), 0);
    const auto query = [&](std::int32_t i) { return queries[std::size_t(i)]; };
    const auto before = [&](std::int32_t a, std::int32_t b) {
        return query(a).y != query(b).y ? query(a).y < query(b).y : query(a).x < query(b).x;
    };
    if (!std::is_sorted(order.begin(), order.end(), before)) std::sort(order.begin(), order.end(), before);
    const Image<std::int32_t> columns = column_distances(sites, query(order.front()).y, query(order.back()).y + 1);

    Envelope envelope(w.width(), 1);
    for (auto row = order.begin(); row != order.end();) {
        const std::int32_t y = query(*row).y;
        const auto row_end = std::find_if(row, order.end(), [&](std::int32_t i) { return query(i).y != y; });
        // The nearest site is at most as far as the nearest one in the query's own column.
        const std::int32_t* column = columns.row(y);
        std::int32_t begin = w.width(), end = 0;
        for (auto i = row; i != row_end; ++i) {
            const std::int32_t x = query(*i).x - w.x0, reach = std::min(column[x], w.width());
            begin = std::min(begin, std::max(x - reach, 0));
            end = std::max(end, std::min(x + reach + 1, w.width()));
        }
        envelope.clear();
        push_columns(column, begin, end, envelope);
        envelope.for_each_arc([&](const Envelope::Arc& arc, std::int32_t, std::int32_t arc_end) {
            for (; row != row_end && query(*row).x - w.x0 < arc_end; ++row) {
                const std::int64_t dx = query(*row).x - w.x0 - arc.x;
                result[std::size_t(*row)] = dx * dx + arc.f;
            }
        });
        row = row_end;
    }
    return result;
}

Image<float> signed_distance(const Mask& mask) {
    const Image<std::int64_t> to_mask = distance_transform(mask), to_outside = distance_transform(complement(mask));
    Image<float> result(mask.window());
    for (std::size_t i = 0; i < mask.pixels().size(); ++i) {
        const bool inside = mask.pixels()[i] != 0;
        const std::int64_t d2 = (inside ? to_outside : to_mask).pixels()[i];
        const float d = d2 == kFar ? kNoBorder : float(std::sqrt(double(d2)) - 0.5);
        result.pixels()[i] = inside ? -d : d;
    }
    return result;
}

PowerDistance power_distance_transform(Rect window, std::span<const PowerSite> sites, std::int64_t scale,
                                       std::int64_t limit) {
    PowerDistance result{Image<std::int64_t>(window, kFar), Image<std::int32_t>(window, -1)};
    if (window.empty() || sites.empty()) return result;
    const std::int32_t width = window.width(), height = window.height();
    // The farthest offset, within the window, at which scale * offset^2 + f is still wanted.
    const std::int64_t size = std::max(width, height);
    const auto reach = [&](std::int64_t f) {
        const std::int64_t most = std::min((limit - f) / scale, size * size);
        return std::int32_t(integer_sqrt(most));
    };

    // Columns: the site of lowest value in the same column, of those within the limit. Stored
    // column after column; reading it by rows below touches a cache line for sixteen rows.
    std::vector<std::int32_t> in_column(std::size_t(width) * std::size_t(height), -1);
    const Columns columns = sort_into_columns(window, sites);
    Envelope down(height, scale);
    for (std::int32_t x = 0; x < width; ++x) {
        down.clear();
        std::int32_t last_y = -1;
        for (std::size_t i = columns.begin[std::size_t(x)]; i < columns.begin[std::size_t(x) + 1]; ++i) {
            const std::int32_t site = columns.sites[i];
            const std::int32_t y = sites[std::size_t(site)].center.y - window.y0;
            if (y != last_y) down.push(y, -sites[std::size_t(site)].weight, site);
            last_y = y;
        }
        std::int32_t* out = in_column.data() + std::size_t(x) * std::size_t(height);
        down.for_each_arc([&](const Envelope::Arc& arc, std::int32_t begin, std::int32_t end) {
            if (arc.f > limit) return;
            const std::int32_t r = reach(arc.f);
            begin = std::max(begin, arc.x - r), end = std::min(end, arc.x + r + 1);
            if (begin < end) std::fill(out + begin, out + end, arc.id);
        });
    }

    // Rows: the lowest of the columns' parabolas.
    Envelope across(width, scale);
    for (std::int32_t y = 0; y < height; ++y) {
        across.clear();
        for (std::int32_t x = 0; x < width; ++x) {
            const std::int32_t site = in_column[std::size_t(x) * std::size_t(height) + std::size_t(y)];
            if (site < 0) continue;
            const PowerSite& s = sites[std::size_t(site)];
            const std::int64_t dy = y + window.y0 - s.center.y;
            across.push(x, scale * dy * dy - s.weight, site);
        }
        std::int64_t* value = result.value.row(y + window.y0);
        std::int32_t* nearest = result.nearest.row(y + window.y0);
        across.for_each_arc([&](const Envelope::Arc& arc, std::int32_t begin, std::int32_t end) {
            const std::int32_t r = reach(arc.f);
            begin = std::max(begin, arc.x - r), end = std::min(end, arc.x + r + 1);
            for (std::int32_t x = begin; x < end; ++x) {
                value[x] = scale * (std::int64_t(x - arc.x) * (x - arc.x)) + arc.f;
                nearest[x] = arc.id;
            }
        });
    }
    return result;
}

} // namespace porthole
