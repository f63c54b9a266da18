#include "porthole/trace/caps.h"

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>

#include "porthole/scene/texture.h"

namespace porthole {

namespace {

constexpr int kTile = 64;
constexpr float kChamferStep = 2, kFloorStep = 16; ///< pixel sizes

/// Whether some rays find the part's surface open, so that one which went into it may have come
/// out through a gap.
bool has_gaps(const MeshSolid& solid) { return solid.by == ClosedBy::rays && solid.balanced_lines < solid.lines; }

CappedLevels capped_levels(const Scene& scene, const Cut& cut, std::span<const MeshSolid> solids) {
    CappedLevels capped;
    for (std::size_t i = 0; i < cut.cap.size(); ++i) {
        if (cut.cap[i] == CapRule::none || cut.role[i] != CutRole::cut_set) continue;
        const std::size_t level = cut.level_of(PartId(i));
        capped.any[level] = true;
        capped.solids[level] |= cut.cap[i] == CapRule::solid;
        capped.mask |= level_mask(level);
        capped.doubtful |= has_gaps(solids[scene.parts[i].mesh]);
    }
    return capped;
}

/// A ray that goes into or comes out of the material of a part that may be capped.
struct Passage {
    float t = 0;
    int sign = 0; ///< -1 in, +1 out
    SurfaceRef surface;
};

bool on_edge(const SurfaceRef& s) { return std::min({s.u, s.v, 1 - s.u - s.v}) < 1e-4f; }

/// A ray through the edge of two triangles may be told of both.
bool is_repeated(const Passage& a, const Passage& b) {
    return a.surface.part == b.surface.part && a.sign == b.sign && b.t - a.t <= 1e-5f * std::abs(b.t) &&
           on_edge(a.surface) && on_edge(b.surface);
}

/// By lane, in order of t.
using Passages = std::array<std::vector<Passage>, kLanes>;

/// Leaves out the passages of parts with gaps where the whole ray does not enter and leave in turn.
void drop_unbalanced(const Scene& scene, std::span<const MeshSolid> solids, std::vector<Passage>& lane) {
    std::vector<PartId> unsound;
    for (const Passage& first : lane) {
        const PartId part = first.surface.part;
        if (!has_gaps(solids[scene.parts[index(part)].mesh])) continue;
        int inside = 0;
        bool sound = true;
        for (const Passage& p : lane)
            if (p.surface.part == part) inside -= p.sign, sound = sound && inside >= 0;
        if (!sound || inside != 0) unsound.push_back(part);
    }
    std::erase_if(lane, [&](const Passage& p) {
        return std::find(unsound.begin(), unsound.end(), p.surface.part) != unsound.end();
    });
}

/// Passages of the active lanes up to their tfar; to their end if they pass doubtful parts before.
void find_passages(const Bvh& bvh, const Cut& cut, const CappedLevels& capped, std::span<const MeshSolid> solids,
                   RayHit16& rays, Passages& passages) {
    for (std::vector<Passage>& lane : passages) lane.clear();
    const Scene& scene = bvh.scene();
    bool doubtful[kLanes] = {}, any = false;
    const auto collect = [&] {
        for_each_crossing(bvh, rays, [&](const Crossing& c) {
            if (cut.cap_of(c.part) == CapRule::none) return;
            const MeshSolid& solid = solids[scene.parts[index(c.part)].mesh];
            const int sign = crossing_sign(solid, c.triangle, c.entering);
            if (sign == 0) return;
            passages[std::size_t(c.lane)].push_back({c.t, sign, {c.part, c.triangle, c.u, c.v}});
            if (capped.doubtful && !doubtful[c.lane] && has_gaps(solid)) doubtful[c.lane] = any = true;
        });
    };
    collect();
    if (any) {
        // Only rays that pass a part with gaps are followed beyond the cut.
        for (int i = 0; i < kLanes; ++i) {
            if (!doubtful[i]) {
                rays.clear(i);
                continue;
            }
            rays.tnear[i] = std::nextafter(rays.tfar[i], kInfinity);
            rays.tfar[i] = kInfinity;
        }
        collect();
    }
    for (std::vector<Passage>& lane : passages) {
        if (lane.empty()) continue;
        std::sort(lane.begin(), lane.end(), [](const Passage& a, const Passage& b) {
            if (a.t != b.t) return a.t < b.t;
            if (a.surface.part != b.surface.part) return index(a.surface.part) < index(b.surface.part);
            if (a.sign != b.sign) return a.sign < b.sign;
            return a.surface.triangle < b.surface.triangle;
        });
        lane.erase(std::unique(lane.begin(), lane.end(), is_repeated), lane.end());
        if (any) drop_unbalanced(scene, solids, lane);
    }
}

/// Parts that a ray is inside of, entered last at the back.
class Inside {
public:
    void pass(const Passage& p) {
        const auto it = std::find_if(entered_.begin(), entered_.end(),
                                     [&](const Entered& e) { return e.surface.part == p.surface.part; });
        if (it == entered_.end()) {
            if (p.sign < 0) entered_.push_back({p.surface, p.t, 1});
            return; // left without being entered: the eye's side of the part is open
        }
        it->depth -= p.sign;
        if (it->depth <= 0) entered_.erase(it);
    }
    /// The innermost part that `admits`, or null.
    template <typename Admits> const SurfaceRef* innermost(Admits&& admits) const {
        const Entered* best = nullptr;
        for (const Entered& e : entered_) {
            if (!admits(e.surface.part)) continue;
            if (!best || e.t > best->t || (e.t == best->t && index(e.surface.part) < index(best->surface.part)))
                best = &e;
        }
        return best ? &best->surface : nullptr;
    }
    void clear() { entered_.clear(); }

private:
    struct Entered {
        SurfaceRef surface;
        float t = 0;
        int depth = 0; ///< components of the part around the ray
    };
    std::vector<Entered> entered_;
};

/// Whose material the passages of one lane are in at `t`.
SurfaceRef cap_at(const Cut& cut, std::span<const Passage> lane, std::size_t level, float t, bool chamfer,
                  Inside& inside) {
    inside.clear();
    for (const Passage& p : lane) {
        if (p.t >= t) break;
        if (cut.level_of(p.surface.part) == level) inside.pass(p);
    }
    const SurfaceRef* cap = inside.innermost([&](PartId part) {
        return cut.cap_of(part) == CapRule::solid || (chamfer && cut.cap_of(part) == CapRule::shell);
    });
    return cap ? *cap : SurfaceRef{};
}

/// Farthest cut of a lane that can be capped; -infinity: none.
float deepest(const CappedLevels& capped, const CutLanes& lanes, std::size_t levels, int lane) {
    float t = -kInfinity;
    for (std::size_t k = 0; k < levels; ++k)
        if (lanes.t[k][lane] < kInfinity && capped.at(k, lanes.chamfer[k][lane])) t = std::max(t, lanes.t[k][lane]);
    return t;
}

/// Whether depths `a` and `b` of neighbouring pixels of one level are parted by a wall of the
/// cut rather than joined by its slope.
bool is_cut_step(const View& view, const CutDepth& a, const CutDepth& b) {
    const float near = std::min(a.depth, b.depth), far = std::max(a.depth, b.depth);
    if (near == -kInfinity) return far > -kInfinity;
    if (a.chamfer && b.chamfer) return false;
    return far - near > (a.chamfer != b.chamfer ? kChamferStep : kFloorStep) * view.pixel_size(near);
}

} // namespace

CapLanes find_caps(const Bvh& bvh, const Cut& cut, const Caps& known, RayHit16& rays, const CutLanes& lanes) {
    CapLanes caps;
    const CappedLevels& capped = known.capped;
    if (capped.mask == 0) return caps;
    bool any = false;
    for (int i = 0; i < kLanes; ++i) {
        if (!rays.active(i)) continue;
        rays.tnear[i] = 0;
        rays.tfar[i] = deepest(capped, lanes, cut.levels.size(), i);
        rays.mask[i] = capped.mask;
        any |= rays.active(i);
    }
    if (!any) return caps;
    Passages passages;
    find_passages(bvh, cut, capped, known.solids, rays, passages);
    Inside inside;
    for (int i = 0; i < kLanes; ++i) {
        const std::vector<Passage>& lane = passages[std::size_t(i)];
        for (std::size_t k = 0; k < cut.levels.size() && !lane.empty(); ++k)
            if (lanes.t[k][i] < kInfinity && capped.at(k, lanes.chamfer[k][i]))
                caps.cap[k][i] = cap_at(cut, lane, k, lanes.t[k][i], lanes.chamfer[k][i], inside);
    }
    return caps;
}

namespace {

/// How deep each level is cut at the pixel centres of a tile and a few around.
class TileDepths {
public:
    TileDepths(const Cut& cut, const CappedLevels& capped, Rect tile) {
        const Rect w = tile.grown(kAround);
        for (std::size_t k = 0; k < cut.levels.size(); ++k) {
            if (!capped.any[k]) continue;
            levels_[k] = Image<CutDepth>(w);
            const Rect known = w.intersected(cut.distance.window());
            for (int y = known.y0; y < known.y1; ++y)
                for (int x = known.x0; x < known.x1; ++x) {
                    const float inside = -cut.distance(x, y);
                    if (inside < 0) continue;
                    const CutProfile& p = cut.levels[k](x, y);
                    levels_[k](x, y) = {p.depth(inside), p.on_chamfer(inside)};
                }
        }
    }
    [[nodiscard]] const CutDepth& at(std::size_t level, int x, int y) const { return levels_[level](x, y); }

private:
    static constexpr int kAround = 4; ///< flat blocks begin up to three pixels off the tile
    Image<CutDepth> levels_[kMostLevels];
};

/// The chamfer's depth, also a little beyond its ends.
float sloped(const CutProfile& p, float inside) { return std::min(p.floor, p.front + p.slope * (inside - p.start)); }

/// Makes the mesh of one tile.
class TileMesh {
public:
    TileMesh(const Cut& cut, const TileDepths& depths, const Scene& scene, CapMesh& mesh)
        : cut_(cut), depths_(depths), scene_(scene), mesh_(mesh) {}

