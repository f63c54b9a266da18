#include "porthole/render/selective.h"

#include <algorithm>

#include "porthole/render/macro_pixels.h"
#include "porthole/trace/visibility.h"

namespace porthole {

namespace {

constexpr int kTile = 64;
constexpr std::size_t kGroup = 256; ///< samples shaded together, so that mirrored rays fill their packets

/// Pixels that lie close together get numbers that do (Morton's order).
std::uint32_t interleaved(Vec2i p) {
    const auto spread = [](std::uint32_t v) {
        v = (v | v << 8) & 0x00FF00FFu;
        v = (v | v << 4) & 0x0F0F0F0Fu;
        v = (v | v << 2) & 0x33333333u;
        return (v | v << 1) & 0x55555555u;
    };
    return spread(std::uint32_t(p.x) & 0xFFFFu) | spread(std::uint32_t(p.y) & 0xFFFFu) << 1;
}

/// First samples of up to sixteen pixels.
void look(Picture& picture, const std::vector<Placement>& placements, std::span<const Vec2i> pixels, RayCounts& rays) {
    Samples16 samples;
    samples.at_centres = true;
    for (std::size_t i = 0; i < pixels.size(); ++i) {
        Pixel& pixel = picture.buffer.pixels(pixels[i].x, pixels[i].y);
        pixel.flags |= Pixel::traced;
        samples.x[i] = float(pixels[i].x) + 0.5f, samples.y[i] = float(pixels[i].y) + 0.5f;
        samples.active[i] = true;
        samples.may_open[i] = pixel.has(Pixel::may_open);
    }
    const Seen16 seen = picture.camera.trace(samples, rays);
    for (std::size_t i = 0; i < pixels.size(); ++i)
        (void)record(picture, placements, samples, seen, int(i), pixels[i].x, pixels[i].y);
}

class Tracing {
public:
    Tracing(Picture& picture, const Stage& stage, const Control& control)
        : picture_(picture), stage_(stage), control_(control), window_(picture.buffer.window()) {
        columns_ = (window_.width() + kTile - 1) / kTile;
        by_tile_.resize(std::size_t(columns_) * std::size_t((window_.height() + kTile - 1) / kTile));
    }

    void operator()(PartialPicture& partial, std::span<const Vec2i> pixels) {
        std::vector<std::size_t> busy;
        for (const Vec2i p : pixels) {
            const std::size_t tile = std::size_t((p.y - window_.y0) / kTile) * std::size_t(columns_) +
                                     std::size_t((p.x - window_.x0) / kTile);
            if (by_tile_[tile].empty()) busy.push_back(tile);
            by_tile_[tile].push_back(p);
        }
        parallel_for(busy.size(), control_, [&](std::size_t i) {
            trace_tile(partial, by_tile_[busy[i]]);
            by_tile_[busy[i]].clear();
        });
        done_ += std::int64_t(pixels.size());
        if (control_.progress) {
            const double all = double(window_.width()) * double(window_.height());
            control_.progress("render", 0.3 + 0.6 * double(done_) / all);
        }
    }

private:
    void trace_tile(PartialPicture& partial, std::vector<Vec2i>& pixels) {
        std::sort(pixels.begin(), pixels.end(), [](Vec2i a, Vec2i b) { return interleaved(a) < interleaved(b); });
        RayCounts rays;
        std::vector<Vec2i> unseen;
        const auto look_at_unseen = [&] {
            look(picture_, stage_.placements, unseen, rays);
            unseen.clear();
        };
        for (const Vec2i p : pixels) {
            // Of surfaces at one depth it is the packet that decides which is hit: around a hole packets
            // have to be those of the plain picture, whatever is known already.
            if (stage_.cut && picture_.known(p.x, p.y)) continue;
            unseen.push_back(p);
            if (unseen.size() == kLanes) look_at_unseen();
        }
        if (!unseen.empty()) look_at_unseen();
        Shader shader(stage_, kGroup, false, rays);
        for (std::size_t begin = 0; begin < pixels.size(); begin += kGroup)
            shade(partial, std::span(pixels).subspan(begin, std::min(kGroup, pixels.size() - begin)), shader, rays);
        picture_.rays.add(rays);
    }

