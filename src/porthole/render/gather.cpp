#include "porthole/render/picture.h"

namespace porthole {

namespace {

constexpr int kLightMargin = 3; ///< pixels around the hole whose light is needed: filter and borrowing

int block_floor(int v) { return v & ~(kCell - 1); }

bool is_covered(const Picture& picture, int x, int y) { return picture.covered.at_or(x, y, 0) != 0; }

std::uint16_t quantised(float value, float unit) {
    return std::uint16_t(std::lround(std::min(value * unit, 65535.0f)));
}

/// Points of one tile that ask for light, with the pixel each belongs to.
struct Askers {
    std::vector<Asker> points;
    std::vector<Vec2i> pixels;
};

/// Camera rays and geometry of one block of 4x4 pixels, its lamps too if its light is wanted.
void gather_block(Picture& picture, const Occlusion& occlusion, const std::vector<Placement>& placements, int bx,
                  int by, bool light, Askers& askers, RayCounts& rays) {
    GBuffer& buffer = picture.buffer;
    Samples16 samples;
    samples.at_centres = true;
    bool any = false;
    for (int i = 0; i < kLanes; ++i) {
        const int x = bx + i % kCell, y = by + i / kCell;
        samples.x[i] = float(x) + 0.5f, samples.y[i] = float(y) + 0.5f;
        if (!buffer.pixels.contains(x, y)) continue;
        Pixel& pixel = buffer.pixels(x, y);
        const bool covered = is_covered(picture, x, y);
        if (picture.everything && !covered) pixel.flags |= Pixel::traced;
        samples.active[i] = pixel.has(Pixel::traced) || covered;
        samples.may_open[i] = pixel.has(Pixel::may_open);
        any |= samples.active[i];
    }
    if (!any) return;
    const Seen16 seen = picture.camera.trace(samples, rays);

    std::array<Asker, kLanes> points;
    std::array<Vec2i, kLanes> pixels;
    std::size_t n = 0;
    for (int i = 0; i < kLanes; ++i) {
        if (!samples.active[i]) continue;
        const int x = bx + i % kCell, y = by + i / kCell;
        const std::optional<SurfacePoint> found = record(picture, placements, samples, seen, i, x, y);
        if (!found) continue;
        const SurfacePoint& point = *found;
        points[n] = {point.position, point.start, point.flat_normal, point.normal, seen.in_hole[i], cell_rank(x, y)};
        pixels[n++] = {x, y};
    }
    if (!light || picture.params.shading == Shading::flat || n == 0) return;
    std::array<Vec3f, kLanes> lamps;
    occlusion.lamps(std::span(points.data(), n), kLampRays, lamps.data(), rays);
    for (std::size_t k = 0; k < n; ++k) {
        Pixel& pixel = buffer.pixels(pixels[k].x, pixels[k].y);
        for (int c = 0; c < 3; ++c) pixel.lamps[c] = std::uint8_t(std::lround(clamp01(lamps[k][c]) * 255.0f));
    }
    askers.points.insert(askers.points.end(), points.begin(), points.begin() + std::ptrdiff_t(n));
    askers.pixels.insert(askers.pixels.end(), pixels.begin(), pixels.begin() + std::ptrdiff_t(n));
}

/// Ambient rays, pixels of the same pattern together: their rays have the same directions.
void gather_ambient(Picture& picture, const Occlusion& occlusion, const Askers& askers, RayCounts& rays) {
    if (askers.points.empty() || picture.params.ao_samples == 0) return;
    std::vector<std::size_t> order;
    order.reserve(askers.points.size());
    for (int rank = 0; rank < kCellPixels; ++rank)
        for (std::size_t k = 0; k < askers.points.size(); ++k)
            if (askers.points[k].pattern == rank) order.push_back(k);
    std::vector<Asker> sorted;
    sorted.reserve(order.size());
    for (const std::size_t k : order) sorted.push_back(askers.points[k]);
    std::vector<Occlusion::Ambient> sums(sorted.size());
    occlusion.ambient(sorted, sums.data(), rays);
    const float unit = 65535.0f / float(picture.params.ao_samples);
    for (std::size_t k = 0; k < order.size(); ++k) {
        Pixel& pixel = picture.buffer.pixels(askers.pixels[order[k]].x, askers.pixels[order[k]].y);
        pixel.ambient_open = quantised(sums[k].open, unit);
        pixel.ambient_all = quantised(sums[k].all, unit);
    }
}

} // namespace

void RayTotals::add(const RayCounts& rays) {
    primary_ += rays.primary, shadow_ += rays.shadow, ambient_ += rays.ambient;
    reflection_ += rays.reflection, refraction_ += rays.refraction;
}

void RayTotals::set(const RayCounts& rays) {
    primary_ = rays.primary, shadow_ = rays.shadow, ambient_ = rays.ambient;
    reflection_ = rays.reflection, refraction_ = rays.refraction;
}

RayCounts RayTotals::get() const { return {primary_, shadow_, ambient_, reflection_, refraction_}; }

bool near_hole(const Cut& cut, int x, int y, int reach) {
    for (int dy = -reach; dy <= reach; ++dy)
        for (int dx = -reach; dx <= reach; ++dx)
            if (cut.distance.at_or(x + dx, y + dy, 1.0f) <= 0) return true;
    return false;
}

std::optional<SurfacePoint> record(Picture& picture, const std::vector<Placement>& placements, const Samples16& samples,
                                   const Seen16& seen, int lane, int x, int y) {
    Pixel& pixel = picture.buffer.pixels(x, y);
    if (seen.in_hole[lane]) pixel.flags |= Pixel::in_hole;
    if (seen.on_target[lane]) pixel.flags |= Pixel::on_target;
    const Hit& hit = seen.hit[lane];
    picture.buffer.ids.id(x, y) = hit.part;
    picture.buffer.ids.depth(x, y) = seen.depth[lane];
    if (!hit.any() || !pixel.has(Pixel::traced)) return std::nullopt;
    pixel.triangle = hit.triangle, pixel.u = hit.u, pixel.v = hit.v;
    const SurfacePoint point = picture.camera.surface(placements, hit, samples.x[lane], samples.y[lane],
                                                      seen.depth[lane], seen.direction[lane]);
    if (hit.cap) pixel.flags |= Pixel::cap;
    const Cut* cut = picture.camera.cut();
    if (seen.in_hole[lane] && !point.front && cut->role[index(hit.part)] == CutRole::cut_set &&
        cut->cap_of(hit.part) == CapRule::none)
        pixel.flags |= Pixel::open_back;
    pixel.normal = pack_normal(point.normal);
    return point;
}

void mark_everything(Picture& picture, const Cut* cut) {
    picture.everything = true;
    if (!cut || cut->empty()) return;
    // Samples of a pixel one inside the rim may see the plain scene; beside it the filter and
    // the edges look kLightMargin further.
    constexpr int kReach = kLightMargin + 1;
    const Rect w = picture.buffer.window();
    picture.covered = Mask(w, 0);
    const Rect box = cut->distance.window().intersected(w);
    // How many pixels in a row, then in a column of rows, lie in the hole.
    Mask run(w, 0);
    for (int y = box.y0; y < box.y1; ++y) {
        int length = 0;
        for (int x = box.x0; x < box.x1; ++x) {
            length = cut->distance(x, y) <= 0 ? length + 1 : 0;
            if (length > 2 * kReach) run(x - kReach, y) = 1;
        }
    }
    for (int x = box.x0; x < box.x1; ++x) {
        int length = 0;
        for (int y = box.y0; y < box.y1; ++y) {
            length = run(x, y) ? length + 1 : 0;
            if (length <= 2 * kReach) continue;
            picture.covered(x, y - kReach) = 1;
        }
    }
}

Rect hole_window(const Cut& cut, const View& view) {
    const Rect w = cut.distance.window();
    Rect found{w.x1, w.y1, w.x0, w.y0};
    for (int y = w.y0; y < w.y1; ++y)
        for (int x = w.x0; x < w.x1; ++x) {
            if (cut.distance(x, y) > 0) continue;
            found = {std::min(found.x0, x), std::min(found.y0, y), std::max(found.x1, x + 1),
                     std::max(found.y1, y + 1)};
        }
    if (found.empty()) return {};
    found = found.grown(1 + kLightMargin);
    const Rect blocks{block_floor(found.x0), block_floor(found.y0), block_floor(found.x1 + kCell - 1),
                      block_floor(found.y1 + kCell - 1)};
    const Rect inside = blocks.intersected(view.window());
    return inside.empty() ? Rect{} : inside;
}

void mark_hole(Picture& picture, const Cut& cut) {
    SparseImage<Pixel>& pixels = picture.buffer.pixels;
    const Rect w = pixels.window();
    for (int by = block_floor(w.y0); by < w.y1; by += kCell)
        for (int bx = block_floor(w.x0); bx < w.x1; bx += kCell) {
            bool traced = false;
            for (int y = by - kLightMargin - 1; y < by + kCell + kLightMargin + 1 && !traced; ++y)
                for (int x = bx - kLightMargin - 1; x < bx + kCell + kLightMargin + 1 && !traced; ++x)
                    traced = cut.distance.at_or(x, y, 1.0f) <= 0;
            if (!traced) continue;
            for (int y = std::max(by, w.y0); y < std::min(by + kCell, w.y1); ++y)
                for (int x = std::max(bx, w.x0); x < std::min(bx + kCell, w.x1); ++x) {
                    Pixel& pixel = pixels(x, y);
                    pixel.flags = Pixel::traced;
                    if (!near_hole(cut, x, y, 1)) continue;
                    pixel.flags |= Pixel::may_open;
                    for (int dy = -1; dy <= 1; ++dy)
                        for (int dx = -1; dx <= 1; ++dx)
                            if (cut.distance.at_or(x + dx, y + dy, 1.0f) > 0) pixel.flags |= Pixel::rim;
                }
        }
}

void gather_blocks(Picture& picture, const Occlusion& occlusion, const std::vector<Placement>& placements,
                   std::span<const Vec2i> blocks, bool light) {
    RayCounts rays;
    Askers askers;
    for (const Vec2i b : blocks)
        gather_block(picture, occlusion, placements, b.x * kCell, b.y * kCell, light, askers, rays);
    gather_ambient(picture, occlusion, askers, rays);
    picture.rays.add(rays);
}

void gather_tile(Picture& picture, const Occlusion& occlusion, const std::vector<Placement>& placements, Rect tile,
                 const Mask* but) {
    // Larger squares of blocks first to last, so that neighbours in the list are neighbours in
    // the picture.
    constexpr int kSquare = kCell * kCell;
    const Rect w = picture.buffer.window();
    std::vector<Vec2i> blocks;
    for (int sy = tile.y0 & ~(kSquare - 1); sy < tile.y1; sy += kSquare)
        for (int sx = tile.x0 & ~(kSquare - 1); sx < tile.x1; sx += kSquare)
            for (int y = sy; y < sy + kSquare; y += kCell)
                for (int x = sx; x < sx + kSquare; x += kCell)
                    if (!Rect{x, y, x + kCell, y + kCell}.intersected(w).intersected(tile).empty() &&
                        !(but && (*but)(x / kCell, y / kCell)))
                        blocks.push_back({x / kCell, y / kCell});
    gather_blocks(picture, occlusion, placements, blocks, true);
}

} // namespace porthole