    /// The square of one capped pixel.
    void add_pixel(std::size_t level, int x, int y, const SurfaceRef& cap) {
        add_square(cap, x, y, 1, [&](int cx, int cy) { return corner_depth(level, x, y, cx, cy); });
    }

    /// A square of `size` pixels whose corners lie at the cut depths of its corner pixels.
    void add_flat(std::size_t level, int x, int y, int size, const SurfaceRef& cap) {
        add_square(cap, x, y, size, [&](int cx, int cy) {
            return depths_.at(level, cx == x ? x : x + size - 1, cy == y ? y : y + size - 1).depth;
        });
    }

    /// The part of the wall between two pixels that lies between two depths.
    void add_wall(Vec2i a, Vec2i b, float near, float far, const SurfaceRef& surface) {
        if (is_clear(surface)) return;
        add_quad({point(a, near), point(b, near), point(b, far), point(a, far)}, surface);
    }

private:
    template <typename Depth> void add_square(const SurfaceRef& cap, int x, int y, int size, Depth&& depth) {
        if (is_clear(cap)) return;
        const Vec2i corners[4] = {{x, y}, {x + size, y}, {x + size, y + size}, {x, y + size}};
        std::array<Vec3f, 4> quad;
        for (std::size_t i = 0; i < 4; ++i) quad[i] = point(corners[i], depth(corners[i].x, corners[i].y));
        add_quad(quad, cap);
    }
    void add_quad(const std::array<Vec3f, 4>& corners, const SurfaceRef& surface) {
        const auto n = std::uint32_t(mesh_.positions.size());
        mesh_.positions.insert(mesh_.positions.end(), corners.begin(), corners.end());
        mesh_.triangles.push_back({n, n + 1, n + 2});
        mesh_.triangles.push_back({n, n + 2, n + 3});
        mesh_.face.insert(mesh_.face.end(), 2, surface);
    }
    [[nodiscard]] Vec3f point(Vec2i pixel, float depth) const {
        const Ray ray = cut_.view.ray(float(pixel.x), float(pixel.y));
        return ray.origin + ray.direction * (depth / ray.depth_per_t);
    }
    /// Depth at a corner of pixel (x, y): the mean of what the pixels around the corner that the
    /// slope joins make of it. On the chamfer each goes on with its own slope, so that squares
    /// at its edges lie in it as well.
    [[nodiscard]] float corner_depth(std::size_t level, int x, int y, int cx, int cy) const {
        const CutDepth own = depths_.at(level, x, y);
        float sum = 0;
        int n = 0;
        for (int py = cy - 1; py <= cy; ++py)
            for (int px = cx - 1; px <= cx; ++px) {
                const CutDepth d = depths_.at(level, px, py);
                if (d.depth == -kInfinity || is_cut_step(cut_.view, own, d)) continue;
                const CutProfile& p = cut_.levels[level](px, py);
                sum += d.chamfer ? sloped(p, -cut_.distance_at(float(cx), float(cy))) : d.depth;
                ++n;
            }
        return sum / float(n);
    }
    [[nodiscard]] bool is_clear(const SurfaceRef& s) const {
        const Mesh& mesh = scene_.mesh_of(s.part);
        return passes_light(scene_.materials[mesh.material_of(s.triangle)]);
    }

