#include <optional>

#include "porthole/render/picture.h"

namespace porthole {

namespace {

constexpr float kBorrowNormal = 0.9f;
constexpr float kBorrowStep = 1.5f; ///< pixels off the tangent plane
constexpr int kHoleFactor = 2;      ///< in the hole every sample that a pixel may have counts as two
constexpr float kConeShare = 0.7f;  ///< of a pixel's width
constexpr int kFirstLevel = 4;      ///< samples of the first level; each level has twice as many
constexpr float kBeside = 0.5f;     ///< an edge beside a pixel whose samples agree counts this much

/// Encoded roughly as files are: what the eye sees.
Vec4f encoded(Vec4f c) { return {std::sqrt(c.x), std::sqrt(c.y), std::sqrt(c.z), c.w}; }

/// Filtered light of a neighbouring pixel on the same surface, if there is one.
std::optional<Reach> borrow_light(const GBuffer& buffer, const View& view, std::uint32_t key, const SurfacePoint& point,
                                  float sx, float sy) {
    const int x = int(std::floor(sx)), y = int(std::floor(sy));
    // The sample's own pixel, then its neighbours, the side on which the sample lies first.
    const int hx = sx - float(x) < 0.5f ? -1 : 1, hy = sy - float(y) < 0.5f ? -1 : 1;
    const Vec2i order[] = {{0, 0}, {hx, 0}, {0, hy}, {hx, hy}, {-hx, 0}, {0, -hy}, {hx, -hy}, {-hx, hy}, {-hx, -hy}};
    for (const Vec2i d : order) {
        const int px = x + d.x, py = y + d.y;
        if (!buffer.pixels.contains(px, py) || buffer.key(px, py) != key) continue;
        if (dot(unpack_normal(buffer.pixels(px, py).normal), point.normal) < kBorrowNormal) continue;
        // The inside of a wall faces as its outside does.
        const float depth = buffer.ids.depth(px, py);
        const Ray ray = view.ray(float(px) + 0.5f, float(py) + 0.5f);
        const Vec3f there = ray.origin + ray.direction * (depth / ray.depth_per_t);
        if (std::abs(dot(there - point.position, point.flat_normal)) > kBorrowStep * view.pixel_size(depth)) continue;
        return buffer.light(px, py).reach();
    }
    return std::nullopt;
}

PathRay camera_path(const View& view, Vec3f direction, float depth, std::uint32_t slot, bool in_hole, int pattern) {
    PathRay ray;
    ray.pattern = pattern;
    ray.direction = direction;
    ray.slot = slot;
    ray.in_hole = in_hole;
    // The cone of a pixel, also for one of its samples: they are fewer where textures alone differ. Trilinear
    // look-ups see more than the ellipse they are meant for: on real models less is nearer to the truth.
    ray.width = kConeShare * view.pixel_size(depth);
    ray.widening = view.orthographic ? 0.0f : kConeShare * view.pixel_scale();
    return ray;
}

/// A pixel on its way through the levels.
struct Refined {
    Vec2i at;
    int count = 1; ///< samples in `sum`
    int most = 1;  ///< and never more than this
    Vec4f sum;
    Vec4f low, high;  ///< over the samples, encoded
    float beside = 0; ///< encoded contrast with neighbouring pixels
    bool opened = false;

