#include "porthole/render/linework.h"

namespace porthole {

namespace {

constexpr float kRimDark = 0.75f, kInnerDark = 0.5f;
constexpr float kOutlineDark = 0.6f, kStepDark = 0.45f, kMeetDark = 0.3f;
constexpr float kHalfWidth = 0.5f; ///< pixels, up to 1080 px of height
constexpr float kBridged = 0.005f; ///< half the gaps that the rim's line bridges, of the picture's height

/// 1 within `reach` pixels, along rows and columns, of a 1.
Mask widened(const Mask& mask, int reach) {
    const Rect w = mask.window();
    Mask rows(w), out(w);
    const auto spread = [reach](auto read, auto write, int begin, int end) {
        int near = 0; // ones in the window that slides along
        for (int i = begin; i < std::min(begin + reach, end); ++i) near += read(i);
        for (int i = begin; i < end; ++i) {
            if (i + reach < end) near += read(i + reach);
            write(i, near > 0);
            if (i - reach >= begin) near -= read(i - reach);
        }
    };
    for (int y = w.y0; y < w.y1; ++y)
        spread([&](int x) { return int(mask(x, y)); }, [&](int x, bool v) { rows(x, y) = v; }, w.x0, w.x1);
    for (int x = w.x0; x < w.x1; ++x)
        spread([&](int y) { return int(rows(x, y)); }, [&](int y, bool v) { out(x, y) = v; }, w.y0, w.y1);
    return out;
}

LineRules line_rules(const View& view, float rim_px, bool all, bool caps) {
    LineRules rules;
    rules.half_width = line_half_width(view);
    rules.rim_half_width = 0.5f * rim_px * line_scale(view);
    if (caps) rules.cap = kInnerDark, rules.cap_part = kMeetDark, rules.rim = kRimDark;
    if (all) {
        rules.outline = kOutlineDark;
        rules.step = kStepDark;
        rules.part = rules.crease = kMeetDark;
    }
    return rules;
}

bool may_open(const Cut* cut, int x, int y) {
    if (!cut) return false;
    for (int dy = -1; dy <= 1; ++dy)
        for (int dx = -1; dx <= 1; ++dx)
            if (cut->distance.at_or(x + dx, y + dy, 1.0f) <= 0) return true;
    return false;
}

bool near_target(const GBuffer& buffer, int x, int y) {
    for (int dy = -1; dy <= 1; ++dy)
        for (int dx = -1; dx <= 1; ++dx)
            if (buffer.pixels.contains(x + dx, y + dy) && buffer.pixels(x + dx, y + dy).has(Pixel::on_target))
                return true;
    return false;
}

/// Pixels in and around a tile with a cap two pixels away or less.
Mask pixels_near_caps(const Picture& picture, Rect tile, float half_width) {
    constexpr int kNear = 2;
    const Rect w = tile.grown(int(std::ceil(half_width)) + 8 + kNear);
    Mask caps(w);
    for (int y = w.y0; y < w.y1; ++y)
        for (int x = w.x0; x < w.x1; ++x)
            caps(x, y) = picture.buffer.pixels.contains(x, y) && picture.buffer.pixels(x, y).has(Pixel::cap);
    return widened(caps, kNear);
}

/// What is hit at a position of the picture, as lines see it.
void show(const Camera& camera, const std::vector<Placement>& placements, const Hit& hit, Vec2f at, float depth,
          Vec3f direction, LineSample& s) {
    if (!hit.any()) return;
    const SurfacePoint point = camera.surface(placements, hit, at.x, at.y, depth, direction);
    s.part = hit.part;
    s.cap = hit.cap;
    s.depth = depth;
    s.position = point.position;
    s.normal = point.normal;
    s.flat_normal = point.flat_normal;
}

/// What the first pass saw at pixel centres, told again without a ray.
class SeenBefore {
public:
    SeenBefore(const Picture& picture, const std::vector<Placement>& placements)
        : picture_(picture), placements_(placements), any_(!is_selective(picture.params.refine)) {}

