#include <array>
#include <atomic>

#include "porthole/render/linework.h"
#include "porthole/render/restyle.h"
#include "porthole/render/sampling.h"

namespace porthole {

namespace {

constexpr int kTile = 64;
constexpr float kClear = 0.10f, kDense = 0.62f; ///< of the veil, facing the eye and at grazing angles
constexpr float kPower = 2.2f;                  ///< how late it gets dense
constexpr Vec3f kPale{0.50f, 0.53f, 0.57f};     ///< what its colours tend to
constexpr float kPaleShare = 0.35f;
constexpr float kStep = 0.06f;    ///< of the veil's density between pixels, from which on one sample is not enough
constexpr int kLayers = 2;        ///< parts behind each other that are drawn
constexpr int kMostSurfaces = 12; ///< of one part that a ray passes to find the next
constexpr float kBehind = 0.55f;  ///< how much of the second layer is drawn
constexpr float kOutlineDark = 0.6f, kStepDark = 0.45f, kCreaseDark = 0.35f;

/// The shell as one sample sees it.
struct Veil {
    PartId part = kNoPart; ///< none: not seen
    PartId behind = kNoPart;
    float depth = kInfinity;
    bool on_target = false;
    Vec4f color; ///< premultiplied
};

class Shell {
public:
    Shell(Frame& frame, const Drawn& drawn, const Bvh& shell)
        : frame_(frame), shell_(shell), view_(drawn.view),
          solids_(drawn.bvh, drawn.targets, view_, drawn.cut, drawn.caps), params_(drawn.params), scene_(shell.scene()),
          placements_(make_placements(scene_)), tolerance_(float(1e-6 * scene_bounds(scene_).diagonal())) {}

    void lay(Rect tile) {
        RayCounts rays;
        const Rect around = tile.grown(1);
        Image<Veil> veil(around);
        bool any = false;
        for (int by = around.y0; by < around.y1; by += 4)
            for (int bx = around.x0; bx < around.x1; bx += 4) any |= look_at_block(bx, by, veil, rays);
        if (any) {
            for (int y = tile.y0; y < tile.y1; ++y)
                for (int x = tile.x0; x < tile.x1; ++x) lay_pixel(veil, x, y, rays);
            if (params_.lines != Lines::none) lay_lines(tile, veil, rays);
        }
        primary_ += rays.primary;
    }
    [[nodiscard]] std::int64_t primary() const { return primary_; }

private:
    /// The first surface of a part along a ray.
    struct ShellHit {
        Hit hit;
        Vec3f direction;
        float depth = kInfinity;
    };
    /// By part that the ray meets, then by lane.
    using ShellHits = std::array<std::array<ShellHit, kLanes>, kLayers>;

    /// What rays meet of the shell, up to `count` parts behind each other, before `nearer_than`.
    [[nodiscard]] ShellHits find_layers(const Samples16& samples, const float (&nearer_than)[kLanes], int count,
                                        RayCounts& rays) const {
        ShellHits hits;
        RayHit16 packet;
        float tnear[kLanes] = {}, depth_per_t[kLanes];
        PartId last[kLanes];
        bool open[kLanes];
        for (int i = 0; i < kLanes; ++i) {
            open[i] = samples.active[i];
            last[i] = kNoPart;
        }
        int found[kLanes] = {};
        for (int step = 0; step < kMostSurfaces; ++step) {
            bool any = false;
            for (int i = 0; i < kLanes; ++i) {
                packet.clear(i);
                if (!open[i]) continue;
                const Ray ray = view_.ray(samples.x[i], samples.y[i]);
                depth_per_t[i] = ray.depth_per_t;
                packet.set(i, ray.origin, ray.direction, tnear[i], kInfinity);
                any = true;
                ++rays.primary;
            }
            if (!any) break;
            intersect(shell_, packet, Coherence::coherent);
            for (int i = 0; i < kLanes; ++i) {
                if (!open[i]) continue;
                const float depth = packet.tfar[i] * depth_per_t[i];
                open[i] = packet.hit(i) && depth < nearer_than[i] - tolerance_;
                if (!open[i]) continue;
                tnear[i] = packet.tfar[i] * (1 + 4e-6f) + placements_[index(packet.part(i))].offset;
                if (packet.part(i) == last[i]) continue;
                last[i] = packet.part(i);
                hits[std::size_t(found[i])][std::size_t(i)] = {
                    {packet.part(i), packet.triangle[i], packet.u[i], packet.v[i]}, packet.direction(i), depth};
                open[i] = ++found[i] < count;
            }
        }
        return hits;
    }

