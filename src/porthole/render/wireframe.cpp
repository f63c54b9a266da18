#include "porthole/render/wireframe.h"

#include <algorithm>
#include <new>

#include "porthole/render/lines.h"
#include "porthole/render/linework.h"
#include "porthole/scene/closed.h"
#include "porthole/trace/visibility.h"

namespace porthole {

namespace {

constexpr float kLongEdge = 8;                   ///< pixels; meshes of longer edges are drawn as they are
constexpr double kFlatCosine = 0.966;            ///< 15 degrees; what bends less is no crease
constexpr double kSharpCosine = 0.866;           ///< 30 degrees; creases where there are no vertex normals
constexpr double kAlwaysCosine = 0.5;            ///< 60 degrees; creases whatever the vertex normals say
constexpr float kSplitCosine = 0.966f;           ///< vertex normals that differ more mean a crease
constexpr float kHides = 1.0f / 3.0f;            ///< pixel sizes in front of an edge from which on a surface hides it
constexpr float kVisible = 0.9f, kHidden = 0.5f; ///< darkness
constexpr float kFeatureWidth = 1.25f;           ///< of width_px
constexpr float kDash = 6;                       ///< pixels
constexpr int kLayers = 4;                       ///< surfaces of a primitive behind each other whose lines are dashed
constexpr int kTile = 64;
constexpr std::size_t kChunk = 4096; ///< edges that one thread takes at once

/// An edge of a welded mesh.
struct MeshEdge {
    enum Kind : std::uint8_t { odd, joined, turned }; ///< turned: joined, the triangles facing different ways

    std::uint32_t triangle[2] = {0, 0};
    std::uint32_t a[2] = {0, 0}, b[2] = {0, 0}; ///< vertices of its ends in either triangle
    Kind kind = odd;
};

std::vector<MeshEdge> mesh_edges(const Mesh& mesh) {
    struct Side {
        std::uint32_t low, high; ///< welded vertices
        std::uint32_t triangle, corner;
        bool forward;
    };
    const std::vector<std::uint32_t> vertex = weld(mesh.positions);
    std::vector<Side> sides;
    sides.reserve(mesh.triangles.size() * 3);
    for (std::uint32_t i = 0; i < mesh.triangles.size(); ++i) {
        const Vec3u& t = mesh.triangles[i];
        const std::uint32_t corner[3] = {vertex[t.x], vertex[t.y], vertex[t.z]};
        if (corner[0] == corner[1] || corner[1] == corner[2] || corner[2] == corner[0]) continue;
        for (std::uint32_t k = 0; k < 3; ++k) {
            const std::uint32_t a = corner[k], b = corner[(k + 1) % 3];
            sides.push_back({std::min(a, b), std::max(a, b), i, k, a < b});
        }
    }
    std::sort(sides.begin(), sides.end(), [](const Side& x, const Side& y) {
        return std::tie(x.low, x.high, x.triangle) < std::tie(y.low, y.high, y.triangle);
    });
    std::vector<MeshEdge> edges;
    for (std::size_t i = 0; i < sides.size();) {
        std::size_t end = i + 1;
        while (end < sides.size() && sides[end].low == sides[i].low && sides[end].high == sides[i].high) ++end;
        MeshEdge edge;
        for (std::size_t k = 0; k < 2; ++k) {
            const Side& side = sides[k == 0 ? i : end - 1];
            const Vec3u& t = mesh.triangles[side.triangle];
            const std::uint32_t corner[3] = {t.x, t.y, t.z};
            const std::uint32_t from = corner[side.corner], to = corner[(side.corner + 1) % 3];
            edge.triangle[k] = side.triangle;
            edge.a[k] = side.forward ? from : to, edge.b[k] = side.forward ? to : from;
        }
        if (end == i + 2) edge.kind = sides[i].forward != sides[i + 1].forward ? MeshEdge::joined : MeshEdge::turned;
        edges.push_back(edge);
        i = end;
    }
    return edges;
}

struct Edge {
    Vec3f a, b; ///< world
};

/// Of two triangles that an edge joins, whether the edge is an outline or a crease.
class FeatureTest {
public:
    FeatureTest(const Part& part, const Mesh& mesh, const View& view)
        : mesh_(mesh), transform_(part.world_from_mesh), view_(view), eye_(view.eye()), forward_(view.forward()) {}

