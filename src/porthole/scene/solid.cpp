#include "porthole/scene/solid.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <numeric>
#include <optional>
#include <random>

#include "porthole/scene/pierce.h"

namespace porthole {

namespace {

constexpr std::uint64_t kPairsPerTriangle = 32, kLeastPairs = 20'000'000;
constexpr std::size_t kMostSamples = 200'000; ///< points that nesting looks at
constexpr std::size_t kSamplesPerPiece = 7;
constexpr std::uint32_t kNoTriangle = 0xFFFFFFFFu;
/// Of the lines that nesting looks along: no axis, for models repeat things along axes.
constexpr Vec3d kNestingDirections[] = {{0.61, 0.74, 0.28}, {-0.81, 0.29, 0.51}, {0.19, -0.62, 0.76}};
/// Enough for closed pieces, on which lines never fail.
constexpr std::span<const Vec3d> kOneDirection(kNestingDirections, 1);

std::uint64_t pair_budget(const Mesh& mesh) {
    return std::max(kLeastPairs, kPairsPerTriangle * std::uint64_t(mesh.triangles.size()));
}

struct Corners {
    Vec3d a, b, c;
    [[nodiscard]] Vec3d normal() const { return cross(b - a, c - a); } ///< twice the area long
    [[nodiscard]] Vec3d center() const { return (a + b + c) * (1.0 / 3); }
};

Corners corners_of(const Mesh& mesh, std::uint32_t triangle) {
    const Vec3u& t = mesh.triangles[triangle];
    return {Vec3d(mesh.positions[t.x]), Vec3d(mesh.positions[t.y]), Vec3d(mesh.positions[t.z])};
}

/// Measures of a piece.
struct Measures {
    double volume = 0, area = 0; ///< volume negative if it is wound inward
    Bounds3d box;
    Vec3d origin; ///< some point of it, from which volumes are taken
    /// Triangles to take samples from: the largest, then those that reach farthest down and up x, y and z.
    std::uint32_t sample[kSamplesPerPiece];
    double reach[kSamplesPerPiece];