    const Cut& cut_;
    const TileDepths& depths_;
    const Scene& scene_;
    CapMesh& mesh_;
};

/// Rays of one tile: caps at its pixel centres, walls of its pixels.
class TileCaps {
public:
    TileCaps(const Bvh& bvh, const Cut& cut, const CappedLevels& capped, const Image<PartId>& targets, Caps& caps,
             CapMesh& mesh, Rect tile)
        : bvh_(bvh), cut_(cut), capped_(capped), targets_(targets), caps_(caps), depths_(cut, capped, tile),
          mesh_(cut, depths_, bvh.scene(), mesh) {}

    std::int64_t trace_block(Rect tile, int x0, int y0) {
        RayHit16 rays;
        float depth_per_t[kLanes] = {};
        std::int64_t n = 0;
        for (int i = 0; i < kLanes; ++i) {
            rays.clear(i);
            const int x = x0 + (i & 3), y = y0 + (i >> 2);
            if (!tile.contains(x, y) || cut_.distance.at_or(x, y, 1.0f) > 0) continue;
            if (targets_.at_or(x, y, kNoPart) != kNoPart) continue;
            const float depth = deepest_around(x, y);
            if (!(depth > 0) && !cut_.view.orthographic) continue;
            const Ray ray = cut_.view.ray(float(x) + 0.5f, float(y) + 0.5f);
            depth_per_t[i] = ray.depth_per_t;
            rays.set(i, ray.origin, ray.direction, 0, depth / ray.depth_per_t, capped_.mask);
            n += rays.active(i);
        }
        if (n == 0) return 0;
        find_passages(bvh_, cut_, capped_, caps_.solids, rays, passages_);
        for (int i = 0; i < kLanes; ++i) {
            const std::vector<Passage>& lane = passages_[std::size_t(i)];
            if (lane.empty()) continue;
            for (std::size_t k = 0; k < cut_.levels.size(); ++k)
                if (capped_.any[k]) store(lane, k, x0 + (i & 3), y0 + (i >> 2), depth_per_t[i]);
        }
        return n;
    }

