#include "porthole/scene/closed.h"

#include <algorithm>
#include <bit>
#include <numeric>
#include <span>

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

/// For every vertex the first one at the same position.
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

} // namespace

Closedness closedness(const Mesh& mesh) {
    const std::vector<std::uint32_t> vertex = weld(mesh.positions);

    // Half edges in a row of their lower vertex: the upper vertex, and which way it runs.
    struct HalfEdge {
        std::uint32_t upper;
        std::uint32_t forward;
    };
    const auto each_half_edge = [&](auto&& body) {
        for (const Vec3u& t : mesh.triangles) {
            const std::uint32_t corner[3] = {vertex[t.x], vertex[t.y], vertex[t.z]};
            if (corner[0] == corner[1] || corner[1] == corner[2] || corner[2] == corner[0]) continue;
            for (int i = 0; i < 3; ++i) {
                const std::uint32_t a = corner[i], b = corner[(i + 1) % 3];
                body(std::min(a, b), HalfEdge{std::max(a, b), a < b ? 1u : 0u});
            }
        }
    };
    std::vector<std::size_t> row_end(mesh.positions.size() + 1, 0); // counts, then starts, then ends
    each_half_edge([&](std::uint32_t lower, HalfEdge) { ++row_end[lower + 1]; });
    std::partial_sum(row_end.begin(), row_end.end(), row_end.begin());
    std::vector<HalfEdge> half_edges(row_end.back());
    each_half_edge([&](std::uint32_t lower, HalfEdge h) { half_edges[row_end[lower]++] = h; });

    Closedness out;
    std::size_t begin = 0;
    for (std::size_t v = 0; v < mesh.positions.size(); ++v) {
        const std::size_t end = row_end[v];
        const std::span<HalfEdge> row(half_edges.data() + begin, end - begin);
        begin = end;
        std::ranges::sort(row, {}, &HalfEdge::upper);
        for (std::size_t i = 0; i < row.size();) {
            std::size_t total = 0, forward = 0;
            const std::uint32_t upper = row[i].upper;
            for (; i < row.size() && row[i].upper == upper; ++i) ++total, forward += row[i].forward;
            ++out.edges;
            if (total == 1)
                ++out.open_edges;
            else if (total != 2 || forward != 1)
                ++out.odd_edges;
        }
    }
    out.closed = out.edges > 0 && out.open_edges == 0 && out.odd_edges == 0;
    return out;
}

std::vector<Closedness> closedness(const Scene& scene, const Control& control) {
    std::vector<Closedness> out(scene.meshes.size());
    parallel_for(scene.meshes.size(), control, [&](std::size_t i) { out[i] = closedness(scene.meshes[i]); });
    return out;
}

} // namespace porthole