    [[nodiscard]] bool operator()(const MeshEdge& edge) const {
        if (edge.kind == MeshEdge::odd) return true;
        const Vec3d n = normal(edge.triangle[0]);
        const Vec3d m = normal(edge.triangle[1]) * (edge.kind == MeshEdge::turned ? -1.0 : 1.0);
        const double nn = dot(n, n), mm = dot(m, m);
        if (!(nn > 0) || !(mm > 0)) return false;
        if (is_crease(edge, dot(n, m) / std::sqrt(nn * mm))) return true;
        const Vec3d p = transform_.point(Vec3d(mesh_.positions[edge.a[0]]));
        const Vec3d sight = view_.orthographic ? forward_ : p - eye_;
        return (dot(n, sight) < 0) != (dot(m, sight) < 0);
    }

private:
    /// Vertex normals tell a rounded edge from a sharp one.
    [[nodiscard]] bool is_crease(const MeshEdge& edge, double cosine) const {
        if (cosine > kFlatCosine) return false;
        if (cosine < kAlwaysCosine) return true;
        if (mesh_.normals.empty()) return cosine < kSharpCosine;
        const auto split = [&](const std::uint32_t(&vertex)[2]) {
            return std::abs(dot(mesh_.normals[vertex[0]], mesh_.normals[vertex[1]])) < kSplitCosine;
        };
        return split(edge.a) && split(edge.b);
    }
    [[nodiscard]] Vec3d normal(std::uint32_t triangle) const {
        const Vec3u& t = mesh_.triangles[triangle];
        const Vec3d a = transform_.point(Vec3d(mesh_.positions[t.x]));
        return cross(transform_.point(Vec3d(mesh_.positions[t.y])) - a,
                     transform_.point(Vec3d(mesh_.positions[t.z])) - a);
    }
    const Mesh& mesh_;
    Affine3d transform_;
    const View& view_;
    Vec3d eye_, forward_;
};

/// The stretch of an edge that the picture shows.
struct Projected {
    Vec2f a, b;
    float inverse_depth_a = 0, inverse_depth_b = 0; ///< orthographic: depth
    bool any = false;
    [[nodiscard]] float length() const { return std::sqrt(dot(b - a, b - a)); }
};

Projected project(const View& view, const Edge& edge, float nearest, int margin) {
    const Affine3f& c = view.world_from_camera;
    const auto depth = [&](Vec3f p) { return -dot(p - c.p, c.z); };
    Vec3f a = edge.a, b = edge.b;
    const float za = depth(a), zb = depth(b);
    Projected out;
    if (!(za > nearest) && !(zb > nearest)) return out;
    if (!(za > nearest)) a = lerp(b, a, (zb - nearest) / (zb - za));
    if (!(zb > nearest)) b = lerp(a, b, (za - nearest) / (za - zb));
    const PixelPoint pa = view.project(a), pb = view.project(b);
    // Liang and Barsky's clipping to the picture and a margin.
    double t0 = 0, t1 = 1;
    const double dx = double(pb.x) - double(pa.x), dy = double(pb.y) - double(pa.y);
    const auto clip = [&](double p, double q) {
        if (p == 0) return q >= 0;
        const double r = q / p;
        if (p < 0)
            t0 = std::max(t0, r);
        else
            t1 = std::min(t1, r);
        return t0 < t1;
    };
    const double m = margin;
    if (!clip(-dx, double(pa.x) + m) || !clip(dx, view.width + m - double(pa.x)) || !clip(-dy, double(pa.y) + m) ||
        !clip(dy, view.height + m - double(pa.y)))
        return out;
    const auto of_depth = [&](float z) { return view.orthographic ? z : 1.0f / z; };
    const float da = of_depth(std::max(pa.depth, nearest)), db = of_depth(std::max(pb.depth, nearest));
    out.a = {float(double(pa.x) + dx * t0), float(double(pa.y) + dy * t0)};
    out.b = {float(double(pa.x) + dx * t1), float(double(pa.y) + dy * t1)};
    out.inverse_depth_a = da + (db - da) * float(t0);
    out.inverse_depth_b = da + (db - da) * float(t1);
    out.any = true;
    return out;
}

/// Asks along edges what is seen of them.
class EdgeSight {
public:
    EdgeSight(const Bvh& bvh, const View& view, RayCounts& rays) : bvh_(bvh), view_(view), rays_(rays) {}

