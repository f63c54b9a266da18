#include "porthole/scene/closed.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <numeric>
#include <tuple>
#include <utility>

namespace porthole {

namespace {

std::uint32_t hash_of(Vec3f p) {
    const auto mix = [](std::uint64_t h, float v) {
        // Adding zero turns -0 into 0.
        h ^= std::bit_cast<std::uint32_t>(v + 0.0f);
        h *= 0x9E3779B97F4A7C15ull;
        return h ^ (h >> 29);
    };
    return std::uint32_t(mix(mix(mix(0, p.x), p.y), p.z) >> 16);
}

/// Which things hang together. The root of a set is its lowest member.
class DisjointSets {
public:
    explicit DisjointSets(std::size_t n) : parent_(n) { std::iota(parent_.begin(), parent_.end(), 0u); }
    std::uint32_t find(std::uint32_t i) {
        while (parent_[i] != i) i = parent_[i] = parent_[parent_[i]];
        return i;
    }
    void unite(std::uint32_t a, std::uint32_t b) {
        a = find(a), b = find(b);
        if (a > b) std::swap(a, b);
        parent_[b] = a;
    }

private:
    std::vector<std::uint32_t> parent_;
};

/// One side of a triangle, in a row of its lower vertex.
struct HalfEdge {
    std::uint64_t bits; ///< from high to low: upper vertex, triangle, whether it runs to the upper vertex