    void look(const Samples16& samples, Veil* out, RayCounts& rays) const {
        const Seen16 solid = porthole::look(solids_, samples, rays);
        const ShellHits hits = find_layers(samples, solid.depth, kLayers, rays);
        for (std::size_t i = 0; i < kLanes; ++i) {
            if (!samples.active[i]) continue;
            const ShellHit &first = hits[0][i], &second = hits[1][i];
            Veil& v = out[i];
            v = {first.hit.part, second.hit.part, first.depth, solid.on_target[i], {}};
            if (v.on_target || !first.hit.any()) continue;
            v.color = veil_color(first);
            if (second.hit.any()) v.color = v.color + veil_color(second) * (kBehind * (1.0f - v.color.w));
        }
    }

    [[nodiscard]] Vec4f veil_color(const ShellHit& seen) const {
        const Placement& placement = placements_[index(seen.hit.part)];
        const SurfacePoint point = surface_point(placement, seen.hit, seen.direction);
        const Substance s = substance(scene_, placement, seen.hit);
        const float facing = clamp01(-dot(point.normal, seen.direction));
        const float density = kClear + (kDense - kClear) * std::pow(1.0f - facing, kPower);
        // Lit from the upper left, so that the shell has a form of its own.
        const Affine3f& camera = view_.world_from_camera;
        const float lit = 0.5f + 0.5f * dot(point.normal, normalize(camera.vector({-0.35f, 0.5f, 1.0f})));
        const Vec3f base = min(max(s.color, Vec3f{0.05f, 0.05f, 0.05f}), Vec3f{0.85f, 0.85f, 0.85f});
        const Vec3f color = lerp(base, kPale, kPaleShare) * (0.55f + 0.45f * lit);
        return {color.x * density, color.y * density, color.z * density, density};
    }

    bool look_at_block(int bx, int by, Image<Veil>& veil, RayCounts& rays) const {
        Samples16 samples;
        samples.at_centres = true;
        for (int i = 0; i < kLanes; ++i) {
            const int x = bx + i % 4, y = by + i / 4;
            samples.x[i] = float(x) + 0.5f, samples.y[i] = float(y) + 0.5f;
            samples.active[i] = veil.contains(x, y);
        }
        std::array<Veil, kLanes> seen;
        look(samples, seen.data(), rays);
        bool any = false;
        for (int i = 0; i < kLanes; ++i) {
            if (!samples.active[i]) continue;
            veil(bx + i % 4, by + i / 4) = seen[std::size_t(i)];
            any |= seen[std::size_t(i)].part != kNoPart;
        }
        return any;
    }

    [[nodiscard]] static bool differ(const Veil& a, const Veil& b) {
        return a.part != b.part || a.behind != b.behind || a.on_target != b.on_target ||
               std::abs(a.color.w - b.color.w) > kStep;
    }

