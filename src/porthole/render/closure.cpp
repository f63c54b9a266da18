#include "porthole/render/closure.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace porthole {

namespace {

constexpr float kOneSurface = 0.8f; ///< the same, farther apart
constexpr float kOffPlane = 1.5f;   ///< pixels by which neighbours of one surface leave its plane
constexpr std::size_t kSeeds = 32;  ///< vertices of a part that are looked for
constexpr float kHidden = 0.999f;   ///< a vertex behind this share of its depth is hidden

/// Blocks, each once, those of a tile together.
std::vector<Vec2i> in_order(std::vector<Vec2i> blocks) {
    constexpr int kTileBlocks = FilteredTile::kSize / kCell;
    const auto key = [](Vec2i b) { return std::array<int, 4>{b.y / kTileBlocks, b.x / kTileBlocks, b.y, b.x}; };
    std::sort(blocks.begin(), blocks.end(), [&](Vec2i a, Vec2i b) { return key(a) < key(b); });
    blocks.erase(std::unique(blocks.begin(), blocks.end()), blocks.end());
    return blocks;
}

/// Blocks in which vertices of a part should be seen and are not.
std::vector<Vec2i> seeds_of(PartId id, const Picture& picture, const Stage& stage, const BlockMap& map) {
    const Scene& scene = stage.scene;
    const Part& part = scene.parts[index(id)];
    const Mesh& mesh = scene.meshes[part.mesh];
    const Affine3f place(part.world_from_mesh);
    std::vector<Vec2i> found;
    const auto look = [&](Vec3f point) {
        const PixelPoint p = picture.view.project(place.point(point));
        if (!(p.depth > 0) || !(p.x >= float(map.window.x0)) || !(p.x < float(map.window.x1)) ||
            !(p.y >= float(map.window.y0)) || !(p.y < float(map.window.y1)))
            return;
        const int x = int(p.x), y = int(p.y), bx = x / kCell, by = y / kCell;
        if (map.state(bx, by) != BlockMap::wanted) return;
        const Surrounding around(map, bx, by);
        const IdBuffer& ids = picture.buffer.ids;
        if (ids.id(around.left_of(x), around.top_of(y)) == id) return;
        if (around.mix(x, y, [&](int cx, int cy) { return ids.depth(cx, cy); }) < kHidden * p.depth) return;
        found.push_back({bx, by});
    };
    const std::size_t n = mesh.positions.size();
    for (std::size_t k = 0; k < std::min(n, kSeeds); ++k) look(mesh.positions[k * n / std::min(n, kSeeds)]);
    if (n == 0)
        for (int k = 0; k < 8; ++k) look(mesh.bounds.corner(k));
    return found;
}

/// Whether a traced block shows that something else than what follows from the lattice goes on in
/// its neighbour `b`.
bool contradicts(const Picture& picture, const BlockMap& map, Vec2i traced, Vec2i b) {
    const Surrounding around(map, b.x, b.y);
    // What the lattice was decided by has been compared, but not what was assumed of it.
    const bool decided = map.allows(traced.x, traced.y) != BlockMap::one_color;
    if (decided && std::find(std::begin(around.block), std::end(around.block), traced) != std::end(around.block))
        return false;
    const GBuffer& buffer = picture.buffer;
    const Rect t = map.pixels(traced.x, traced.y), r = map.pixels(b.x, b.y);
    const int dx = b.x - traced.x, dy = b.y - traced.y;
    const BlockSummary& here = map.summary(traced.x, traced.y);
    const std::uint32_t key = map.summary(around.block[0].x, around.block[0].y).key;
    if (here.uniform && here.key == key && key != GBuffer::kNoKey) {
        const float ambient = around.mix_blocks(map, r.x0, r.y0, [](const BlockSummary& s) { return s.ambient(); });
        if (std::abs(here.ambient() - ambient) > 2 * kAmbientStep) return true;
        for (int c = 0; c < 3; ++c) {
            const float lamp = around.mix_blocks(map, r.x0, r.y0, [c](const BlockSummary& s) { return s.lamps[c]; });
            if (std::abs(here.lamps[c] - lamp) > 255.0f * 2 * kLampStep) return true;
        }
    }
    if (map.allows(b.x, b.y) != BlockMap::one_color) return false;
    const int n = dx != 0 ? std::min(t.height(), r.height()) : std::min(t.width(), r.width());
    const auto border = [](int d, int low, int high) { return d > 0 ? high - 1 : low; };
    for (int i = 0; i < n; ++i) {
        const Vec2i p{dx != 0 ? border(dx, t.x0, t.x1) : t.x0 + i, dy != 0 ? border(dy, t.y0, t.y1) : t.y0 + i};
        if (buffer.key(p.x, p.y) != key) return true;
        if (key == GBuffer::kNoKey) continue;
        const Vec2i q{p.x + dx, p.y + dy};
        const float depth = 1.0f / around.mix(q.x, q.y, [&](int x, int y) { return 1.0f / buffer.ids.depth(x, y); });
        const auto position = [&](Vec2i pixel, float z) {
            const Ray ray = picture.view.ray(float(pixel.x) + 0.5f, float(pixel.y) + 0.5f);
            return ray.origin + ray.direction * (z / ray.depth_per_t);
        };
        const Vec3f step = position(q, depth) - position(p, buffer.ids.depth(p.x, p.y));
        const Vec3f normal = unpack_normal(buffer.pixels(p.x, p.y).normal);
        if (std::abs(dot(step, normal)) > kOffPlane * picture.view.pixel_size(depth)) return true;
        const Pixel& nearest = buffer.pixels(around.tx(q.x) < 0.5f ? around.left_of(q.x) : around.right_of(q.x),
                                             around.ty(q.y) < 0.5f ? around.top_of(q.y) : around.bottom_of(q.y));
        if (dot(normal, unpack_normal(nearest.normal)) < kOneSurface) return true;
    }
    return false;
}

void add_contradicted(const Picture& picture, const BlockMap& map, Vec2i fresh, std::vector<Vec2i>& blocks) {
    const auto is_wanted = [&](Vec2i b) { return map.state.at_or(b.x, b.y, BlockMap::unused) == BlockMap::wanted; };
    for (const Vec2i d : {Vec2i{-1, 0}, {1, 0}, {0, -1}, {0, 1}}) {
        const Vec2i b{fresh.x + d.x, fresh.y + d.y};
        if (is_wanted(b) && contradicts(picture, map, fresh, b)) blocks.push_back(b);
    }
    if (map.allows(fresh.x, fresh.y) != BlockMap::one_color) return;
    // It was assumed to be like the blocks beside it, and others follow from it.
    constexpr int kReach = 4;
    const BlockSummary& here = map.summary(fresh.x, fresh.y);
    for (int y = fresh.y - kReach; y <= fresh.y + kReach; ++y)
        for (int x = fresh.x - kReach; x <= fresh.x + kReach; ++x) {
            if (!is_wanted({x, y})) continue;
            const Surrounding around(map, x, y);
            const auto* const end = std::end(around.block);
            if (std::find(std::begin(around.block), end, fresh) == end) continue;
            const auto* const other =
                std::find_if(std::begin(around.block), end, [&](Vec2i o) { return !(o == fresh); });
            if (other != end && here.uniform && here.key == map.summary(other->x, other->y).key) continue;
            blocks.push_back({x, y});
        }
}

} // namespace