    void add_squares(Rect tile, std::size_t level) {
        const Image<SurfaceRef>& cap = caps_.levels[level];
        constexpr int kBlock = 4;
        for (int by = tile.y0 & ~(kBlock - 1); by < tile.y1; by += kBlock)
            for (int bx = tile.x0 & ~(kBlock - 1); bx < tile.x1; bx += kBlock) {
                if (is_flat(level, bx, by, kBlock)) {
                    mesh_.add_flat(level, bx, by, kBlock, cap(bx, by));
                    continue;
                }
                for (int y = std::max(by, tile.y0); y < std::min(by + kBlock, tile.y1); ++y)
                    for (int x = std::max(bx, tile.x0); x < std::min(bx + kBlock, tile.x1); ++x)
                        if (cap(x, y).part != kNoPart) mesh_.add_pixel(level, x, y, cap(x, y));
            }
    }

private:
    static constexpr Vec2i kNeighbours[4] = {{1, 0}, {0, 1}, {-1, 0}, {0, -1}};

    /// How deep material must be known at a pixel: its own cut and those of its neighbours.
    [[nodiscard]] float deepest_around(int x, int y) const {
        float depth = -kInfinity;
        for (std::size_t k = 0; k < cut_.levels.size(); ++k) {
            if (!capped_.any[k]) continue;
            const CutDepth own = depths_.at(k, x, y);
            if (capped_.at(k, own.chamfer)) depth = std::max(depth, own.depth);
            if (!capped_.solids[k] || own.depth == -kInfinity) continue;
            for (const Vec2i d : kNeighbours) depth = std::max(depth, depths_.at(k, x + d.x, y + d.y).depth);
        }
        return depth;
    }