    /// False if it did not look at (x, y).
    [[nodiscard]] bool tell(float x, float y, LineSample& s) const {
        const int px = int(std::floor(x)), py = int(std::floor(y));
        if (!any_ || x != float(px) + 0.5f || y != float(py) + 0.5f) return false;
        const GBuffer& buffer = picture_.buffer;
        if (!buffer.pixels.contains(px, py)) return false;
        const Pixel& pixel = buffer.pixels(px, py);
        // What is wanted for its id alone has no surface.
        if (!pixel.has(Pixel::traced) || (!picture_.inferred.empty() && picture_.inferred(px, py))) return false;
        s = {};
        s.in_hole = pixel.has(Pixel::in_hole);
        s.on_target = pixel.has(Pixel::on_target);
        show(picture_.camera, placements_, buffer.hit(px, py), {x, y}, buffer.ids.depth(px, py),
             picture_.view.ray(x, y).direction, s);
        return true;
    }

private:
    const Picture& picture_;
    const std::vector<Placement>& placements_;
    bool any_; ///< the paper's ways do not look at all pixels they mark
};

} // namespace

Seen16 look(const Camera& camera, Samples16 samples, RayCounts& rays) {
    for (int i = 0; i < kLanes; ++i)
        samples.may_open[i] =
            samples.active[i] && may_open(camera.cut(), int(std::floor(samples.x[i])), int(std::floor(samples.y[i])));
    return camera.trace(samples, rays);
}

LineTrace camera_trace(const Camera& camera, const std::vector<Placement>& placements, RayCounts& rays) {
    return [&](const Samples16& samples, LineSample* out) {
        const Seen16 seen = look(camera, samples, rays);
        for (int i = 0; i < kLanes; ++i) {
            if (!samples.active[i]) continue;
            out[i] = {};
            out[i].in_hole = seen.in_hole[i];
            out[i].on_target = seen.on_target[i];
            show(camera, placements, seen.hit[i], {samples.x[i], samples.y[i]}, seen.depth[i], seen.direction[i],
                 out[i]);
        }
    };
}

std::uint32_t parts_on_target(const Camera& camera, int x, int y, RayCounts& rays) {
    Samples16 samples;
    for (int i = 0; i < kLanes; ++i) {
        const Vec2f p = Ink::position(x, y, i);
        samples.x[i] = p.x, samples.y[i] = p.y;
        samples.active[i] = true;
    }
    const Seen16 seen = look(camera, samples, rays);
    std::uint32_t bits = 0;
    for (std::uint32_t i = 0; i < kLanes; ++i) bits |= seen.on_target[i] ? 1u << i : 0u;
    return bits;
}

float line_scale(const View& view) { return std::max(1.0f, float(view.height) / 1080.0f); }
float line_half_width(const View& view) { return kHalfWidth * line_scale(view); }

RimLine::RimLine(const Picture& picture, const Cut& cut, const IdBuffer& plain, float tolerance)
    : cut_(&cut), plain_(&plain), width_(picture.params.rim_px * line_scale(picture.view)) {
    const Rect w = picture.buffer.window();
    const int reach = std::max(2, int(std::lround(kBridged * float(picture.view.height))));
    Mask removed(w), whole(w);
    for (int y = w.y0; y < w.y1; ++y)
        for (int x = w.x0; x < w.x1; ++x) {
            if (!picture.buffer.pixels(x, y).has(Pixel::in_hole)) continue;
            const float before = plain.depth(x, y), after = picture.buffer.ids.depth(x, y);
            (before < after - std::max(tolerance, 1e-6f * before) ? removed : whole)(x, y) = 1;
        }
    drawn_ = widened(removed, reach);
    for (std::size_t i = 0; i < whole.pixels().size(); ++i) whole.pixels()[i] &= std::uint8_t(!drawn_.pixels()[i]);
    const Mask stays = widened(whole, reach);
    for (std::size_t i = 0; i < stays.pixels().size(); ++i) drawn_.pixels()[i] &= std::uint8_t(!stays.pixels()[i]);
}

float RimLine::outer(float x, float y, const LineSample& s) const {
    if (!cut_ || s.cap || !s.in_hole || s.on_target || s.part == kNoPart) return 0;
    const int px = int(std::floor(x)), py = int(std::floor(y));
    if (plain_->id.at_or(px, py, kNoPart) != s.part) return 0;
    // What the pixel's centre sees without the cut, and whether that is the same surface.
    const Ray ray = cut_->view.ray(float(px) + 0.5f, float(py) + 0.5f);
    const Vec3f before = ray.origin + ray.direction * (plain_->depth(px, py) / ray.depth_per_t);
    if (std::abs(dot(before - s.position, s.flat_normal)) > 0.5f * cut_->view.pixel_size(s.depth)) return 0;
    // At the outline its own line is drawn.
    return clamp01(-cut_->distance_at(x, y) * 0.5f - 1.0f);
}

float RimLine::darkness(float x, float y) const {
    if (!cut_ || !(width_ > 0)) return 0;
    const float d = cut_->distance_at(x, y);
    if (!(d < 1) || !(d > -2 * width_ - 1)) return 0;
    // Where the distance grows slower or faster than it should, the line keeps its width.
    constexpr float kStep = 0.5f;
    const float gx = cut_->distance_at(x + kStep, y) - cut_->distance_at(x - kStep, y);
    const float gy = cut_->distance_at(x, y + kStep) - cut_->distance_at(x, y - kStep);
    const float slope = std::clamp(std::sqrt(gx * gx + gy * gy) / (2 * kStep), 0.5f, 1.5f);
    const float inside = -d / slope;
    const float covered = part_coverage(inside) * part_coverage(width_ - inside);
    if (!(covered > 0)) return 0;
    // How far the line is drawn here, between pixel centres.
    const float u = x - 0.5f, v = y - 0.5f;
    const int px = int(std::floor(u)), py = int(std::floor(v));
    const float fx = u - float(px), fy = v - float(py);
    const auto at = [&](int i, int j) { return float(drawn_.at_or(i, j, 0)); };
    const float drawn = (at(px, py) * (1 - fx) + at(px + 1, py) * fx) * (1 - fy) +
                        (at(px, py + 1) * (1 - fx) + at(px + 1, py + 1) * fx) * fy;
    return kRimDark * covered * drawn;
}

void draw_lines(Picture& picture, const Stage& stage, const RimLine& rim, Rect tile) {
    const bool all = picture.params.lines == Lines::all;
    const bool caps = stage.cut && picture.params.shading != Shading::flat && picture.params.rim_px > 0;
    RayCounts rays;
    const LineTrace seen_by_camera = camera_trace(picture.camera, stage.placements, rays);
    const SeenBefore before(picture, stage.placements);
    const LineTrace trace = [&](const Samples16& samples, LineSample* out) {
        Samples16 unseen = samples;
        bool any = false;
        for (int i = 0; i < kLanes; ++i) {
            unseen.active[i] = samples.active[i] && !before.tell(samples.x[i], samples.y[i], out[i]);
            any |= unseen.active[i];
        }
        if (any) seen_by_camera(unseen, out);
        for (int i = 0; i < kLanes; ++i)
            if (samples.active[i]) out[i].outer = rim.outer(samples.x[i], samples.y[i], out[i]);
    };
    const LineRules rules = line_rules(picture.view, picture.params.rim_px, all, caps);
    const Mask near_caps = caps && rules.caps_only()
                               ? pixels_near_caps(picture, tile, std::max(rules.half_width, rules.rim_half_width))
                               : Mask();
    // Around a hole the plain picture lacks the pixels that the hole will cover, but its lines must not.
    const auto inside = [&](int x, int y) {
        if (!stage.cut) return true;
        if (!near_caps.empty() && !near_caps.at_or(x, y, 0)) return false;
        const bool known = picture.buffer.pixels.contains(x, y);
        return known ? picture.buffer.pixels(x, y).has(Pixel::traced) : may_open(stage.cut, x, y);
    };
    bool any = false;
    for (int y = tile.y0; y < tile.y1; ++y)
        for (int x = tile.x0; x < tile.x1; ++x) any |= picture.buffer.pixels(x, y).has(Pixel::traced);
    if (!any) return;
    LineInk ink(tile);
    const bool has_ink =
        all || std::find(near_caps.pixels().begin(), near_caps.pixels().end(), 1) != near_caps.pixels().end();
    if (has_ink) find_lines(picture.view, tile, inside, trace, rules, ink);
    for (int y = tile.y0; y < tile.y1; ++y)
        for (int x = tile.x0; x < tile.x1; ++x) {
            if (!picture.buffer.pixels(x, y).has(Pixel::traced) || (stage.cut && !picture.opened(x, y))) continue;
            const bool on_rim = rim.reaches(x, y);
            if (!on_rim && !has_ink) continue;
            float open = 0, shy = 0;
            std::array<float, Ink::kParts> hidden;
            for (int i = 0; i < Ink::kParts; ++i) {
                const Vec2f p = Ink::position(x, y, i);
                hidden[std::size_t(i)] = std::max(ink.shy.part(x, y, i), on_rim ? rim.darkness(p.x, p.y) : 0.0f);
                shy = std::max(shy, hidden[std::size_t(i)]);
                open = std::max(open, ink.open.part(x, y, i));
            }
            if (shy == 0 && open == 0) continue;
            const std::uint32_t targets =
                shy > 0 && near_target(picture.buffer, x, y) ? parts_on_target(picture.camera, x, y, rays) : 0;
            float sum = 0;
            for (int i = 0; i < Ink::kParts; ++i)
                sum += std::max(ink.open.part(x, y, i), (targets >> i & 1u) ? 0.0f : hidden[std::size_t(i)]);
            picture.color(x, y) = inked(picture.color(x, y), sum / float(Ink::kParts));
        }
    picture.rays.add(rays);
}

} // namespace porthole