    void add(Vec4f color) {
        sum = sum + color;
        ++count;
        extend(encoded(color));
    }
    void extend(Vec4f e) {
        low = {std::min(low.x, e.x), std::min(low.y, e.y), std::min(low.z, e.z), std::min(low.w, e.w)};
        high = {std::max(high.x, e.x), std::max(high.y, e.y), std::max(high.z, e.z), std::max(high.w, e.w)};
    }
    /// How far the samples lie apart, as the eye sees it.
    [[nodiscard]] float contrast() const {
        return std::max({high.x - low.x, high.y - low.y, high.z - low.z, high.w - low.w});
    }
};

/// Samples after the level at which a pixel with `count` samples is.
int next_level(int count) { return std::max(kFirstLevel, 2 * count); }

/// Whether a pixel has samples enough. The error of n samples at an edge falls with n^(-3/4) or so
/// and grows with the contrast; the sum of squares over a picture is least when n grows with contrast^(3/4).
bool is_done(const Refined& pixel) {
    if (pixel.count >= pixel.most) return true;
    if (pixel.count < kFirstLevel) return false;
    const float contrast = std::max(pixel.contrast(), kBeside * pixel.beside);
    return float(pixel.count) >= float(pixel.most) * std::sqrt(contrast * std::sqrt(contrast));
}

/// One sample to be traced.
struct Wanted {
    std::uint32_t pixel; ///< among the tile's
    int sample;
};

/// Up to sixteen samples, into slots from `first` of the shader.
void trace_samples(Picture& picture, const Stage& stage, std::span<const Wanted> wanted, std::span<Refined> pixels,
                   std::uint32_t first, Shader& shader, RayCounts& rays) {
    const GBuffer& buffer = picture.buffer;
    Samples16 samples;
    for (std::size_t i = 0; i < wanted.size(); ++i) {
        const Vec2i p = pixels[wanted[i].pixel].at;
        const Vec2f at = pixel_sample(wanted[i].sample);
        samples.x[i] = float(p.x) + at.x, samples.y[i] = float(p.y) + at.y;
        samples.active[i] = true;
        samples.may_open[i] = buffer.pixels(p.x, p.y).has(Pixel::may_open);
    }
    const Seen16 seen = picture.camera.trace(samples, rays);

    const bool flat = picture.params.shading == Shading::flat;
    for (std::size_t i = 0; i < wanted.size(); ++i) {
        const std::uint32_t slot = first + std::uint32_t(i);
        Refined& pixel = pixels[wanted[i].pixel];
        pixel.opened |= seen.in_hole[i];
        const Hit& hit = seen.hit[i];
        if (!hit.any()) {
            shader.miss(slot);
            continue;
        }
        const SurfacePoint p =
            picture.camera.surface(stage.placements, hit, samples.x[i], samples.y[i], seen.depth[i], seen.direction[i]);
        // Each sample of a pixel takes another part of the patterns.
        const int pattern = cell_rank(pixel.at.x, pixel.at.y) + wanted[i].sample * 5;
        Reach reach;
        if (!flat) {
            const std::uint32_t key = GBuffer::key(hit.part, seen.in_hole[i], hit.cap);
            if (const auto light = borrow_light(buffer, picture.view, key, p, samples.x[i], samples.y[i]))
                reach = *light;
            else
                reach = stage.occlusion.reach({p.position, p.start, p.flat_normal, p.normal, seen.in_hole[i], pattern},
                                              rays);
        }
        shader.add(camera_path(picture.view, seen.direction[i], seen.depth[i], slot, seen.in_hole[i], pattern), hit, p,
                   reach, seen.on_target[i]);
    }
}

} // namespace

namespace {

/// Pixels of `tile` whose light the filter has to even out.
Rect grainy(const GBuffer& buffer, Rect tile) {
    Rect r{tile.x1, tile.y1, tile.x0, tile.y0};
    for (int y = tile.y0; y < tile.y1; ++y)
        for (int x = tile.x0; x < tile.x1; ++x) {
            const Pixel& pixel = buffer.pixels(x, y);
            if (!pixel.has(Pixel::traced) || pixel.has(Pixel::inferred) || buffer.ids.id(x, y) == kNoPart) continue;
            r = {std::min(r.x0, x), std::min(r.y0, y), std::max(r.x1, x + 1), std::max(r.y1, y + 1)};
        }
    return r;
}

} // namespace

void shade_first(const Picture& picture, const Stage& stage, Vec2i at, const Reach& light, std::uint32_t slot,
                 Shader& shader) {
    const GBuffer& buffer = picture.buffer;
    const Hit hit = buffer.hit(at.x, at.y);
    if (!hit.any()) {
        shader.miss(slot);
        return;
    }
    const Pixel& pixel = buffer.pixels(at.x, at.y);
    const float x = float(at.x) + 0.5f, y = float(at.y) + 0.5f, depth = buffer.ids.depth(at.x, at.y);
    const Vec3f direction = picture.view.ray(x, y).direction;
    const SurfacePoint point = picture.camera.surface(stage.placements, hit, x, y, depth, direction);
    shader.add(camera_path(picture.view, direction, depth, slot, pixel.has(Pixel::in_hole), cell_rank(at.x, at.y)), hit,
               point, light, pixel.has(Pixel::on_target));
}

void shade_tile(Picture& picture, const Stage& stage, Rect tile) {
    std::vector<Vec2i> todo;
    for (int y = tile.y0; y < tile.y1; ++y)
        for (int x = tile.x0; x < tile.x1; ++x)
            if (picture.buffer.pixels(x, y).has(Pixel::traced)) todo.push_back({x, y});
    shade_pixels(picture, stage, tile, todo);
}

void shade_pixels(Picture& picture, const Stage& stage, Rect tile, std::span<const Vec2i> todo) {
    if (todo.empty()) return;
    GBuffer& buffer = picture.buffer;
    const bool flat = picture.params.shading == Shading::flat;
    RayCounts rays;
    FilteredTile filtered;
    if (!flat)
        if (const Rect part = grainy(buffer, tile); !part.empty()) filter_tile(buffer, picture.view, part, filtered);
    Shader shader(stage, todo.size(), false, rays);
    for (std::uint32_t slot = 0; slot < todo.size(); ++slot) {
        const auto [x, y] = todo[slot];
        const Pixel& pixel = buffer.pixels(x, y);
        Reach reach;
        if (buffer.ids.id(x, y) != kNoPart) {
            if (!flat) reach = pixel.has(Pixel::inferred) ? pixel.reach() : filtered.reach(x, y);
            buffer.light(x, y) = PixelLight(reach);
        }
        shade_first(picture, stage, {x, y}, reach, slot, shader);
    }
    shader.finish();
    for (std::uint32_t slot = 0; slot < todo.size(); ++slot) {
        const auto [x, y] = todo[slot];
        picture.color(x, y) = display_color(shader.radiance(slot), picture.params.background);
        picture.opened(x, y) = buffer.pixels(x, y).has(Pixel::in_hole) ? 1 : 0;
    }
    picture.rays.add(rays);
}

void refine_tile(Picture& picture, const Stage& stage, Rect tile) {
    const RenderParams& params = picture.params;
    std::vector<Refined> pixels;
    for (int by = tile.y0 & ~(kCell - 1); by < tile.y1; by += kCell)
        for (int bx = tile.x0 & ~(kCell - 1); bx < tile.x1; bx += kCell)
            for (int i = 0; i < kCellPixels; ++i) {
                const int x = bx + i % kCell, y = by + i / kCell;
                if (!tile.contains(x, y) || !picture.edges(x, y)) continue;
                const Pixel& pixel = picture.buffer.pixels(x, y);
                if (!pixel.has(Pixel::traced)) continue;
                Refined r;
                r.at = {x, y};
                r.most = params.samples * (pixel.has(Pixel::may_open) && !params.uniform ? kHoleFactor : 1);
                r.sum = picture.color(x, y);
                r.low = r.high = encoded(r.sum);
                r.beside = float(picture.edges(x, y)) * (1.0f / 255.0f);
                r.opened = picture.opened(x, y) != 0;
                pixels.push_back(r);
            }
    if (pixels.empty()) return;
    RayCounts rays;
    // Samples are shaded in groups, so that mirrored and refracted rays fill their packets.
    constexpr std::size_t kGroup = 16 * kLanes;
    Shader shader(stage, kGroup, true, rays);
    std::vector<Wanted> wanted;
    for (;;) {
        // The samples of one pixel follow each other: what is traced together lies close together.
        wanted.clear();
        for (std::size_t k = 0; k < pixels.size(); ++k) {
            const Refined& pixel = pixels[k];
            if (params.uniform ? pixel.count >= pixel.most : is_done(pixel)) continue;
            const int end = std::min(next_level(pixel.count), pixel.most);
            for (int s = pixel.count; s < end; ++s) wanted.push_back({std::uint32_t(k), s});
        }
        if (wanted.empty()) break;
        for (std::size_t begin = 0; begin < wanted.size(); begin += kGroup) {
            const auto group = std::span(wanted).subspan(begin, std::min(kGroup, wanted.size() - begin));
            shader.clear();
            for (std::size_t i = 0; i < group.size(); i += kLanes)
                trace_samples(picture, stage, group.subspan(i, std::min<std::size_t>(kLanes, group.size() - i)), pixels,
                              std::uint32_t(i), shader, rays);
            shader.finish();
            for (std::size_t i = 0; i < group.size(); ++i)
                pixels[group[i].pixel].add(display_color(shader.radiance(std::uint32_t(i)), params.background));
        }
    }
    for (const Refined& pixel : pixels) {
        picture.color(pixel.at.x, pixel.at.y) = pixel.sum * (1.0f / float(pixel.count));
        picture.opened(pixel.at.x, pixel.at.y) = pixel.opened ? 1 : 0;
    }
    picture.rays.add(rays);
}

} // namespace porthole