    void store(std::span<const Passage> lane, std::size_t level, int x, int y, float depth_per_t) {
        const CutDepth own = depths_.at(level, x, y);
        if (own.depth == -kInfinity) return;
        if (capped_.at(level, own.chamfer))
            caps_.levels[level](x, y) = cap_at(cut_, lane, level, own.depth / depth_per_t, own.chamfer, inside_);
        if (!capped_.solids[level]) return;
        for (const Vec2i d : kNeighbours) {
            const CutDepth other = depths_.at(level, x + d.x, y + d.y);
            if (!is_cut_step(cut_.view, own, other)) continue;
            // Seen from the deeper pixel the shallower one's material is a wall. Beyond the
            // opening nothing is cut: there this pixel's own material stands for the neighbour's.
            if (other.depth == -kInfinity)
                add_walls(lane, level, x, y, d, -kInfinity, own.depth, depth_per_t);
            else if (other.depth > own.depth)
                add_walls(lane, level, x, y, d, edge_depth(own, level, x, y, d), other.depth, depth_per_t);
        }
    }

    /// Where the cut of a pixel ends at its edge towards a neighbour.
    [[nodiscard]] float edge_depth(const CutDepth& own, std::size_t level, int x, int y, Vec2i d) const {
        if (!own.chamfer) return own.depth;
        const float ex = float(x) + 0.5f + 0.5f * float(d.x), ey = float(y) + 0.5f + 0.5f * float(d.y);
        return std::max(own.depth, sloped(cut_.levels[level](x, y), -cut_.distance_at(ex, ey)));
    }

    void add_walls(std::span<const Passage> lane, std::size_t level, int x, int y, Vec2i d, float near, float far,
                   float depth_per_t) {
        const Vec2i a = d.x != 0 ? Vec2i{x + (d.x > 0), y} : Vec2i{x, y + (d.y > 0)};
        const Vec2i b = d.x != 0 ? Vec2i{a.x, y + 1} : Vec2i{x + 1, a.y};
        const auto is_solid = [&](PartId part) { return cut_.cap_of(part) == CapRule::solid; };
        inside_.clear();
        float from = near;
        for (std::size_t i = 0; i <= lane.size(); ++i) {
            const float until = i < lane.size() ? std::min(far, lane[i].t * depth_per_t) : far;
            const SurfaceRef* surface = inside_.innermost(is_solid);
            if (surface && until > from) mesh_.add_wall(a, b, from, until, *surface);
            from = std::max(from, until);
            if (i == lane.size() || !(from < far)) break;
            if (cut_.level_of(lane[i].surface.part) == level) inside_.pass(lane[i]);
        }
    }

    /// Whether one quad is as good as one for every pixel of the block.
    [[nodiscard]] bool is_flat(std::size_t level, int bx, int by, int size) const {
        const Image<SurfaceRef>& cap = caps_.levels[level];
        const int last = size - 1;
        if (!cap.contains(bx, by) || !cap.contains(bx + last, by + last)) return false;
        const PartId part = cap(bx, by).part;
        if (part == kNoPart) return false;
        const float d00 = depths_.at(level, bx, by).depth, d10 = depths_.at(level, bx + last, by).depth;
        const float d01 = depths_.at(level, bx, by + last).depth;
        const float d11 = depths_.at(level, bx + last, by + last).depth;
        const float near = 0.5f * cut_.view.pixel_size(d00);
        for (int y = 0; y < size; ++y)
            for (int x = 0; x < size; ++x) {
                const CutDepth d = depths_.at(level, bx + x, by + y);
                if (cap(bx + x, by + y).part != part || d.chamfer) return false;
                const float u = float(x) / float(last), v = float(y) / float(last);
                const float plane = (d00 * (1 - u) + d10 * u) * (1 - v) + (d01 * (1 - u) + d11 * u) * v;
                if (!(std::abs(d.depth - plane) <= near)) return false;
            }
        return true;
    }

