#include <optional>

#include "porthole/render/picture.h"

namespace porthole {

namespace {

constexpr float kBorrowNormal = 0.9f;
constexpr float kBorrowStep = 1.5f; ///< pixels off the tangent plane

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

PathRay camera_path(Vec3f direction, std::uint32_t slot, bool in_hole, int pattern) {
    PathRay ray;
    ray.pattern = pattern;
    ray.direction = direction;
    ray.slot = slot;
    ray.in_hole = in_hole;
    return ray;
}

/// Sample `s` of up to sixteen pixels, into slots group_index * 16 + lane of the shader.
void trace_samples(Picture& picture, const Stage& stage, std::span<const Vec2i> pixels, int s, int group_index,
                   Shader& shader, std::array<bool, kLanes>& in_hole, RayCounts& rays) {
    const GBuffer& buffer = picture.buffer;
    const Vec2f at = pixel_sample(s);
    Samples16 samples;
    for (std::size_t i = 0; i < pixels.size(); ++i) {
        samples.x[i] = float(pixels[i].x) + at.x, samples.y[i] = float(pixels[i].y) + at.y;
        samples.active[i] = true;
        samples.may_open[i] = buffer.pixels(pixels[i].x, pixels[i].y).has(Pixel::may_open);
    }
    const Seen16 seen = picture.camera.trace(samples, rays);

    const bool flat = picture.params.shading == Shading::flat;
    const std::uint32_t first = std::uint32_t(group_index) * kLanes;
    for (std::size_t i = 0; i < pixels.size(); ++i) {
        const std::uint32_t slot = first + std::uint32_t(i);
        in_hole[i] = in_hole[i] || seen.in_hole[i];
        const Hit& hit = seen.hit[i];
        if (!hit.any()) {
            shader.miss(slot);
            continue;
        }
        const SurfacePoint p =
            picture.camera.surface(stage.placements, hit, samples.x[i], samples.y[i], seen.depth[i], seen.direction[i]);
        // Each sample of a pixel takes another part of the patterns.
        const int pattern = cell_rank(pixels[i].x, pixels[i].y) + s * 5;
        Reach reach;
        if (!flat) {
            const std::uint32_t key = GBuffer::key(hit.part, seen.in_hole[i], hit.cap);
            if (const auto light = borrow_light(buffer, picture.view, key, p, samples.x[i], samples.y[i]))
                reach = *light;
            else
                reach = stage.occlusion.reach({p.position, p.start, p.flat_normal, p.normal, seen.in_hole[i], pattern},
                                              rays);
        }
        shader.add(camera_path(seen.direction[i], slot, seen.in_hole[i], pattern), hit, p, reach, seen.on_target[i]);
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

void shade_tile(Picture& picture, const Stage& stage, Rect tile) {
    GBuffer& buffer = picture.buffer;
    const bool flat = picture.params.shading == Shading::flat;
    std::vector<Vec2i> todo;
    for (int y = tile.y0; y < tile.y1; ++y)
        for (int x = tile.x0; x < tile.x1; ++x)
            if (buffer.pixels(x, y).has(Pixel::traced)) todo.push_back({x, y});
    if (todo.empty()) return;
    RayCounts rays;
    FilteredTile filtered;
    if (!flat)
        if (const Rect part = grainy(buffer, tile); !part.empty()) filter_tile(buffer, picture.view, part, filtered);
    Shader shader(stage, todo.size(), false, rays);
    for (std::uint32_t slot = 0; slot < todo.size(); ++slot) {
        const auto [x, y] = todo[slot];
        const Pixel& pixel = buffer.pixels(x, y);
        const Hit hit = buffer.hit(x, y);
        if (!hit.any()) {
            shader.miss(slot);
            continue;
        }
        const Vec3f direction = picture.view.ray(float(x) + 0.5f, float(y) + 0.5f).direction;
        const SurfacePoint point = picture.camera.surface(stage.placements, hit, float(x) + 0.5f, float(y) + 0.5f,
                                                          buffer.ids.depth(x, y), direction);
        const Reach reach = flat ? Reach{} : pixel.has(Pixel::inferred) ? pixel.reach() : filtered.reach(x, y);
        buffer.light(x, y) = PixelLight(reach);
        shader.add(camera_path(direction, slot, pixel.has(Pixel::in_hole), cell_rank(x, y)), hit, point, reach,
                   pixel.has(Pixel::on_target));
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
    const int n = picture.params.samples;
    std::vector<Vec2i> todo;
    for (int by = tile.y0 & ~(kCell - 1); by < tile.y1; by += kCell)
        for (int bx = tile.x0 & ~(kCell - 1); bx < tile.x1; bx += kCell)
            for (int i = 0; i < kCellPixels; ++i) {
                const int x = bx + i % kCell, y = by + i / kCell;
                if (tile.contains(x, y) && picture.edges(x, y)) todo.push_back({x, y});
            }
    if (todo.empty()) return;
    RayCounts rays;
    // Samples are shaded in groups, so that mirrored and refracted rays fill their packets.
    constexpr int kGroup = 16;
    Shader shader(stage, std::size_t(kGroup) * kLanes, true, rays);
    for (std::size_t begin = 0; begin < todo.size(); begin += kLanes) {
        const std::span<const Vec2i> pixels(todo.data() + begin, std::min<std::size_t>(kLanes, todo.size() - begin));
        std::array<Vec4f, kLanes> sum;
        std::array<bool, kLanes> in_hole{};
        for (std::size_t i = 0; i < pixels.size(); ++i) {
            sum[i] = picture.color(pixels[i].x, pixels[i].y);
            in_hole[i] = picture.opened(pixels[i].x, pixels[i].y) != 0;
        }
        for (int s0 = 1; s0 < n; s0 += kGroup) {
            const int count = std::min(kGroup, n - s0);
            shader.clear();
            for (int s = 0; s < count; ++s) trace_samples(picture, stage, pixels, s0 + s, s, shader, in_hole, rays);
            shader.finish();
            for (int s = 0; s < count; ++s)
                for (std::size_t i = 0; i < pixels.size(); ++i) {
                    const Vec4f c = display_color(shader.radiance(std::uint32_t(s) * kLanes + std::uint32_t(i)),
                                                  picture.params.background);
                    sum[i] = sum[i] + c;
                }
        }
        for (std::size_t i = 0; i < pixels.size(); ++i) {
            picture.color(pixels[i].x, pixels[i].y) = sum[i] * (1.0f / float(n));
            picture.opened(pixels[i].x, pixels[i].y) = in_hole[i] ? 1 : 0;
        }
    }
    picture.rays.add(rays);
}

} // namespace porthole
