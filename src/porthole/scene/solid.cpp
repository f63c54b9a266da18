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
/// Volume over area and diagonal under which a piece is a flat sheet: float coordinates hold
/// no more.
constexpr double kFlat = 1e-6;

std::uint64_t pair_budget(const Mesh& mesh) {
    return std::max(kLeastPairs, kPairsPerTriangle * std::uint64_t(mesh.triangles.size()));
}

struct Corners {
    Vec3d a, b, c;
    [[nodiscard]] Vec3d normal() const { return cross(b - a, c - a); } ///< twice the area long
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
    [[nodiscard]] bool flat() const { return !(std::abs(volume) > kFlat * area * box.diagonal()); }
    void offer(std::size_t slot, double value, std::uint32_t triangle) {
        if (value > reach[slot]) reach[slot] = value, sample[slot] = triangle;
    }
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
        for (int axis = 0; axis < 3; ++axis) {
            m.offer(std::size_t(1 + 2 * axis), -std::min({t.a[axis], t.b[axis], t.c[axis]}), i);
            m.offer(std::size_t(2 + 2 * axis), std::max({t.a[axis], t.b[axis], t.c[axis]}), i);
        }
    }
    return out;
}

/// A point in the material of a closed piece, next to the triangle of a sample slot.
Vec3d sample_point(const Mesh& mesh, const Measures& m, std::size_t slot) {
    const Corners t = corners_of(mesh, m.sample[slot]);
    Vec3d p = (t.a + t.b + t.c) * (1.0 / 3);
    if (slot > 0) {
        const int axis = int(slot - 1) / 2;
        const double sign = slot % 2 == 1 ? -1 : 1;
        const Vec3d farthest =
            std::max({t.a, t.b, t.c}, [&](const Vec3d& l, const Vec3d& r) { return sign * l[axis] < sign * r[axis]; });
        p = lerp(p, farthest, 0.6);
    }
    const double largest = std::max(length(m.box.lower), length(m.box.upper));
    const double step = std::max(1e-5 * m.box.diagonal(), 4e-7 * largest);
    return p - normalize(t.normal()) * std::copysign(step, m.volume);
}