    Measures() {
        std::fill(std::begin(sample), std::end(sample), kNoTriangle);
        std::fill(std::begin(reach), std::end(reach), -std::numeric_limits<double>::infinity());
    }
    void offer(std::size_t slot, double value, std::uint32_t triangle) {
        if (value > reach[slot]) reach[slot] = value, sample[slot] = triangle;
    }
    /// A length under which float coordinates of this size hold nothing, metres.
    [[nodiscard]] double least_length() const {
        const double largest = std::max(length(box.lower), length(box.upper));
        return std::max(1e-6 * box.diagonal(), 4e-7 * largest);
    }
    /// A closed piece without room inside.
    [[nodiscard]] bool flat() const { return sample[0] == kNoTriangle || !(std::abs(volume) > least_length() * area); }
    /// An open piece that no ray meets.
    [[nodiscard]] bool needle() const { return !(area > least_length() * box.diagonal()); }
};

std::vector<Measures> measure(const Mesh& mesh, const Pieces& pieces) {
    std::vector<Measures> out(pieces.kind.size());
    for (std::uint32_t i = 0; i < mesh.triangles.size(); ++i) {
        if (pieces.of_triangle[i] == kNoPiece) continue;
        Measures& m = out[pieces.of_triangle[i]];
        const Corners t = corners_of(mesh, i);
        if (m.box.empty()) m.origin = t.a;
        for (const Vec3d& p : {t.a, t.b, t.c}) m.box.extend(p);
        const Vec3d normal = t.normal();
        const double twice_area = length(normal);
        m.area += 0.5 * twice_area;
        m.volume += dot(t.a - m.origin, normal) / 6;
        // Of needles it is uncertain where they face.
        const Vec3d ab = t.b - t.a, bc = t.c - t.b, ca = t.a - t.c;
        if (!(twice_area > 1e-6 * std::max({dot(ab, ab), dot(bc, bc), dot(ca, ca)}))) continue;
        m.offer(0, twice_area, i);
        const Vec3d center = t.center();
        for (int axis = 0; axis < 3; ++axis) {
            m.offer(std::size_t(1 + 2 * axis), -center[axis], i);
            m.offer(std::size_t(2 + 2 * axis), center[axis], i);
        }
    }
    return out;
}

/// Strictly: nothing touches.
bool lies_in(const Bounds3d& inner, const Bounds3d& outer) {
    for (int axis = 0; axis < 3; ++axis)
        if (!(inner.lower[axis] > outer.lower[axis] && inner.upper[axis] < outer.upper[axis])) return false;
    return true;
}

bool may_lie_in(const Bounds3d& inner, const Bounds3d& outer) {
    for (int axis = 0; axis < 3; ++axis)
        if (inner.lower[axis] < outer.lower[axis] || inner.upper[axis] > outer.upper[axis]) return false;
    return true;
}

/// What find_solid() makes of the pieces.
enum class Role : std::uint8_t {
    bounding, ///< closed, with a volume inside
    open,
    ignored ///< bounds nothing and opens nothing: copies, flat sheets, needles
};

/// Calls body(value, how many) for the runs of equal values.
template <typename Body> void for_each_run(std::span<const std::uint32_t> values, Body&& body) {
    for (std::size_t i = 0; i < values.size();) {
        std::size_t end = i;
        while (end < values.size() && values[end] == values[i]) ++end;
        body(values[i], end - i);
        i = end;
    }
}

/// A point just outside a closed piece, next to the triangle of a sample slot: outside, so that
/// of pieces that touch or coincide none lies in the other.
Vec3d sample_point(const Mesh& mesh, const Measures& m, std::size_t slot) {
    const Corners t = corners_of(mesh, m.sample[slot]);
    Vec3d p = t.center();
    if (slot > 0) {
        const int axis = int(slot - 1) / 2;
        const double sign = slot % 2 == 1 ? -1 : 1;
        const Vec3d farthest =
            std::max({t.a, t.b, t.c}, [&](const Vec3d& l, const Vec3d& r) { return sign * l[axis] < sign * r[axis]; });
        p = lerp(p, farthest, 0.6);
    }
    return p + normalize(t.normal()) * std::copysign(5 * m.least_length(), m.volume);
}

/// Around each point the labels whose triangles enclose it: those that, in most of the
/// directions, the half line from it leaves more or less often than it enters them. Nothing if
/// that is too much work.
/// @param label  by triangle; kNoPiece: not looked at.
std::optional<std::vector<std::vector<std::uint32_t>>> find_enclosing(const Mesh& mesh,
                                                                      const std::vector<std::uint32_t>& label,
                                                                      std::span<const Vec3d> points,
                                                                      std::span<const Vec3d> directions) {
    std::vector<std::uint8_t> wanted(label.size());
    std::ranges::transform(label, wanted.begin(), [](std::uint32_t l) { return std::uint8_t(l != kNoPiece); });
    std::vector<std::vector<std::uint32_t>> out(points.size());
    std::vector<std::pair<std::uint32_t, int>> crossed; // label, sign
    for (const Vec3d direction : directions) {
        const auto piercings = find_piercings(mesh, wanted, normalize(direction), points, pair_budget(mesh), 0);
        if (!piercings) return std::nullopt;
        for (std::size_t i = 0; i < piercings->size();) {
            const std::uint32_t line = (*piercings)[i].line;
            crossed.clear();
            for (; i < piercings->size() && (*piercings)[i].line == line; ++i)
                crossed.emplace_back(label[(*piercings)[i].triangle], (*piercings)[i].entering ? -1 : 1);
            std::ranges::sort(crossed);
            for (std::size_t k = 0; k < crossed.size();) {
                const std::uint32_t l = crossed[k].first;
                int winding = 0;
                for (; k < crossed.size() && crossed[k].first == l; ++k) winding += crossed[k].second;
                if (winding != 0) out[line].push_back(l);
            }
        }
    }
    if (directions.size() == 1) return out;
    for (std::vector<std::uint32_t>& around : out) {
        std::ranges::sort(around);
        std::vector<std::uint32_t> kept;
        for_each_run(around, [&](std::uint32_t l, std::size_t times) {
            if (2 * times > directions.size()) kept.push_back(l);
        });
        around = std::move(kept);
    }
    return out;
}

/// Sample points of the chosen pieces, one piece after the other.
struct Samples {
    std::vector<Vec3d> points;
    std::vector<std::uint32_t> piece; ///< by point
};

/// @return nothing if there are more pieces than points to look at.
std::optional<Samples> take_samples(const Mesh& mesh, const std::vector<Measures>& measures,
                                    const std::vector<std::uint32_t>& chosen) {
    if (chosen.size() > kMostSamples) return std::nullopt;
    const std::size_t slots =
        std::clamp<std::size_t>(kMostSamples / std::max<std::size_t>(1, chosen.size()), 1, kSamplesPerPiece);
    Samples out;
    for (const std::uint32_t i : chosen)
        for (std::size_t slot = 0; slot < slots; ++slot) {
            out.points.push_back(sample_point(mesh, measures[i], slot));
            out.piece.push_back(i);
        }
    return out;
}

/// By triangle its piece, if that bounds a volume.
std::vector<std::uint32_t> bounding_labels(const Pieces& pieces, const std::vector<Role>& role) {
    std::vector<std::uint32_t> label = pieces.of_triangle;
    for (std::uint32_t& l : label)
        if (l != kNoPiece && role[l] != Role::bounding) l = kNoPiece;
    return label;
}

/// How many other bounding pieces each of them lies in, by piece; nothing if that is too much
/// work. A piece lies in another if its box and all its samples do.
/// @param directions  in which to look; more than one for pieces that edges do not close.
std::optional<std::vector<std::uint32_t>> find_nesting(const Mesh& mesh, const Pieces& pieces,
                                                       const std::vector<Measures>& measures,
                                                       const std::vector<Role>& role,
                                                       std::span<const Vec3d> directions) {
    std::vector<std::uint32_t> depth(role.size(), 0), chosen;
    for (std::uint32_t i = 0; i < role.size(); ++i)
        if (role[i] == Role::bounding) chosen.push_back(i);
    if (chosen.size() < 2) return depth;
    const std::optional<Samples> samples = take_samples(mesh, measures, chosen);
    if (!samples) return std::nullopt;
    const auto enclosing = find_enclosing(mesh, bounding_labels(pieces, role), samples->points, directions);
    if (!enclosing) return std::nullopt;

    std::vector<std::uint32_t> around; // all samples of one piece
    for (std::size_t i = 0; i < samples->points.size();) {
        const std::uint32_t piece = samples->piece[i];
        around.clear();
        std::size_t own = 0;
        for (; i < samples->points.size() && samples->piece[i] == piece; ++i, ++own)
            around.insert(around.end(), (*enclosing)[i].begin(), (*enclosing)[i].end());
        std::ranges::sort(around);
        for_each_run(around, [&](std::uint32_t other, std::size_t times) {
            if (other != piece && times == own && lies_in(measures[piece].box, measures[other].box)) ++depth[piece];
        });
    }
    return depth;
}

/// How the lines of the ray test run through a set of triangles, each taken as outward.
struct Balance {
    std::uint32_t lines = 0;        ///< that pierce any
    std::uint32_t as_wound = 0;     ///< enter as often as they leave, and never leave before
    std::uint32_t turned = 0;       ///< the same with every triangle turned around
    std::uint32_t single_wound = 0; ///< as_wound, and never inside more than once
    std::uint32_t single_turned = 0;
};

constexpr std::uint32_t kTestLines = 300, kTestDirections = 6, kLeastLines = 8;
/// Rounds of so many lines when one leaves it open on which side of 94 % the share is.
constexpr int kTestRounds = 5;

bool nearly_all(std::uint32_t part, std::uint32_t lines) { return lines >= kLeastLines && 100 * part >= 94 * lines; }

void count_line(std::span<const Piercing> line, double same_place, Balance& out) {
    if (line.empty()) return;
    int depth = 0, lowest = 0, highest = 0;
    for (std::size_t i = 0; i < line.size();) {
        // Faces that overlap a little at their common border, or lie on each other, count once
        // for each way; bodies that touch do not pass through the outside.
        bool enters = false, leaves = false;
        const double place = line[i].along;
        for (; i < line.size() && line[i].along - place <= same_place; ++i) (line[i].entering ? enters : leaves) = true;
        depth += int(enters) - int(leaves);
        lowest = std::min(lowest, depth), highest = std::max(highest, depth);
    }
    ++out.lines;
    if (depth != 0) return;
    out.as_wound += lowest == 0;
    out.turned += highest == 0;
    out.single_wound += lowest == 0 && highest <= 1;
    out.single_turned += highest == 0 && lowest >= -1;
}

/// What lines through points of the open pieces say.
struct RayTest {
    Balance open, whole; ///< of the open pieces alone, and of the bounding ones with them
    double within = 0;   ///< share of the points that lie in an odd number of bounding pieces
};

/// A point of the surface and the normal there, by the winding.
struct SurfacePoint {
    Vec3d position, normal;
};

/// kTestLines points spread evenly over the chosen triangles; fewer only if those have no area.
template <typename Random>
std::vector<SurfacePoint> spread_points(const Mesh& mesh, const std::vector<std::uint8_t>& chosen, Random&& unit) {
    double area = 0;
    for (std::uint32_t i = 0; i < mesh.triangles.size(); ++i)
        if (chosen[i]) area += length(corners_of(mesh, i).normal());
    std::vector<SurfacePoint> out;
    if (!(area > 0) || !std::isfinite(area)) return out;
    double below = 0, next = unit() / kTestLines * area;
    for (std::uint32_t i = 0; i < mesh.triangles.size() && out.size() < kTestLines; ++i) {
        if (!chosen[i]) continue;
        const Corners t = corners_of(mesh, i);
        below += length(t.normal());
        while (out.size() < kTestLines && next < below) {
            const double s = std::sqrt(unit()), r = unit();
            out.push_back({t.a * (1 - s) + t.b * (s * (1 - r)) + t.c * (s * r), normalize(t.normal())});
            next = (double(out.size()) + unit()) / kTestLines * area;
        }
    }
    return out;
}

std::optional<RayTest> test_by_rays(const Mesh& mesh, const Pieces& pieces, const std::vector<Role>& role) {
    std::vector<std::uint8_t> open(mesh.triangles.size(), 0), whole(mesh.triangles.size(), 0);
    for (std::size_t t = 0; t < open.size(); ++t) {
        const std::uint32_t piece = pieces.of_triangle[t];
        if (piece == kNoPiece) continue;
        open[t] = role[piece] == Role::open;
        whole[t] = role[piece] != Role::ignored;
    }
    std::mt19937 random(20261122);
    const auto unit = [&] { return (double(random()) + 0.5) * 0x1p-32; };
    std::vector<SurfacePoint> points;
    RayTest out;
    const double same_place = 1e-6 * mesh.bounds.diagonal();
    std::vector<Vec3d> through;
    std::vector<Piercing> part;
    for (int round = 0; round < kTestRounds; ++round) {
        points = spread_points(mesh, open, unit);
        for (std::size_t d = 0; d < kTestDirections; ++d) {
            Vec3d direction;
            do direction = Vec3d{unit(), unit(), unit()} * 2.0 - Vec3d{1, 1, 1};
            while (dot(direction, direction) > 1 || dot(direction, direction) < 0.01);
            through.clear();
            for (std::size_t i = d; i < points.size(); i += kTestDirections) through.push_back(points[i].position);
            const auto piercings = find_piercings(mesh, whole, normalize(direction), through, pair_budget(mesh));
            if (!piercings) return std::nullopt;
            for (std::size_t begin = 0; begin < piercings->size();) {
                std::size_t end = begin;
                part.clear();
                for (; end < piercings->size() && (*piercings)[end].line == (*piercings)[begin].line; ++end)
                    if (open[(*piercings)[end].triangle]) part.push_back((*piercings)[end]);
                count_line(std::span(*piercings).subspan(begin, end - begin), same_place, out.whole);
                count_line(part, same_place, out.open);
                begin = end;
            }
        }
        const std::uint32_t best = std::max(out.open.as_wound, out.open.turned);
        if (100 * best < 85 * out.open.lines || 100 * best >= 99 * out.open.lines) break;
    }

    if (std::ranges::find(role, Role::bounding) != role.end()) {
        through.clear();
        for (const SurfacePoint& p : points) through.push_back(p.position + p.normal * (5 * same_place));
        const auto enclosing = find_enclosing(mesh, bounding_labels(pieces, role), through, kOneDirection);
        if (!enclosing) return std::nullopt;
        const auto odd = std::ranges::count_if(*enclosing, [](const auto& around) { return around.size() % 2 == 1; });
        out.within = double(odd) / double(points.size());
    }
    return out;
}

/// Which bounding pieces lie within the open ones taken together, by piece: all their samples
/// do, in most of three directions. Nothing if that is too much work.
std::optional<std::vector<std::uint8_t>> find_within_open(const Mesh& mesh, const Pieces& pieces,
                                                          const std::vector<Measures>& measures,
                                                          const std::vector<Role>& role,
                                                          const std::vector<std::uint32_t>& chosen) {
    std::vector<std::uint8_t> within(role.size(), 0);
    if (chosen.empty()) return within;
    const std::optional<Samples> samples = take_samples(mesh, measures, chosen);
    if (!samples) return std::nullopt;
    std::vector<std::uint32_t> label = pieces.of_triangle;
    for (std::uint32_t& l : label)
        if (l != kNoPiece) l = role[l] == Role::open ? 0 : kNoPiece;
    const auto enclosing = find_enclosing(mesh, label, samples->points, kNestingDirections);
    if (!enclosing) return std::nullopt;
    for (const std::uint32_t piece : chosen) within[piece] = 1;
    for (std::size_t i = 0; i < enclosing->size(); ++i)
        if ((*enclosing)[i].empty()) within[samples->piece[i]] = 0;
    return within;
}

/// Tests the open pieces one by one. Those are surfaces with pinholes, not faces of a solid,
/// when each of them closes by rays alone: then they may nest as closed ones do.
/// @return the lines that speak for it, of all pieces; nothing unless all pieces close.
///         `measures` then has volumes of the sign that the lines say.
std::optional<Balance> test_each_by_rays(const Mesh& mesh, const Pieces& pieces, const std::vector<Role>& role,
                                         std::vector<Measures>& measures) {
    constexpr std::size_t kMostPieces = 64;
    std::vector<std::uint32_t> chosen;
    for (std::uint32_t i = 0; i < role.size(); ++i)
        if (role[i] == Role::open) chosen.push_back(i);
    if (chosen.size() > kMostPieces) return std::nullopt;
    Balance all;
    std::vector<bool> outward;
    for (const std::uint32_t piece : chosen) {
        std::vector<Role> alone(role.size(), Role::ignored);
        alone[piece] = Role::open;
        const std::optional<RayTest> test = test_by_rays(mesh, pieces, alone);
        if (!test) return std::nullopt;
        const Balance& b = test->open;
        if (!nearly_all(std::max(b.as_wound, b.turned), b.lines) || measures[piece].flat()) return std::nullopt;
        outward.push_back(b.as_wound >= b.turned);
        all.lines += b.lines, all.as_wound += std::max(b.as_wound, b.turned);
    }
    for (std::size_t i = 0; i < chosen.size(); ++i)
        measures[chosen[i]].volume = std::copysign(measures[chosen[i]].volume, outward[i] ? 1.0 : -1.0);
    return all;
}

TriangleSide turned(TriangleSide side) {
    return side == TriangleSide::open      ? side
           : side == TriangleSide::outward ? TriangleSide::inward
                                           : TriangleSide::outward;
}

/// Sides of the bounding pieces by their nesting, open for the others and if it is too much work.
std::vector<TriangleSide> sides_by_nesting(const Mesh& mesh, const Pieces& pieces,
                                           const std::vector<Measures>& measures, const std::vector<Role>& role,
                                           std::span<const Vec3d> directions) {
    std::vector<TriangleSide> side(role.size(), TriangleSide::open);
    if (const auto depth = find_nesting(mesh, pieces, measures, role, directions))
        for (std::size_t i = 0; i < role.size(); ++i)
            if (role[i] == Role::bounding)
                side[i] =
                    (measures[i].volume > 0) == ((*depth)[i] % 2 == 0) ? TriangleSide::outward : TriangleSide::inward;
    return side;
}

/// Judges the pieces that edges leave open, and those they close beside them.
/// @param side  by piece; in: bounding ones by nesting, others open. Out: all.
void judge_open_pieces(const Mesh& mesh, const Pieces& pieces, std::vector<Measures>& measures,
                       const std::vector<Role>& role, std::vector<TriangleSide>& side, MeshSolid& out) {
    Bounds3d open_box;
    for (std::size_t i = 0; i < role.size(); ++i)
        if (role[i] == Role::open) open_box.extend(measures[i].box);
    std::vector<std::uint32_t> in_box; // bounding pieces that the open ones may enclose
    bool mixed = false;
    const bool several = std::ranges::count(role, Role::ignored) + 1 < std::ptrdiff_t(role.size());
    for (std::uint32_t i = 0; i < role.size(); ++i) {
        if (side[i] == TriangleSide::open) continue;
        mixed = true;
        if (may_lie_in(measures[i].box, open_box)) in_box.push_back(i);
    }
    const std::optional<RayTest> test = test_by_rays(mesh, pieces, role);
    const auto close = [&](const Balance& balance, std::uint32_t wound, std::uint32_t turned_around) {
        out.lines = balance.lines, out.balanced_lines = std::max(wound, turned_around);
        if (!nearly_all(out.balanced_lines, out.lines)) return false;
        out.by = ClosedBy::rays;
        return true;
    };

    if (test) {
        const Balance& b = test->open;
        const std::uint32_t best = std::max(b.as_wound, b.turned), single = std::max(b.single_wound, b.single_turned);
        const bool together = nearly_all(best, b.lines);
        // Inside of something twice, or not balanced: bodies that overlap, or skins in each other?
        if (several && (!together || single < best || mixed))
            if (const auto each = test_each_by_rays(mesh, pieces, role, measures)) {
                close(*each, each->as_wound, 0);
                std::vector<Role> all = role;
                std::ranges::replace(all, Role::open, Role::bounding);
                side = sides_by_nesting(mesh, pieces, measures, all, kNestingDirections);
                return;
            }
        // They make sense together, wholly inside or outside the material of the others.
        const bool apart = test->within <= 0.02 || test->within >= 0.98;
        const bool one_layer = 100 * single >= 80 * b.lines;
        if (together && apart && one_layer)
            if (const auto within = find_within_open(mesh, pieces, measures, role, in_box)) {
                close(b, b.as_wound, b.turned);
                const bool wound = b.as_wound >= b.turned, cavity = test->within > 0.5;
                for (std::size_t i = 0; i < role.size(); ++i) {
                    if (role[i] == Role::open) side[i] = wound != cavity ? TriangleSide::outward : TriangleSide::inward;
                    if ((*within)[i]) side[i] = turned(side[i]);
                }
                return;
            }
        // The winding of the file makes sense of the whole, as when some of them line cavities of the others.
        const Balance& w = test->whole;
        if (mixed && close(w, w.single_wound, w.single_turned)) {
            const bool wound = w.single_wound >= w.single_turned;
            for (std::size_t i = 0; i < role.size(); ++i)
                if (role[i] != Role::ignored) side[i] = wound ? TriangleSide::outward : TriangleSide::inward;
            return;
        }
        out.lines = b.lines, out.balanced_lines = best;
    }
    out.by = ClosedBy::nothing;
    for (const std::uint32_t i : in_box) side[i] = TriangleSide::open;
}

} // namespace

MeshSolid find_solid(const Mesh& mesh) {
    // Primitives bound material by what they are.
    if (!mesh.primitives.empty())
        return {.closed = true,
                .by = ClosedBy::edges,
                .uniform = TriangleSide::outward,
                .components = 1,
                .closed_components = 1,
                .edges = {.closed = true}};
    const Pieces pieces = find_pieces(mesh);
    const std::size_t count = pieces.kind.size();
    std::vector<Measures> measures = measure(mesh, pieces);
    std::vector<Role> role(count, Role::ignored);
    for (std::size_t i = 0; i < count; ++i) {
        if (pieces.kind[i] == PieceKind::closed && !measures[i].flat()) role[i] = Role::bounding;
        if (pieces.kind[i] == PieceKind::open && !measures[i].needle()) role[i] = Role::open;
    }

    MeshSolid out;
    out.edges = pieces.edges;
    std::vector<TriangleSide> side = sides_by_nesting(mesh, pieces, measures, role, kOneDirection);
    if (std::ranges::find(role, Role::open) != role.end()) judge_open_pieces(mesh, pieces, measures, role, side, out);

    for (std::size_t i = 0; i < count; ++i) {
        if (role[i] == Role::ignored) continue;
        ++out.components;
        out.closed_components += side[i] != TriangleSide::open;
        out.flipped_components += side[i] == TriangleSide::inward;
    }
    out.closed = out.components > 0 && out.closed_components == out.components;
    if (!out.closed)
        out.by = ClosedBy::nothing;
    else if (out.by != ClosedBy::rays)
        out.by = ClosedBy::edges;

    if (std::ranges::adjacent_find(side, std::not_equal_to{}) == side.end()) {
        if (!side.empty()) out.uniform = side[0];
    } else {
        out.side.resize(mesh.triangles.size(), TriangleSide::open);
        for (std::size_t t = 0; t < out.side.size(); ++t)
            if (pieces.of_triangle[t] != kNoPiece) out.side[t] = side[pieces.of_triangle[t]];
    }
    return out;
}

std::vector<MeshSolid> find_solids(const Scene& scene, std::span<const std::uint8_t> wanted, const Control& control) {
    std::vector<MeshSolid> out(scene.meshes.size());
    parallel_for(scene.meshes.size(), control, [&](std::size_t i) {
        if (wanted.empty() || wanted[i]) out[i] = find_solid(scene.meshes[i]);
    });
    return out;
}

std::vector<std::uint8_t> meshes_of(const Scene& scene, std::span<const PartId> parts) {
    std::vector<std::uint8_t> out(scene.meshes.size(), 0);
    for (const PartId part : parts) out[scene.parts[index(part)].mesh] = 1;
    return out;
}

} // namespace porthole
