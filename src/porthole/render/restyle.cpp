#include "porthole/render/restyle.h"

#include <array>
#include <atomic>

#include "porthole/render/linework.h"
#include "porthole/render/sampling.h"

namespace porthole {

namespace {

constexpr int kTile = 64;
constexpr float kSaturation = 0.55f, kTowardsPale = 0.25f;
constexpr Vec3f kPale{0.72f, 0.72f, 0.74f};
constexpr float kOutlineDark = 0.8f, kStepDark = 0.65f, kCreaseDark = 0.45f;

Vec4f dimmed(Vec4f c) {
    if (!(c.w > 0)) return c;
    const Vec3f color = lerp(saturated(Vec3f{c.x, c.y, c.z} / c.w, kSaturation), kPale, kTowardsPale) * c.w;
    return {color.x, color.y, color.z, c.w};
}

class Restyling {
public:
    Restyling(Frame& frame, const Drawn& drawn, const std::vector<std::uint8_t>& rest, Rest style)
        : frame_(frame), drawn_(drawn), camera_(drawn.bvh, drawn.targets, drawn.view, drawn.cut, drawn.caps),
          rest_(rest), style_(style), placements_(make_placements(drawn.bvh.scene())) {}

    void run(Rect tile) {
        RayCounts rays;
        Mask seen(tile.grown(1));
        look_at(seen, rays);
        for (int y = tile.y0; y < tile.y1; ++y)
            for (int x = tile.x0; x < tile.x1; ++x) {
                const float share = share_of(seen, x, y, rays);
                if (!(share > 0)) continue;
                Vec4f& c = frame_.color(x, y);
                const Vec4f to = style_ == Rest::dim ? dimmed(c) : Vec4f{};
                c = c * (1.0f - share) + to * share;
            }
        if (style_ == Rest::line) draw_lines(tile, rays);
        primary_ += rays.primary;
    }
    [[nodiscard]] std::int64_t primary() const { return primary_; }

private:
    [[nodiscard]] bool is_rest(PartId part) const { return part != kNoPart && rest_[index(part)]; }

    void look_at(Mask& seen, RayCounts& rays) const {
        const Rect w = seen.window();
        for (int by = w.y0; by < w.y1; by += 4)
            for (int bx = w.x0; bx < w.x1; bx += 4) {
                Samples16 samples;
                samples.at_centres = true;
                for (int i = 0; i < kLanes; ++i) {
                    const int x = bx + i % 4, y = by + i / 4;
                    samples.x[i] = float(x) + 0.5f, samples.y[i] = float(y) + 0.5f;
                    samples.active[i] = seen.contains(x, y);
                }
                const Seen16 s = look(camera_, samples, rays);
                for (int i = 0; i < kLanes; ++i)
                    if (samples.active[i]) seen(bx + i % 4, by + i / 4) = is_rest(s.hit[i].part) ? 1 : 0;
            }
    }

    /// Share of a pixel's samples that see the rest.
    float share_of(const Mask& seen, int x, int y, RayCounts& rays) const {
        const std::uint8_t centre = seen(x, y);
        bool edge = false;
        for (int dy = -1; dy <= 1; ++dy)
            for (int dx = -1; dx <= 1; ++dx) edge |= seen(x + dx, y + dy) != centre;
        // A pixel's share of background is in its alpha already.
        const int n = drawn_.params.samples;
        if (!edge || n == 1) return centre ? 1.0f : 0.0f;
        int rest = centre, other = 0;
        if (!centre) other = frame_.ids.id(x, y) != kNoPart;
        for (int s0 = 1; s0 < n; s0 += kLanes) {
            Samples16 samples;
            for (int i = 0; i < kLanes; ++i) {
                const Vec2f at = pixel_sample(s0 + i);
                samples.x[i] = float(x) + at.x, samples.y[i] = float(y) + at.y;
                samples.active[i] = s0 + i < n;
            }
            const Seen16 s = look(camera_, samples, rays);
            for (int i = 0; i < kLanes && s0 + i < n; ++i)
                (is_rest(s.hit[i].part) ? rest : other) += s.hit[i].any() ? 1 : 0;
        }
        return rest + other > 0 ? float(rest) / float(rest + other) : 0.0f;
    }

    void draw_lines(Rect tile, RayCounts& rays) {
        LineRules rules;
        rules.half_width = line_half_width(drawn_.view);
        rules.outline = kOutlineDark;
        rules.part = rules.step = kStepDark;
        rules.crease = kCreaseDark;
        rules.shy = true;
        rules.wanted = [&](const LineSample& nearer, const LineSample& farther) {
            const bool meet = farther.depth - nearer.depth < drawn_.view.pixel_size(nearer.depth);
            return is_rest(nearer.part) || (meet && is_rest(farther.part));
        };
        LineInk ink(tile);
        find_lines(
            drawn_.view, tile, [](int, int) { return true; }, camera_trace(camera_, placements_, rays), rules, ink);
        for (int y = tile.y0; y < tile.y1; ++y)
            for (int x = tile.x0; x < tile.x1; ++x) {
                float darkness = ink.shy.darkness(x, y);
                if (!(darkness > 0)) continue;
                if (drawn_.targets) {
                    const std::uint32_t targets = parts_on_target(camera_, x, y, rays);
                    darkness = 0;
                    for (int i = 0; i < Ink::kParts; ++i)
                        if (!(targets >> i & 1u)) darkness += ink.shy.part(x, y, i) * (1.0f / float(Ink::kParts));
                }
                frame_.color(x, y) = inked(frame_.color(x, y), darkness);
            }
    }

    Frame& frame_;
    const Drawn& drawn_;
    Camera camera_;
    const std::vector<std::uint8_t>& rest_;
    Rest style_;
    std::vector<Placement> placements_;
    std::atomic<std::int64_t> primary_{0};
};

} // namespace

void restyle(Frame& frame, const Drawn& drawn, const std::vector<std::uint8_t>& rest, Rest style,
             const Control& control) {
    if (style != Rest::dim && style != Rest::line) return;
    Restyling restyling(frame, drawn, rest, style);
    parallel_for_tiles(drawn.view.window(), kTile, control, [&](Rect tile) { restyling.run(tile); });
    frame.rays.primary += restyling.primary();
}

} // namespace porthole