    /// Whether each of some stretches of equal length is visible.
    std::vector<std::uint8_t> look(const Projected& p) {
        const auto n = std::size_t(std::clamp(std::ceil(p.length()), 1.0f, 65536.0f));
        std::vector<std::uint8_t> seen(n);
        for (std::size_t begin = 0; begin < n; begin += kLanes) {
            RayHit16 packet;
            for (std::size_t i = 0; i < kLanes; ++i) {
                if (begin + i >= n) {
                    packet.clear(int(i));
                    continue;
                }
                const float t = (float(begin + i) + 0.5f) / float(n);
                const Vec2f at = p.a + (p.b - p.a) * t;
                const float d = p.inverse_depth_a + (p.inverse_depth_b - p.inverse_depth_a) * t;
                const float depth = view_.orthographic ? d : 1.0f / d;
                const float hidden_from = depth - std::max(kHides * view_.pixel_size(depth), 4e-6f * depth);
                const Ray ray = view_.ray(at.x, at.y);
                packet.set(int(i), ray.origin, ray.direction, 0, std::max(0.0f, hidden_from) / ray.depth_per_t);
                ++rays_.primary;
            }
            occluded_by_any(bvh_, packet);
            for (std::size_t i = 0; i < kLanes && begin + i < n; ++i) seen[begin + i] = packet.tfar[i] >= 0;
        }
        // A single stretch that differs from both neighbours touches something by rounding.
        for (std::size_t i = 1; i + 1 < n; ++i)
            if (seen[i - 1] == seen[i + 1]) seen[i] = seen[i - 1];
        return seen;
    }

private:
    const Bvh& bvh_;
    const View& view_;
    RayCounts& rays_;
};

struct WireStroke {
    Stroke stroke;
    bool dashed = false;
};

void add_strokes(const Projected& p, const std::vector<std::uint8_t>& seen, float half_width, bool dashes,
                 std::vector<WireStroke>& out) {
    const float n = float(seen.size());
    for (std::size_t i = 0; i < seen.size();) {
        std::size_t end = i + 1;
        while (end < seen.size() && seen[end] == seen[i]) ++end;
        if (seen[i] || dashes) {
            const float dark = seen[i] ? kVisible : kHidden;
            out.push_back({{p.a + (p.b - p.a) * (float(i) / n), p.a + (p.b - p.a) * (float(end) / n),
                            seen[i] ? half_width : 0.75f * half_width, dark, dark},
                           !seen[i]});
        }
        i = end;
    }
}

/// The edges of all parts, in the order of the parts and their meshes.
struct Edges {
    std::vector<std::vector<Edge>> by_part;
    [[nodiscard]] std::vector<Edge> joined() const {
        std::vector<Edge> all;
        std::size_t n = 0;
        for (const auto& edges : by_part) n += edges.size();
        all.reserve(n);
        for (const auto& edges : by_part) all.insert(all.end(), edges.begin(), edges.end());
        return all;
    }
};

class Wireframe {
public:
    Wireframe(const MeshBvhs& meshes, std::span<const PartId> parts, const View& view, const WireParams& params,
              Vec3f background, const Control& control)
        : meshes_(meshes), bvh_(build_bvh(meshes, parts)), scene_(meshes.scene()), view_(view), params_(params),
          background_(background), control_(control),
          half_width_(0.5f * kFeatureWidth * params.width_px * line_scale(view)),
          margin_(int(std::ceil(half_width_)) + 2), nearest_(float(1e-6 * scene_bounds(scene_).diagonal())) {}