std::vector<Vec2i> seed_blocks(const Picture& picture, const Stage& stage, const BlockMap& map,
                               const Control& control) {
    const std::span<const PartId> parts = stage.bvh.hittable();
    constexpr std::size_t kRun = 64;
    std::vector<std::vector<Vec2i>> runs((parts.size() + kRun - 1) / kRun);
    parallel_for(runs.size(), control, [&](std::size_t r) {
        for (std::size_t i = r * kRun; i < std::min(parts.size(), (r + 1) * kRun); ++i) {
            const std::vector<Vec2i> found = seeds_of(parts[i], picture, stage, map);
            runs[r].insert(runs[r].end(), found.begin(), found.end());
        }
    });
    std::vector<Vec2i> all;
    for (const std::vector<Vec2i>& run : runs) all.insert(all.end(), run.begin(), run.end());
    return in_order(std::move(all));
}

std::vector<Vec2i> contradicted_by(const Picture& picture, const BlockMap& map, std::span<const Vec2i> fresh,
                                   const Control& control) {
    constexpr std::size_t kRun = 256;
    std::vector<std::vector<Vec2i>> runs((fresh.size() + kRun - 1) / kRun);
    parallel_for(runs.size(), control, [&](std::size_t r) {
        for (std::size_t i = r * kRun; i < std::min(fresh.size(), (r + 1) * kRun); ++i)
            add_contradicted(picture, map, fresh[i], runs[r]);
    });
    std::vector<Vec2i> all;
    for (const std::vector<Vec2i>& run : runs) all.insert(all.end(), run.begin(), run.end());
    return in_order(std::move(all));
}

} // namespace porthole