/// How many other closed pieces each closed piece lies in, by piece; nothing if that is too
/// much work.
std::optional<std::vector<std::uint32_t>> find_nesting(const Mesh& mesh, const Pieces& pieces,
                                                       const std::vector<Measures>& measures,
                                                       const std::vector<std::uint8_t>& bounding) {
    std::vector<std::uint32_t> depth(pieces.kind.size(), 0);
    const auto several = std::size_t(std::ranges::count(bounding, 1));
    if (several < 2) return depth;
    if (several > kMostSamples) return std::nullopt;
    const std::size_t slots = std::clamp<std::size_t>(kMostSamples / several, 1, kSamplesPerPiece);

    std::vector<Vec3d> points;
    std::vector<std::uint32_t> piece_of_point;
    for (std::uint32_t i = 0; i < measures.size(); ++i)
        for (std::size_t slot = 0; bounding[i] && slot < slots; ++slot) {
            points.push_back(sample_point(mesh, measures[i], slot));
            piece_of_point.push_back(i);
        }
    std::vector<std::uint8_t> wanted(mesh.triangles.size(), 0);
    for (std::size_t t = 0; t < wanted.size(); ++t)
        if (pieces.of_triangle[t] != kNoPiece) wanted[t] = bounding[pieces.of_triangle[t]];
    const auto piercings = find_piercings(mesh, wanted, {1, 0, 0}, points, pair_budget(mesh));
    if (!piercings) return std::nullopt;

    // The pieces around the points of each piece: those that the half line from it leaves more
    // or less often than it enters them. A piece lies in another if all its points do.
    std::vector<std::uint32_t> around;
    std::vector<std::pair<std::uint32_t, int>> crossed; // of one line: piece, sign
    const auto count_runs = [](auto first, auto last, auto&& body) {
        for (auto run = first; run != last;) {
            auto end = run;
            while (end != last && *end == *run) ++end;
            body(*run, std::size_t(end - run));
            run = end;
        }
    };
    for (std::size_t line = 0, i = 0; line < points.size();) {
        const std::uint32_t piece = piece_of_point[line];
        around.clear();
        std::size_t own_points = 0;
        for (; line < points.size() && piece_of_point[line] == piece; ++line, ++own_points) {
            crossed.clear();
            for (; i < piercings->size() && (*piercings)[i].line == line; ++i) {
                const Piercing& p = (*piercings)[i];
                if (p.along > 0) crossed.emplace_back(pieces.of_triangle[p.triangle], p.entering ? -1 : 1);
            }
            std::ranges::sort(crossed);
            for (std::size_t k = 0; k < crossed.size();) {
                const std::uint32_t other = crossed[k].first;
                int winding = 0;
                for (; k < crossed.size() && crossed[k].first == other; ++k) winding += crossed[k].second;
                if (winding != 0) around.push_back(other);
            }
        }
        std::ranges::sort(around);
        count_runs(around.begin(), around.end(), [&](std::uint32_t other, std::size_t times) {
            // Copies of a piece are as large as it is, and none lies in the other.
            const bool larger = std::abs(measures[other].volume) > (1 + 1e-5) * std::abs(measures[piece].volume);
            if (other != piece && larger && times == own_points) ++depth[piece];
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

struct RayTest {
    Balance open, whole; ///< of the open pieces alone, and of all that are not copies or flat
};

/// @param open   by triangle: 1 if edges leave it open; lines go through points of those.
/// @param whole  by triangle: 1 if it counts at all.
std::optional<RayTest> test_by_rays(const Mesh& mesh, const std::vector<std::uint8_t>& open,
                                    const std::vector<std::uint8_t>& whole) {
    double area = 0;
    for (std::uint32_t i = 0; i < mesh.triangles.size(); ++i)
        if (open[i]) area += length(corners_of(mesh, i).normal());
    if (!(area > 0) || !std::isfinite(area)) return std::nullopt;

    std::mt19937 random(20261122);
    const auto unit = [&] { return (double(random()) + 0.5) * 0x1p-32; };
    // Points spread evenly over the surface.
    std::vector<Vec3d> points[kTestDirections];
    double below = 0;
    std::uint32_t taken = 0;
    double next = unit() / kTestLines * area;
    for (std::uint32_t i = 0; i < mesh.triangles.size() && taken < kTestLines; ++i) {
        if (!open[i]) continue;
        const Corners t = corners_of(mesh, i);
        below += length(t.normal());
        while (taken < kTestLines && next < below) {
            const double s = std::sqrt(unit()), r = unit();
            points[taken % kTestDirections].push_back(t.a * (1 - s) + t.b * (s * (1 - r)) + t.c * (s * r));
            next = (++taken + unit()) / kTestLines * area;
        }
    }

    RayTest out;
    const double same_place = 1e-6 * mesh.bounds.diagonal();
    std::vector<Piercing> part;
    for (std::vector<Vec3d>& through : points) {
        Vec3d direction;
        do direction = Vec3d{unit(), unit(), unit()} * 2.0 - Vec3d{1, 1, 1};
        while (dot(direction, direction) > 1 || dot(direction, direction) < 0.01);
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
    return out;
}

bool lies_in(const Bounds3d& inner, const Bounds3d& outer) {
    for (int axis = 0; axis < 3; ++axis)
        if (inner.lower[axis] < outer.lower[axis] || inner.upper[axis] > outer.upper[axis]) return false;
    return true;
}

/// Judges the pieces that edges leave open, and those they close beside them.
/// @param side  by piece; in: closed ones by nesting, open ones open. Out: all.
void judge_open_pieces(const Mesh& mesh, const Pieces& pieces, const std::vector<Measures>& measures,
                       std::vector<TriangleSide>& side, MeshSolid& out) {
    Bounds3d open_box;
    for (std::size_t i = 0; i < side.size(); ++i)
        if (pieces.kind[i] == PieceKind::open) open_box.extend(measures[i].box);
    std::vector<std::uint8_t> open(mesh.triangles.size(), 0), whole(mesh.triangles.size(), 0);
    for (std::size_t t = 0; t < open.size(); ++t) {
        const std::uint32_t piece = pieces.of_triangle[t];
        if (piece == kNoPiece) continue;
        open[t] = pieces.kind[piece] == PieceKind::open;
        whole[t] = open[t] || side[piece] != TriangleSide::open;
    }
    const std::optional<RayTest> test = test_by_rays(mesh, open, whole);
    const bool mixed = std::ranges::any_of(side, [](TriangleSide s) { return s != TriangleSide::open; });
    const auto set = [&](TriangleSide value, auto&& choose) {
        for (std::size_t i = 0; i < side.size(); ++i)
            if (choose(i)) side[i] = value;
    };
    const auto is_open = [&](std::size_t i) { return pieces.kind[i] == PieceKind::open; };

    if (test && mixed) {
        const Balance& b = test->whole;
        const bool wound = nearly_all(b.single_wound, b.lines), turned = nearly_all(b.single_turned, b.lines);
        if (wound || turned) {
            out.lines = b.lines, out.balanced_lines = wound ? b.single_wound : b.single_turned;
            set(wound ? TriangleSide::outward : TriangleSide::inward,
                [&](std::size_t i) { return is_open(i) || side[i] != TriangleSide::open; });
            out.by = ClosedBy::rays;
            return;
        }
    }
    if (test) {
        const Balance& b = test->open;
        out.lines = b.lines, out.balanced_lines = std::max(b.as_wound, b.turned);
        bool nested = false;
        for (std::size_t i = 0; i < side.size(); ++i)
            if (side[i] != TriangleSide::open)
                nested |= lies_in(measures[i].box, open_box) || lies_in(open_box, measures[i].box);
        if (nearly_all(out.balanced_lines, b.lines) && !nested) {
            set(b.as_wound >= b.turned ? TriangleSide::outward : TriangleSide::inward, is_open);
            out.by = ClosedBy::rays;
            return;
        }
    }
    set(TriangleSide::open, [&](std::size_t i) { return lies_in(measures[i].box, open_box); });
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
    const std::vector<Measures> measures = measure(mesh, pieces);
    MeshSolid out;
    out.edges = pieces.edges;

    std::vector<std::uint8_t> bounding(count, 0); // closed pieces that hold a volume
    for (std::size_t i = 0; i < count; ++i)
        bounding[i] =
            pieces.kind[i] == PieceKind::closed && !measures[i].flat() && measures[i].sample[0] != kNoTriangle;

    std::vector<TriangleSide> side(count, TriangleSide::open);
    if (const auto depth = find_nesting(mesh, pieces, measures, bounding))
        for (std::size_t i = 0; i < count; ++i)
            if (bounding[i])
                side[i] =
                    (measures[i].volume > 0) == ((*depth)[i] % 2 == 0) ? TriangleSide::outward : TriangleSide::inward;
    if (std::ranges::find(pieces.kind, PieceKind::open) != pieces.kind.end())
        judge_open_pieces(mesh, pieces, measures, side, out);

    for (std::size_t i = 0; i < count; ++i) {
        if (pieces.kind[i] == PieceKind::duplicate) continue;
        ++out.components;
        out.closed_components += side[i] != TriangleSide::open;
        out.flipped_components += side[i] == TriangleSide::inward;
    }
    out.closed = out.components > 0 && out.closed_components == out.components;
    if (!out.closed)
        out.by = ClosedBy::nothing;
    else if (out.by != ClosedBy::rays)
        out.by = ClosedBy::edges;

    const bool alike = std::ranges::adjacent_find(side, std::not_equal_to{}) == side.end();
    if (alike) {
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