    const Bvh& bvh_;
    const Cut& cut_;
    const CappedLevels& capped_;
    const Image<PartId>& targets_;
    Caps& caps_;
    TileDepths depths_;
    TileMesh mesh_;
    Passages passages_;
    Inside inside_;
};

Rect hole_box(const Cut& cut) {
    const Rect w = cut.distance.window();
    Rect box{w.x1, w.y1, w.x0, w.y0};
    for (int y = w.y0; y < w.y1; ++y)
        for (int x = w.x0; x < w.x1; ++x)
            if (cut.distance(x, y) <= 0)
                box = {std::min(box.x0, x), std::min(box.y0, y), std::max(box.x1, x + 1), std::max(box.y1, y + 1)};
    return box.empty() ? Rect{} : box;
}

Mask even_pixels(const Image<SurfaceRef>& caps) {
    Mask even(caps.window(), 0);
    const Rect w = caps.window();
    for (int y = w.y0 + 1; y < w.y1 - 1; ++y)
        for (int x = w.x0 + 1; x < w.x1 - 1; ++x) {
            bool same = true;
            for (int dy = -1; dy <= 1; ++dy)
                for (int dx = -1; dx <= 1; ++dx) same &= caps(x + dx, y + dy).part == caps(x, y).part;
            even(x, y) = same;
        }
    return even;
}

void append(CapMesh& all, const CapMesh& piece) {
    const auto n = std::uint32_t(all.positions.size());
    all.positions.insert(all.positions.end(), piece.positions.begin(), piece.positions.end());
    for (const Vec3u t : piece.triangles) all.triangles.push_back({t.x + n, t.y + n, t.z + n});
    all.face.insert(all.face.end(), piece.face.begin(), piece.face.end());
}

} // namespace

Caps trace_caps(const Bvh& bvh, const Cut& cut, std::span<const MeshSolid> solids, const Image<PartId>& targets,
                const Control& control, std::int64_t* rays) {
    Caps caps;
    if (cut.empty()) return caps;
    const CappedLevels capped = capped_levels(bvh.scene(), cut, solids);
    const Rect box = hole_box(cut);
    if (capped.mask == 0 || box.empty()) return caps;
    caps.solids = solids;
    caps.capped = capped;
    caps.levels.assign(cut.levels.size(), Image<SurfaceRef>());
    for (std::size_t k = 0; k < cut.levels.size(); ++k)
        if (capped.any[k]) caps.levels[k] = Image<SurfaceRef>(box);

    // Tiles are multiples of their size apart, so their index follows from their corner.
    const auto cell = [](int v) { return v >> 6; };
    static_assert(kTile == 1 << 6);
    const int columns = cell(box.x1 - 1) - cell(box.x0) + 1, rows = cell(box.y1 - 1) - cell(box.y0) + 1;
    std::vector<CapMesh> pieces(std::size_t(columns) * std::size_t(rows));
    const auto piece_of = [&](Rect tile) -> CapMesh& {
        return pieces[std::size_t(cell(tile.y0) - cell(box.y0)) * std::size_t(columns) +
                      std::size_t(cell(tile.x0) - cell(box.x0))];
    };
    std::atomic<std::int64_t> traced{0};
    parallel_for_tiles(box, kTile, control, [&](Rect tile) {
        TileCaps work(bvh, cut, capped, targets, caps, piece_of(tile), tile);
        std::int64_t n = 0;
        for (int y = tile.y0 & ~3; y < tile.y1; y += 4)
            for (int x = tile.x0 & ~3; x < tile.x1; x += 4) n += work.trace_block(tile, x, y);
        for (std::size_t k = 0; k < cut.levels.size(); ++k)
            if (capped.any[k]) work.add_squares(tile, k);
        traced += n;
    });
    for (const CapMesh& piece : pieces) append(caps.mesh, piece);
    for (const Image<SurfaceRef>& level : caps.levels) caps.even.push_back(even_pixels(level));
    if (rays) *rays += traced;
    return caps;
}

} // namespace porthole