    Frame draw() {
        Frame frame;
        frame.color = Image<Vec4f>(view_.window(), Vec4f{});
        frame.ids = trace_ids(bvh_, view_, view_.window(), control_, &frame.rays.primary);
        progress(0.1);
        find_strokes();
        progress(0.5);
        placements_ = make_placements(scene_);
        find_primitives();
        bin();
        parallel_for(std::size_t(columns_) * std::size_t(rows_), control_, [&](std::size_t i) {
            const int x = int(i) % columns_ * kTile, y = int(i) / columns_ * kTile;
            draw_tile(Rect{x, y, x + kTile, y + kTile}.intersected(view_.window()), bins_[i], frame);
        });
        progress(1);
        frame.rays.primary += rays_.load();
        return frame;
    }

private:
    void progress(double share) const {
        if (control_.progress) control_.progress("render", share);
    }

    void find_strokes() {
        std::vector<std::vector<MeshEdge>> of_mesh(scene_.meshes.size());
        std::vector<std::uint8_t> used(scene_.meshes.size(), 0);
        for (const PartId id : all_parts(scene_))
            if (bvh_.holds(id)) used[scene_.parts[index(id)].mesh] = 1;
        parallel_for(of_mesh.size(), control_, [&](std::size_t i) {
            if (used[i]) of_mesh[i] = mesh_edges(scene_.meshes[i]);
        });
        const bool all = params_.wire == Wire::mesh || (params_.wire != Wire::feature &&
                                                        params_.hidden == HiddenLines::none && edges_are_long(of_mesh));
        half_width_ = 0.5f * line_scale(view_) * (all ? 1.0f : kFeatureWidth) * params_.width_px;
        Edges edges;
        edges.by_part.resize(scene_.parts.size());
        parallel_for(scene_.parts.size(), control_, [&](std::size_t i) {
            if (!bvh_.holds(PartId(std::uint32_t(i)))) return;
            const Part& part = scene_.parts[i];
            const Mesh& mesh = scene_.meshes[part.mesh];
            const FeatureTest is_feature(part, mesh, view_);
            for (const MeshEdge& edge : of_mesh[part.mesh])
                if (all || is_feature(edge)) edges.by_part[i].push_back(in_world(part, mesh, edge));
        });
        const std::vector<Edge> list = edges.joined();
        const std::size_t chunks = (list.size() + kChunk - 1) / kChunk;
        std::vector<std::vector<WireStroke>> found(chunks);
        parallel_for(chunks, control_, [&](std::size_t c) {
            RayCounts rays;
            EdgeSight sight(bvh_, view_, rays);
            for (std::size_t i = c * kChunk; i < std::min(list.size(), (c + 1) * kChunk); ++i) {
                const Projected p = project(view_, list[i], nearest_, margin_);
                if (p.any) add_strokes(p, sight.look(p), half_width_, params_.hidden == HiddenLines::dashed, found[c]);
            }
            rays_ += rays.primary;
        });
        for (const auto& part : found) strokes_.insert(strokes_.end(), part.begin(), part.end());
    }

    [[nodiscard]] static Edge in_world(const Part& part, const Mesh& mesh, const MeshEdge& edge) {
        return {Vec3f(part.world_from_mesh.point(Vec3d(mesh.positions[edge.a[0]]))),
                Vec3f(part.world_from_mesh.point(Vec3d(mesh.positions[edge.b[0]])))};
    }