    static HalfEdge make(std::uint32_t upper, std::uint32_t triangle, bool forward) {
        return {std::uint64_t(upper) << 32 | std::uint64_t(triangle) << 1 | std::uint64_t(forward)};
    }
    [[nodiscard]] std::uint32_t upper() const { return std::uint32_t(bits >> 32); }
    [[nodiscard]] std::uint32_t triangle() const { return std::uint32_t(bits) >> 1; }
    [[nodiscard]] bool forward() const { return bits & 1; }
};

/// An edge that does not simply join two opposite triangles.
struct OddEdge {
    std::uint32_t lower = 0, upper = 0; ///< vertices
    std::size_t begin = 0, end = 0;     ///< half edges
};

struct Edges {
    std::vector<std::uint32_t> vertex; ///< welded
    std::vector<HalfEdge> half_edges;
    std::vector<OddEdge> odd; ///< open ones, too
    Closedness counts;
};

/// Welds, pairs the half edges and unites the triangles of ordinary edges.
Edges pair_edges(const Mesh& mesh, DisjointSets& triangles) {
    Edges out;
    out.vertex = weld(mesh.positions);
    const auto each_half_edge = [&](auto&& body) {
        for (std::uint32_t i = 0; i < mesh.triangles.size(); ++i) {
            const Vec3u& t = mesh.triangles[i];
            const std::uint32_t corner[3] = {out.vertex[t.x], out.vertex[t.y], out.vertex[t.z]};
            if (corner[0] == corner[1] || corner[1] == corner[2] || corner[2] == corner[0]) continue;
            for (int k = 0; k < 3; ++k) {
                const std::uint32_t a = corner[k], b = corner[(k + 1) % 3];
                body(std::min(a, b), HalfEdge::make(std::max(a, b), i, a < b));
            }
        }
    };
    std::vector<std::size_t> row_end(mesh.positions.size() + 1, 0); // counts, then starts, then ends
    each_half_edge([&](std::uint32_t lower, HalfEdge) { ++row_end[lower + 1]; });
    std::partial_sum(row_end.begin(), row_end.end(), row_end.begin());
    out.half_edges.resize(row_end.back());
    each_half_edge([&](std::uint32_t lower, HalfEdge h) { out.half_edges[row_end[lower]++] = h; });

    std::size_t i = 0;
    for (std::uint32_t v = 0; v < mesh.positions.size(); ++v) {
        const std::size_t end = row_end[v];
        std::sort(out.half_edges.begin() + std::ptrdiff_t(i), out.half_edges.begin() + std::ptrdiff_t(end),
                  [](HalfEdge a, HalfEdge b) { return a.bits < b.bits; });
        while (i < end) {
            const std::size_t begin = i;
            const std::uint32_t upper = out.half_edges[begin].upper();
            while (i < end && out.half_edges[i].upper() == upper) ++i;
            const HalfEdge first = out.half_edges[begin];
            ++out.counts.edges;
            if (i - begin == 2 && first.forward() != out.half_edges[begin + 1].forward()) {
                triangles.unite(first.triangle(), out.half_edges[begin + 1].triangle());
                continue;
            }
            ++(i - begin == 1 ? out.counts.open_edges : out.counts.odd_edges);
            out.odd.push_back({v, upper, begin, i});
        }
    }
    out.counts.closed = out.counts.edges > 0 && out.odd.empty();
    return out;
}

/// Marks the patches (triangles joined by ordinary edges) that no closed surface can contain:
/// at one of their edges nothing runs the other way, once those of this kind are gone.
std::vector<std::uint8_t> find_dead_patches(const Edges& edges, DisjointSets& patches, std::size_t triangles) {
    struct Touch {
        std::uint32_t patch, edge;
        bool forward;
    };
    std::vector<Touch> touches;
    std::vector<std::array<std::uint32_t, 2>> living(edges.odd.size(), {0, 0}); // backward, forward
    for (std::uint32_t e = 0; e < edges.odd.size(); ++e)
        for (std::size_t i = edges.odd[e].begin; i < edges.odd[e].end; ++i) {
            const HalfEdge h = edges.half_edges[i];
            touches.push_back({patches.find(h.triangle()), e, h.forward()});
            ++living[e][h.forward()];
        }
    std::ranges::stable_sort(touches, {}, &Touch::patch);

    std::vector<std::uint8_t> dead(triangles, 0); // by the patch's first triangle
    std::vector<std::uint32_t> waiting;           // edges that may lack a direction
    for (std::uint32_t e = 0; e < edges.odd.size(); ++e) waiting.push_back(e);
    while (!waiting.empty()) {
        const std::uint32_t e = waiting.back();
        waiting.pop_back();
        if ((living[e][0] == 0) == (living[e][1] == 0)) continue;
        for (std::size_t i = edges.odd[e].begin; i < edges.odd[e].end; ++i) {
            const std::uint32_t patch = patches.find(edges.half_edges[i].triangle());
            if (std::exchange(dead[patch], std::uint8_t(1))) continue;
            const auto first = std::ranges::lower_bound(touches, patch, {}, &Touch::patch);
            for (auto t = first; t != touches.end() && t->patch == patch; ++t)
                if (--living[t->edge][t->forward] == 0) waiting.push_back(t->edge);
        }
    }
    return dead;
}

/// A half edge at an edge with several: where around the edge its triangle lies.
struct Spoke {
    std::uint32_t triangle = 0, third = 0; ///< third: the corner that is not on the edge
    bool forward = false;
    std::uint32_t copy = 0; ///< how many equal triangles come before it
    double angle = 0;       ///< counter-clockwise about the edge, looking from upper to lower
    bool repeated = false;  ///< another triangle has the same corners, in whatever order
    bool matched = false;
};

/// Matches spokes as brackets around the circle. Going counter-clockwise, a backward triangle
/// begins material and a forward one ends it.
template <typename Match> void match_brackets(std::span<Spoke* const> circle, Match&& match) {
    std::vector<Spoke*> begun;
    for (int round = 0; round < 2; ++round)
        for (Spoke* spoke : circle) {
            if (spoke->matched) continue;
            if (!spoke->forward) {
                if (round == 0) begun.push_back(spoke);
            } else if (!begun.empty()) {
                match(*begun.back(), *spoke);
                begun.back()->matched = spoke->matched = true;
                begun.pop_back();
            }
        }
}

/// Sorts by angle; triangles that lie on each other so that material ends before it begins.
void sort_around(std::vector<Spoke*>& circle) {
    constexpr double kSameAngle = 1e-6;
    std::sort(circle.begin(), circle.end(), [](const Spoke* a, const Spoke* b) {
        return std::pair(a->angle, a->triangle) < std::pair(b->angle, b->triangle);
    });
    // The circle must not begin in the midst of equal angles.
    if (!circle.empty()) {
        std::size_t last = circle.size();
        while (last > 1 && circle[last - 1]->angle - circle[last - 2]->angle < kSameAngle) --last;
        if (last > 1 && circle[0]->angle + 2 * double(kPi) - circle.back()->angle < kSameAngle)
            std::rotate(circle.begin(), circle.begin() + std::ptrdiff_t(last - 1), circle.end());
    }
    const auto near = [](double a, double b) {
        const double d = std::abs(a - b);
        return d < kSameAngle || 2 * double(kPi) - d < kSameAngle;
    };
    for (std::size_t i = 0; i < circle.size();) {
        std::size_t end = i + 1;
        while (end < circle.size() && near(circle[end]->angle, circle[end - 1]->angle)) ++end;
        std::stable_partition(circle.begin() + std::ptrdiff_t(i), circle.begin() + std::ptrdiff_t(end),
                              [](const Spoke* s) { return s->forward; });
        i = end;
    }
}

std::vector<Spoke> spokes_of(const Mesh& mesh, const Edges& edges, const OddEdge& edge, DisjointSets& patches,
                             const std::vector<std::uint8_t>& dead) {
    const Vec3d origin(mesh.positions[edge.lower]);
    const Vec3d axis = normalize(Vec3d(mesh.positions[edge.upper]) - origin);
    const Vec3d u = normalize(std::abs(axis.x) < 0.6 ? cross(axis, Vec3d{1, 0, 0}) : cross(axis, Vec3d{0, 1, 0}));
    const Vec3d v = cross(axis, u);
    std::vector<Spoke> spokes;
    for (std::size_t h = edge.begin; h < edge.end; ++h) {
        const std::uint32_t triangle = edges.half_edges[h].triangle();
        if (dead[patches.find(triangle)]) continue;
        const Vec3u& t = mesh.triangles[triangle];
        std::uint32_t third = edges.vertex[t.x];
        for (const std::uint32_t corner : {edges.vertex[t.y], edges.vertex[t.z]})
            if (third == edge.lower || third == edge.upper) third = corner;
        const Vec3d d = Vec3d(mesh.positions[third]) - origin;
        spokes.push_back({triangle, third, edges.half_edges[h].forward(), 0, std::atan2(dot(d, v), dot(d, u))});
    }
    std::sort(spokes.begin(), spokes.end(), [](const Spoke& a, const Spoke& b) {
        return std::tuple(a.third, a.forward, a.triangle) < std::tuple(b.third, b.forward, b.triangle);
    });
    for (std::size_t i = 1; i < spokes.size(); ++i) {
        if (spokes[i].third != spokes[i - 1].third) continue;
        spokes[i].repeated = spokes[i - 1].repeated = true;
        if (spokes[i].forward == spokes[i - 1].forward) spokes[i].copy = spokes[i - 1].copy + 1;
    }
    return spokes;
}

/// Matches the living triangles around an edge, copies of the same rank first.
template <typename Match> void match_spokes(std::vector<Spoke>& spokes, Match&& match) {
    std::stable_sort(spokes.begin(), spokes.end(), [](const Spoke& a, const Spoke& b) { return a.copy < b.copy; });
    std::vector<Spoke*> circle;
    const auto match_all = [&] {
        sort_around(circle);
        match_brackets(circle, match);
        circle.clear();
    };
    for (std::size_t i = 0; i < spokes.size();) {
        const std::uint32_t copy = spokes[i].copy;
        for (; i < spokes.size() && spokes[i].copy == copy; ++i) circle.push_back(&spokes[i]);
        match_all();
    }
    for (Spoke& spoke : spokes)
        if (!spoke.matched) circle.push_back(&spoke);
    match_all();
}

} // namespace

std::vector<std::uint32_t> weld(std::span<const Vec3f> positions) {
    constexpr std::uint32_t kEmpty = 0xFFFFFFFFu;
    const std::size_t capacity = std::bit_ceil(std::max<std::size_t>(16, positions.size() + positions.size() / 2));
    std::vector<std::uint32_t> table(capacity, kEmpty), first(positions.size());
    for (std::uint32_t i = 0; i < positions.size(); ++i) {
        std::size_t slot = hash_of(positions[i]) & (capacity - 1);
        while (table[slot] != kEmpty && !(positions[table[slot]] == positions[i])) slot = (slot + 1) & (capacity - 1);
        if (table[slot] == kEmpty) table[slot] = i;
        first[i] = table[slot];
    }
    return first;
}

Pieces find_pieces(const Mesh& mesh) {
    const std::size_t n = mesh.triangles.size();
    DisjointSets sets(n);
    const Edges edges = pair_edges(mesh, sets);

    std::vector<std::uint8_t> open, repeated; // by triangle, where there are odd edges at all
    if (!edges.odd.empty()) {
        open = find_dead_patches(edges, sets, n);
        for (std::uint32_t t = 0; t < n; ++t) open[t] = open[sets.find(t)];
        repeated.assign(n, 0);
        // The patches stay as they are while edges are matched: `sets` is their union.
        DisjointSets patches = sets;
        std::vector<std::uint8_t> dead = open;
        for (const OddEdge& edge : edges.odd) {
            std::vector<Spoke> spokes = spokes_of(mesh, edges, edge, patches, dead);
            match_spokes(spokes, [&](const Spoke& a, const Spoke& b) { sets.unite(a.triangle, b.triangle); });
            for (const Spoke& spoke : spokes) {
                if (!spoke.matched) open[spoke.triangle] = 1;
                if (spoke.repeated) repeated[spoke.triangle] = 1;
            }
            // What hangs on an open edge is counted as one open piece.
            std::uint32_t first = kNoPiece;
            for (std::size_t h = edge.begin; h < edge.end; ++h) {
                const std::uint32_t t = edges.half_edges[h].triangle();
                if (!dead[t]) continue;
                if (first == kNoPiece) first = t;
                sets.unite(first, t);
            }
        }
    }

    Pieces out;
    out.edges = edges.counts;
    out.of_triangle.assign(n, kNoPiece);
    for (std::uint32_t t = 0; t < n; ++t) {
        const Vec3u& corner = mesh.triangles[t];
        const std::uint32_t a = edges.vertex[corner.x], b = edges.vertex[corner.y], c = edges.vertex[corner.z];
        if (a == b || b == c || c == a) continue;
        // The root is the lowest member, so that it comes by first.
        const std::uint32_t root = sets.find(t);
        if (root == t) {
            out.of_triangle[t] = std::uint32_t(out.kind.size());
            out.kind.push_back(PieceKind::closed);
        } else {
            out.of_triangle[t] = out.of_triangle[root];
        }
    }
    if (!open.empty()) {
        std::vector<std::uint8_t> all_copies(out.kind.size(), 1);
        for (std::uint32_t t = 0; t < n; ++t) {
            const std::uint32_t piece = out.of_triangle[t];
            if (piece == kNoPiece) continue;
            if (open[t]) out.kind[piece] = PieceKind::open;
            if (!repeated[t]) all_copies[piece] = 0;
        }
        for (std::size_t i = 0; i < out.kind.size(); ++i)
            if (out.kind[i] == PieceKind::open && all_copies[i]) out.kind[i] = PieceKind::duplicate;
    }
    return out;
}

Closedness closedness(const Mesh& mesh) {
    if (!mesh.primitives.empty()) return {.closed = true};
    DisjointSets ignored(mesh.triangles.size());
    return pair_edges(mesh, ignored).counts;
}

std::vector<Closedness> closedness(const Scene& scene, const Control& control) {
    std::vector<Closedness> out(scene.meshes.size());
    parallel_for(scene.meshes.size(), control, [&](std::size_t i) { out[i] = closedness(scene.meshes[i]); });
    return out;
}

} // namespace porthole