    void shade(PartialPicture& partial, std::span<const Vec2i> pixels, Shader& shader, RayCounts& rays) {
        const bool flat = picture_.params.shading == Shading::flat;
        const GBuffer& buffer = picture_.buffer;
        shader.clear();
        for (std::size_t i = 0; i < pixels.size(); ++i) {
            const auto [x, y] = pixels[i];
            const auto slot = std::uint32_t(i);
            const Hit hit = buffer.hit(x, y);
            if (!hit.any()) {
                shader.miss(slot);
                continue;
            }
            const Pixel& pixel = buffer.pixels(x, y);
            PathRay ray;
            ray.direction = picture_.view.ray(float(x) + 0.5f, float(y) + 0.5f).direction;
            ray.slot = slot;
            ray.in_hole = pixel.has(Pixel::in_hole);
            ray.pattern = cell_rank(x, y);
            const SurfacePoint p = picture_.camera.surface(stage_.placements, hit, float(x) + 0.5f, float(y) + 0.5f,
                                                           buffer.ids.depth(x, y), ray.direction);
            Reach reach;
            if (!flat)
                reach = stage_.occlusion.reach({p.position, p.start, p.flat_normal, p.normal, ray.in_hole, ray.pattern},
                                               rays);
            shader.add(ray, hit, p, reach, pixel.has(Pixel::on_target));
        }
        shader.finish();
        for (std::size_t i = 0; i < pixels.size(); ++i) {
            const auto [x, y] = pixels[i];
            partial.color(x, y) = display_color(shader.radiance(std::uint32_t(i)), picture_.params.background);
            partial.surface(x, y) = surface_of(x, y);
            partial.ids.id(x, y) = buffer.ids.id(x, y);
            partial.ids.depth(x, y) = buffer.ids.depth(x, y);
        }
    }

public:
    /// What counts as one visible surface: part, side of the rim, cap or not; and the face.
    [[nodiscard]] std::uint64_t surface_of(int x, int y) const {
        const std::uint32_t key = picture_.buffer.key(x, y);
        if (key == GBuffer::kNoKey) return PartialPicture::kNothing;
        const Pixel& pixel = picture_.buffer.pixels(x, y);
        const bool face = picture_.params.refine_by.surface == RefineParams::Surface::face && !pixel.has(Pixel::cap);
        return std::uint64_t(key) << 32 | (face ? pixel.triangle : 0u);
    }

private:
    Picture& picture_;
    const Stage& stage_;
    const Control& control_;
    Rect window_;
    int columns_ = 0;
    std::int64_t done_ = 0;
    std::vector<std::vector<Vec2i>> by_tile_;
};

} // namespace

Rect whole_macro_pixels(Rect window, const RefineParams& by, const View& view) {
    const auto floored = [&](int v) { return v & ~(by.macro_px - 1); };
    const auto ceiled = [&](int v) { return floored(v + by.macro_px - 1); };
    return Rect{floored(window.x0), floored(window.y0), ceiled(window.x1), ceiled(window.y1)}.intersected(
        view.window());
}

void mark_known(Picture& picture, const Cut* cut, const Cut* covering, bool targets) {
    const Rect w = picture.buffer.window();
    picture.known = Mask(w, 0);
    for (int y = w.y0; y < w.y1; ++y)
        for (int x = w.x0; x < w.x1; ++x)
            picture.known(x, y) = cut        ? picture.buffer.pixels(x, y).has(Pixel::traced)
                                  : covering ? near_hole(*covering, x, y, 1)
                                             : targets;
}

void look_tile(Picture& picture, const std::vector<Placement>& placements, Rect tile) {
    RayCounts rays;
    std::vector<Vec2i> pixels;
    for (int by = tile.y0 & ~(kCell - 1); by < tile.y1; by += kCell)
        for (int bx = tile.x0 & ~(kCell - 1); bx < tile.x1; bx += kCell) {
            pixels.clear();
            for (int i = 0; i < kCellPixels; ++i) {
                const int x = bx + i % kCell, y = by + i / kCell;
                if (tile.contains(x, y) && picture.known(x, y)) pixels.push_back({x, y});
            }
            if (!pixels.empty()) look(picture, placements, pixels, rays);
        }
    picture.rays.add(rays);
}

void draw_selectively(Picture& picture, const Stage& stage, const Control& control) {
    const RenderParams& params = picture.params;
    const Rect w = picture.buffer.window();
    Mask wanted;
    if (stage.cut) {
        wanted = Mask(w, 0);
        for (int y = w.y0; y < w.y1; ++y)
            for (int x = w.x0; x < w.x1; ++x) wanted(x, y) = picture.buffer.pixels(x, y).has(Pixel::in_hole);
    }
    PartialPicture partial(w);
    Tracing tracing(picture, stage, control);
    const TracePixels trace = [&](PartialPicture& p, std::span<const Vec2i> pixels) { tracing(p, pixels); };
    infer_pixels(params.refine, params.refine_by, wanted, partial, trace);

    if (stage.cut) {
        std::vector<Vec2i> mistaken;
        for (int y = w.y0; y < w.y1; ++y)
            for (int x = w.x0; x < w.x1; ++x)
                if (wanted(x, y) && partial.state(x, y) == PartialPicture::inferred &&
                    partial.surface(x, y) != tracing.surface_of(x, y)) {
                    partial.state(x, y) = PartialPicture::traced;
                    mistaken.push_back({x, y});
                }
        tracing(partial, mistaken);
    }
    bool any_inferred = false;
    Mask inferred(w, 0);
    for (int y = w.y0; y < w.y1; ++y)
        for (int x = w.x0; x < w.x1; ++x) {
            picture.opened(x, y) = picture.buffer.pixels(x, y).has(Pixel::in_hole);
            if (picture.known(x, y) || partial.state(x, y) != PartialPicture::inferred) continue;
            inferred(x, y) = 1;
            any_inferred = true;
            picture.buffer.ids.id(x, y) = partial.ids.id(x, y);
            picture.buffer.ids.depth(x, y) = partial.ids.depth(x, y);
        }
    picture.color = std::move(partial.color);
    if (any_inferred) picture.inferred = std::move(inferred);
}

std::int64_t trace_inferred_ids(const Bvh& bvh, const View& view, Frame& frame, Rect window, const Control& control) {
    return trace_inferred_ids(bvh, view, frame.ids, frame.inferred, window, control);
}

std::int64_t trace_inferred_ids(const Bvh& bvh, const View& view, IdBuffer& ids, Mask& inferred, Rect window,
                                const Control& control) {
    if (inferred.empty()) return 0;
    const Rect w = inferred.window().intersected(window);
    if (w.empty()) return 0;
    const auto block = [](int v) { return v >> 2; };
    BlockMask blocks{{block(w.x0), block(w.y0), block(w.x1 - 1) + 1, block(w.y1 - 1) + 1}, {}};
    blocks.marked = Mask(blocks.blocks, 0);
    for (int y = w.y0; y < w.y1; ++y)
        for (int x = w.x0; x < w.x1; ++x) blocks.marked(block(x), block(y)) |= inferred(x, y);
    std::int64_t rays = 0;
    const IdBuffer traced = trace_ids_in_blocks(bvh, view, w, blocks, control, &rays);
    for (int y = w.y0; y < w.y1; ++y)
        for (int x = w.x0; x < w.x1; ++x) {
            if (!inferred(x, y)) continue;
            ids.id(x, y) = traced.id(x, y);
            ids.depth(x, y) = traced.depth(x, y);
            inferred(x, y) = 0;
        }
    if (w == inferred.window()) inferred = {};
    return rays;
}

} // namespace porthole