    /// Whether the edges in the picture are long enough to be told apart. Looks at some thousands.
    [[nodiscard]] bool edges_are_long(const std::vector<std::vector<MeshEdge>>& of_mesh) const {
        std::size_t total = 0;
        for (const Part& part : scene_.parts) total += of_mesh[part.mesh].size();
        const std::size_t stride = std::max<std::size_t>(1, total / 20000);
        double sum = 0;
        std::int64_t n = 0;
        std::size_t skip = 0;
        for (std::uint32_t i = 0; i < scene_.parts.size(); ++i) {
            const Part& part = scene_.parts[i];
            const auto& edges = of_mesh[part.mesh];
            if (!bvh_.holds(PartId(i))) continue;
            for (; skip < edges.size(); skip += stride) {
                const Projected p = project(view_, in_world(part, scene_.meshes[part.mesh], edges[skip]), nearest_, 0);
                if (p.any) sum += double(p.length()), ++n;
            }
            skip -= edges.size();
        }
        return n > 0 && sum / double(n) >= double(kLongEdge);
    }

    struct Primitive {
        PartId part;
        Bvh alone;
        Rect box; ///< pixels that its projected box touches
    };

    void find_primitives() {
        for (const PartId id : all_parts(scene_)) {
            if (!bvh_.holds(id) || scene_.mesh_of(id).primitives.empty()) continue;
            Primitive primitive{id, build_bvh(meshes_, std::span(&id, 1)), view_.window()};
            const Bounds3d bounds = part_bounds(scene_, id);
            float x0 = kInfinity, y0 = kInfinity, x1 = -kInfinity, y1 = -kInfinity;
            bool behind = false;
            for (int i = 0; i < 8; ++i) {
                const PixelPoint p = view_.project(Vec3f(bounds.corner(i)));
                behind |= !(p.depth > nearest_);
                x0 = std::min(x0, p.x), y0 = std::min(y0, p.y), x1 = std::max(x1, p.x), y1 = std::max(y1, p.y);
            }
            const auto rounded = [](float v) { return int(std::floor(std::clamp(v, -1e6f, 1e6f))); };
            if (!behind)
                primitive.box = Rect{rounded(x0), rounded(y0), rounded(x1) + 1, rounded(y1) + 1}.grown(2).intersected(
                    view_.window());
            primitives_.push_back(std::move(primitive));
        }
    }

    void bin() {
        columns_ = (view_.width + kTile - 1) / kTile, rows_ = (view_.height + kTile - 1) / kTile;
        bins_.resize(std::size_t(columns_) * std::size_t(rows_));
        for (std::uint32_t i = 0; i < strokes_.size(); ++i) {
            const Stroke& s = strokes_[i].stroke;
            const float reach = s.half_width + 1;
            const auto tile_of = [](float v, int n) { return std::clamp(int(std::floor(v / float(kTile))), 0, n - 1); };
            const int x0 = tile_of(std::min(s.a.x, s.b.x) - reach, columns_),
                      x1 = tile_of(std::max(s.a.x, s.b.x) + reach, columns_);
            const int y0 = tile_of(std::min(s.a.y, s.b.y) - reach, rows_),
                      y1 = tile_of(std::max(s.a.y, s.b.y) + reach, rows_);
            for (int y = y0; y <= y1; ++y)
                for (int x = x0; x <= x1; ++x) bins_[std::size_t(y * columns_ + x)].push_back(i);
        }
    }

    void draw_tile(Rect tile, const std::vector<std::uint32_t>& bin, Frame& frame) {
        LineInk ink(tile);
        for (const std::uint32_t i : bin) {
            if (strokes_[i].dashed)
                ink.open.add_dashed(strokes_[i].stroke, kDash * line_scale(view_));
            else
                ink.open.add(strokes_[i].stroke);
        }
        if (!primitives_.empty()) draw_primitives(tile, ink);
        if (params_.hidden == HiddenLines::dashed)
            for (const Primitive& primitive : primitives_) draw_hidden(primitive, tile, ink);
        const Vec3f b = background_;
        const float light = 0.2126f * b.x + 0.7152f * b.y + 0.0722f * b.z < 0.18f ? 0.9f : 0.02f;
        for (int y = tile.y0; y < tile.y1; ++y)
            for (int x = tile.x0; x < tile.x1; ++x) {
                const float d = ink.open.darkness(x, y);
                frame.color(x, y) = {light * d, light * d, light * d, d};
            }
    }

