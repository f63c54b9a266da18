#include "porthole/scene/pierce.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <tuple>
#include <utility>

namespace porthole {

namespace {

/// Which side of the line from a to b the point p lies on: twice the area of a, b, p.
struct Side {
    double area = 0;
    int sign = 0; ///< never 0 unless a = b
};

Side side_of(Vec2d a, Vec2d b, Vec2d p) {
    // In one order for both triangles at an edge, so that they get the same number.
    const bool swapped = std::pair(b.x, b.y) < std::pair(a.x, a.y);
    if (swapped) std::swap(a, b);
    const Vec2d d = b - a;
    const double area = d.x * (p.y - a.y) - d.y * (p.x - a.x);
    int sign = (area > 0) - (area < 0);
    // On the line: as if p were moved along x by next to nothing, and along y by much less.
    if (sign == 0) sign = d.y != 0 ? (d.y < 0 ? 1 : -1) : (d.x > 0) - (d.x < 0);
    return swapped ? Side{-area, -sign} : Side{area, sign};
}

/// Points of a plane in square cells.
class PointGrid {
public:
    explicit PointGrid(std::vector<Vec2d> points) : points_(std::move(points)) {
        for (const Vec2d p : points_) {
            lower_ = {std::min(lower_.x, p.x), std::min(lower_.y, p.y)};
            upper_ = {std::max(upper_.x, p.x), std::max(upper_.y, p.y)};
        }
        cells_ = std::max(1, int(std::sqrt(double(points_.size()))));
        begin_.assign(std::size_t(cells_) * std::size_t(cells_) + 1, 0);
        for (const Vec2d p : points_) ++begin_[cell_of(p) + 1];
        std::partial_sum(begin_.begin(), begin_.end(), begin_.begin());
        in_order_.resize(points_.size());
        std::vector<std::uint32_t> next(begin_.begin(), begin_.end() - 1);
        for (std::uint32_t i = 0; i < points_.size(); ++i) in_order_[next[cell_of(points_[i])]++] = i;
    }

    [[nodiscard]] Vec2d point(std::uint32_t i) const { return points_[i]; }

    /// Calls visit(index) for the points in the cells that the box touches.
    template <typename Visit> void for_each_near(Vec2d lower, Vec2d upper, Visit&& visit) const {
        if (lower.x > upper_.x || lower.y > upper_.y || upper.x < lower_.x || upper.y < lower_.y) return;
        const int x0 = column(lower.x, lower_.x, upper_.x), x1 = column(upper.x, lower_.x, upper_.x);
        const int y0 = column(lower.y, lower_.y, upper_.y), y1 = column(upper.y, lower_.y, upper_.y);
        for (int y = y0; y <= y1; ++y)
            for (std::uint32_t i = begin_[index(x0, y)]; i < begin_[index(x1, y) + 1]; ++i) visit(in_order_[i]);
    }

private:
    [[nodiscard]] int column(double v, double lower, double upper) const {
        const double share = upper > lower ? (v - lower) / (upper - lower) : 0.0;
        return std::clamp(int(std::clamp(share, 0.0, 1.0) * cells_), 0, cells_ - 1);
    }
    [[nodiscard]] std::size_t index(int x, int y) const {
        return std::size_t(y) * std::size_t(cells_) + std::size_t(x);
    }
    [[nodiscard]] std::size_t cell_of(Vec2d p) const {
        return index(column(p.x, lower_.x, upper_.x), column(p.y, lower_.y, upper_.y));
    }

    std::vector<Vec2d> points_;
    Vec2d lower_{std::numeric_limits<double>::infinity(), std::numeric_limits<double>::infinity()};
    Vec2d upper_{-std::numeric_limits<double>::infinity(), -std::numeric_limits<double>::infinity()};
    int cells_ = 1;
    std::vector<std::uint32_t> begin_, in_order_;
};

/// By line, then along it. Linear when lines have few piercings each.
std::vector<Piercing> sorted(const std::vector<Piercing>& piercings, std::size_t lines) {
    std::vector<std::size_t> end(lines + 1, 0); // counts, then starts, then ends
    for (const Piercing& p : piercings) ++end[p.line + 1];
    std::partial_sum(end.begin(), end.end(), end.begin());
    std::vector<Piercing> out(piercings.size());
    for (const Piercing& p : piercings) out[end[p.line]++] = p;
    for (std::size_t line = 0, begin = 0; line < lines; begin = end[line++])
        std::sort(out.begin() + std::ptrdiff_t(begin), out.begin() + std::ptrdiff_t(end[line]),
                  [](const Piercing& l, const Piercing& r) {
                      return std::tie(l.along, l.triangle) < std::tie(r.along, r.triangle);
                  });
    return out;
}

/// What a piercing costs, to keep and to sort, in pairs that are only looked at.
constexpr std::uint64_t kPairsPerPiercing = 8;

} // namespace

std::optional<std::vector<Piercing>> find_piercings(const Mesh& mesh, std::span<const std::uint8_t> wanted,
                                                    Vec3d direction, std::span<const Vec3d> points,
                                                    std::uint64_t budget, double from) {
    // Along an axis the frame holds zeros and ones only, and projecting rounds nothing.
    const Vec3d u =
        normalize(std::abs(direction.y) < 0.6 ? cross(direction, Vec3d{0, 1, 0}) : cross(direction, Vec3d{1, 0, 0}));
    const Vec3d v = cross(direction, u);
    const auto project = [&](Vec3d p) { return Vec2d{dot(p, u), dot(p, v)}; };

    std::vector<Vec2d> projected(points.size());
    std::ranges::transform(points, projected.begin(), project);
    const PointGrid grid(std::move(projected));

    std::vector<Piercing> out;
    std::uint64_t looked_at = 0;
    for (std::uint32_t i = 0; i < mesh.triangles.size(); ++i) {
        if (!wanted.empty() && !wanted[i]) continue;
        const Vec3u& t = mesh.triangles[i];
        const Vec3d corner[3] = {Vec3d(mesh.positions[t.x]), Vec3d(mesh.positions[t.y]), Vec3d(mesh.positions[t.z])};
        const Vec2d a = project(corner[0]), b = project(corner[1]), c = project(corner[2]);
        const Vec2d lower{std::min({a.x, b.x, c.x}), std::min({a.y, b.y, c.y})};
        const Vec2d upper{std::max({a.x, b.x, c.x}), std::max({a.y, b.y, c.y})};
        grid.for_each_near(lower, upper, [&](std::uint32_t line) {
            ++looked_at;
            const Vec2d p = grid.point(line);
            if (p.x < lower.x || p.x > upper.x || p.y < lower.y || p.y > upper.y) return;
            const Side sc = side_of(a, b, p), sa = side_of(b, c, p);
            if (sc.sign != sa.sign) return;
            const Side sb = side_of(c, a, p);
            if (sb.sign != sc.sign || sc.sign == 0) return;
            const double sum = sa.area + sb.area + sc.area;
            const double wa = sum != 0 ? sa.area / sum : 1.0 / 3, wb = sum != 0 ? sb.area / sum : 1.0 / 3;
            const Vec3d q = points[line];
            const double along = wa * dot(corner[0] - q, direction) + wb * dot(corner[1] - q, direction) +
                                 (1 - wa - wb) * dot(corner[2] - q, direction);
            if (along < from) return;
            looked_at += kPairsPerPiercing;
            // Counter-clockwise as seen against the direction: the normal points along it.
            out.push_back({line, i, sc.sign < 0, along});
        });
        if (looked_at > budget) return std::nullopt;
    }
    return sorted(out, points.size());
}

} // namespace porthole