    void lay_pixel(const Image<Veil>& veil, int x, int y, RayCounts& rays) {
        const Veil& centre = veil(x, y);
        if (frame_.ids.id(x, y) == kNoPart && centre.part != kNoPart) {
            frame_.ids.id(x, y) = centre.part;
            frame_.ids.depth(x, y) = centre.depth;
        }
        Vec4f color = centre.color;
        const bool edge = differ(centre, veil(x - 1, y)) || differ(centre, veil(x + 1, y)) ||
                          differ(centre, veil(x, y - 1)) || differ(centre, veil(x, y + 1));
        if (edge && params_.samples > 1) {
            for (int s0 = 1; s0 < params_.samples; s0 += kLanes) {
                Samples16 samples;
                for (int i = 0; i < kLanes; ++i) {
                    const Vec2f at = pixel_sample(s0 + i);
                    samples.x[i] = float(x) + at.x, samples.y[i] = float(y) + at.y;
                    samples.active[i] = s0 + i < params_.samples;
                }
                std::array<Veil, kLanes> seen;
                look(samples, seen.data(), rays);
                for (int i = 0; i < kLanes && s0 + i < params_.samples; ++i) color = color + seen[std::size_t(i)].color;
            }
            color = color * (1.0f / float(params_.samples));
        }
        if (color.w > 0) frame_.color(x, y) = color + frame_.color(x, y) * (1.0f - color.w);
    }

    void trace_lines(std::size_t layer, const Samples16& samples, LineSample* out, RayCounts& rays) const {
        const Seen16 solid = porthole::look(solids_, samples, rays);
        float everywhere[kLanes];
        for (float& depth : everywhere) depth = kInfinity;
        const ShellHits hits = find_layers(samples, everywhere, int(layer) + 1, rays);
        for (std::size_t i = 0; i < kLanes; ++i) {
            if (!samples.active[i]) continue;
            LineSample& s = out[i];
            s = {};
            const ShellHit& seen = hits[layer][i];
            if (!seen.hit.any()) continue;
            // What is solid has edges of its own.
            s.masked = !(seen.depth < solid.depth[i] - tolerance_);
            if (s.masked) continue;
            const SurfacePoint point = surface_point(placements_[index(seen.hit.part)], seen.hit, seen.direction);
            s.part = seen.hit.part;
            s.depth = seen.depth;
            s.position = point.position;
            s.normal = point.normal;
            s.flat_normal = point.flat_normal;
        }
    }

    void lay_lines(Rect tile, const Image<Veil>& veil, RayCounts& rays) {
        LineInk ink(tile);
        for (std::size_t layer = 0; layer < kLayers; ++layer) {
            const LineTrace trace = [&](const Samples16& samples, LineSample* out) {
                trace_lines(layer, samples, out, rays);
            };
            const float strength = layer == 0 ? 1.0f : kBehind;
            LineRules rules;
            rules.half_width = line_half_width(view_);
            rules.outline = kOutlineDark * strength;
            rules.part = rules.step = kStepDark * strength;
            rules.crease = kCreaseDark * strength;
            rules.shy = true;
            find_lines(
                view_, tile, [](int, int) { return true; }, trace, rules, ink);
        }
        for (int y = tile.y0; y < tile.y1; ++y)
            for (int x = tile.x0; x < tile.x1; ++x) {
                float darkness = ink.shy.darkness(x, y);
                if (!(darkness > 0)) continue;
                bool near_target = false;
                for (int dy = -1; dy <= 1; ++dy)
                    for (int dx = -1; dx <= 1; ++dx) near_target |= veil(x + dx, y + dy).on_target;
                if (near_target) {
                    const std::uint32_t targets = parts_on_target(solids_, x, y, rays);
                    darkness = 0;
                    for (int i = 0; i < Ink::kParts; ++i)
                        if (!(targets >> i & 1u)) darkness += ink.shy.part(x, y, i) * (1.0f / float(Ink::kParts));
                }
                frame_.color(x, y) = inked(frame_.color(x, y), darkness);
            }
    }

    Frame& frame_;
    const Bvh& shell_;
    const View& view_;
    Camera solids_;
    const RenderParams& params_;
    const Scene& scene_;
    std::vector<Placement> placements_;
    float tolerance_;
    std::atomic<std::int64_t> primary_{0};
};

} // namespace

void lay_shell(Frame& frame, const Drawn& drawn, const Bvh& shell, const Control& control) {
    Shell drawing(frame, drawn, shell);
    parallel_for_tiles(drawn.view.window(), kTile, control, [&](Rect tile) { drawing.lay(tile); });
    frame.rays.primary += drawing.primary();
}

} // namespace porthole