    void draw_primitives(Rect tile, LineInk& ink) {
        const auto is_primitive = [&](const LineSample& s) {
            return s.part != kNoPart && !scene_.mesh_of(s.part).primitives.empty();
        };
        RayCounts rays;
        LineRules rules;
        rules.half_width = half_width_;
        rules.outline = rules.part = rules.step = rules.crease = kVisible;
        rules.wanted = [&](const LineSample& nearer, const LineSample& farther) {
            return is_primitive(nearer) ||
                   (is_primitive(farther) && farther.depth - nearer.depth < view_.pixel_size(nearer.depth));
        };
        const auto everywhere = [](int, int) { return true; };
        find_lines(view_, tile, everywhere, plain_trace(bvh_, view_, placements_, rays), rules, ink);
        rays_ += rays.primary;
    }

    /// The dashed lines of one primitive: what rays meet of it alone, surface after surface, except
    /// what is seen.
    void draw_hidden(const Primitive& primitive, Rect tile, LineInk& ink) {
        if (primitive.box.grown(2).intersected(tile).empty()) return;
        const Rect near = primitive.box.grown(4);
        const auto inside = [&](int x, int y) { return near.contains(x, y); };
        RayCounts rays;
        LineRules rules;
        rules.half_width = 0.75f * half_width_;
        rules.outline = rules.part = rules.step = rules.crease = kHidden;
        rules.dash_px = kDash * line_scale(view_);
        for (int layer = 0; layer < kLayers; ++layer) {
            const LineTrace trace = [&](const Samples16& samples, LineSample* out) {
                look_through(primitive, layer, samples, out, rays);
            };
            find_lines(view_, tile, inside, trace, rules, ink);
        }
        rays_ += rays.primary;
    }

    /// The surface of a primitive that a ray meets after `layer` others of it.
    void look_through(const Primitive& primitive, int layer, const Samples16& samples, LineSample* out,
                      RayCounts& rays) const {
        const LineTrace alone = plain_trace(primitive.alone, view_, placements_, rays, layer);
        alone(samples, out);
        if (layer > 0) return;
        std::array<LineSample, kLanes> seen;
        plain_trace(bvh_, view_, placements_, rays)(samples, seen.data());
        for (std::size_t i = 0; i < kLanes; ++i)
            if (samples.active[i] && out[i].part != kNoPart)
                out[i].masked = out[i].depth <= seen[i].depth + kHides * view_.pixel_size(seen[i].depth);
    }

    const MeshBvhs& meshes_;
    const Bvh bvh_;
    const Scene& scene_;
    const View& view_;
    const WireParams& params_;
    Vec3f background_;
    const Control& control_;
    float half_width_;
    int margin_;
    float nearest_;
    std::vector<WireStroke> strokes_;
    std::vector<Primitive> primitives_;
    std::vector<Placement> placements_;
    int columns_ = 0, rows_ = 0;
    std::vector<std::vector<std::uint32_t>> bins_; ///< strokes by tile
    std::atomic<std::int64_t> rays_{0};
};

} // namespace

Frame render_wireframe(const MeshBvhs& meshes, std::span<const PartId> parts, const View& view,
                       const WireParams& params, Vec3f background, const Control& control) {
    if (!(params.width_px > 0) || !(params.width_px <= 100))
        throw Error(ErrorKind::usage, "E0140", "width_px", "outside 0..100");
    try {
        return Wireframe(meshes, parts, view, params, background, control).draw();
    } catch (const std::bad_alloc&) {
        throw Error(ErrorKind::limit, "E0902", "render",
                    "memory ran out for a wireframe of " + std::to_string(view.width) + " x " +
                        std::to_string(view.height));
    }
}

} // namespace porthole
