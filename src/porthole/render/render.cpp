#include "porthole/render/render.h"

#include <algorithm>
#include <cassert>
#include <new>
#include <optional>
#include <string>

#include "porthole/render/adaptive.h"
#include "porthole/render/emphasis.h"
#include "porthole/render/linework.h"
#include "porthole/render/picture.h"
#include "porthole/render/selective.h"

namespace porthole {

namespace {

void check(const RefineParams& p) {
    const auto power_of_two = [](const char* name, int value, int high) {
        if (value >= 1 && value <= high && (value & (value - 1)) == 0) return;
        throw Error(ErrorKind::usage, "E0140", name,
                    std::to_string(value) + " is not a power of two from 1 to " + std::to_string(high));
    };
    power_of_two("macro_px", p.macro_px, 256);
    power_of_two("threshold_px", p.threshold_px, p.macro_px);
    const auto refuse = [](const char* reason) { throw Error(ErrorKind::usage, "E0140", "guides", reason); };
    const std::vector<Vec2f>& g = p.guides;
    if (g.size() < 3 || g.size() > 64) refuse("3 to 64 are needed");
    bool spread = false;
    for (const Vec2f a : g) {
        if (!(a.x >= 0 && a.x <= 1 && a.y >= 0 && a.y <= 1)) refuse("one lies outside 0..1");
        for (const Vec2f b : g)
            spread |= std::abs((a.x - g[0].x) * (b.y - g[0].y) - (b.x - g[0].x) * (a.y - g[0].y)) > 1e-6f;
    }
    if (!spread) refuse("all lie on one line");
}

void check(const RenderParams& p) {
    const auto in_range = [](const char* name, int value, int low, int high) {
        if (value >= low && value <= high) return;
        throw Error(ErrorKind::usage, "E0140", name,
                    std::to_string(value) + " is outside " + std::to_string(low) + ".." + std::to_string(high));
    };
    in_range("samples", p.samples, 1, 4096);
    in_range("ao_samples", p.ao_samples, 0, 256);
    in_range("max_bounces", p.max_bounces, 0, 64);
    if (!(p.rim_px >= 0) || !(p.rim_px <= 100)) throw Error(ErrorKind::usage, "E0140", "rim_px", "outside 0..100");
    check(p.refine_by);
}

/// Runs one pass over all tiles and reports its share of the work.
class Passes {
public:
    Passes(Rect window, const Control& control) : window_(window), control_(control) {
        constexpr std::int64_t kSize = FilteredTile::kSize;
        tiles_ = std::max<std::int64_t>(1, (window.width() / kSize + 2) * (window.height() / kSize + 2));
    }
    template <typename Body> void run(double share, Body body) {
        std::atomic<std::int64_t> done{0};
        parallel_for_tiles(window_, FilteredTile::kSize, control_, [&](Rect tile) {
            body(tile);
            const std::int64_t n = ++done;
            if (control_.progress)
                control_.progress("render", base_ + share * std::min(1.0, double(n) / double(tiles_)));
        });
        pass(share);
    }
    /// Counts work that was done otherwise.
    void pass(double share) {
        base_ += share;
        if (control_.progress) control_.progress("render", std::min(1.0, base_));
    }

private:
    Rect window_;
    const Control& control_;
    std::int64_t tiles_;
    double base_ = 0;
};

/// @param plain  with a cut: the ids of the same view without it.
void draw(Picture& picture, const Bvh& bvh, const Bvh* targets, const Cut* cut, const IdBuffer* plain,
          const Control& control) {
    const Scene& scene = bvh.scene();
    const RenderParams& params = picture.params;
    std::vector<PartId> opened;
    for (const PartId id : all_parts(scene))
        if (targets && targets->holds(id)) opened.push_back(id);
    const Lighting lighting = make_lighting(scene, picture.view, opened);
    const Occlusion occlusion(bvh, cut, lighting, params);
    const std::vector<Placement> placements = make_placements(scene);
    Passes passes(picture.buffer.window(), control);
    std::vector<Tint> tints;
    const Stage stage{scene, bvh, cut, params, lighting, occlusion, placements, tints};
    const bool selective = is_selective(params.refine);
    std::optional<BlockMap> map;
    if (params.refine == Refine::adaptive && !params.uniform) {
        // Where more than colours is looked at, what each pixel sees is traced.
        const bool everything = !cut && !targets && params.lines != Lines::all;
        map = gather_adaptive(picture, stage, everything, control);
        passes.pass(0.5);
    } else if (selective) {
        passes.run(0.3, [&](Rect tile) { look_tile(picture, placements, tile); });
    } else {
        picture.buffer.pixels.expect_all();
        picture.buffer.light.expect_all();
        passes.run(0.5, [&](Rect tile) { gather_tile(picture, occlusion, placements, tile); });
    }
    if (targets) tints = target_tints(scene, placements, picture.buffer, params.emphasis);
    if (selective) {
        draw_selectively(picture, stage, control);
    } else {
        passes.run(0.2, [&](Rect tile) {
            if (map)
                shade_blocks(picture, stage, *map, tile);
            else
                shade_tile(picture, stage, tile);
        });
        if (map) {
            picture.inferred = Mask(picture.buffer.window());
            for (int level = 0; level < LatticeAxis::kLevels; ++level)
                passes.run(0, [&](Rect tile) { infer_colors(picture, *map, level, tile); });
        }
    }
    if (params.samples > 1 && !selective) {
        passes.run(0.02, [&](Rect tile) {
            if (!map || map->is_busy(tile)) find_edges(picture, tile);
        });
        passes.run(0.23, [&](Rect tile) {
            if (!map || map->is_busy(tile)) refine_tile(picture, stage, tile);
        });
    }
    const bool has_rim = cut && params.lines != Lines::none && params.shading != Shading::flat && params.rim_px > 0;
    if (!has_rim && params.lines != Lines::all) return;
    const RimLine rim =
        has_rim ? RimLine(picture, *cut, *plain, float(1e-6 * scene_bounds(scene).diagonal())) : RimLine();
    passes.run(0.05, [&](Rect tile) { draw_lines(picture, stage, rim, tile); });
}

Frame draw_plain(const Bvh& bvh, const Bvh* targets, const View& view, const RenderParams& params, const Cut* covering,
                 const Control& control) {
    const Camera camera(bvh, targets, view, nullptr);
    Picture picture(view, params, camera, view.window());
    // Blocks reach under the hole: what is inferred outside depends on what would be seen there.
    mark_everything(picture, params.refine == Refine::full || params.uniform ? covering : nullptr);
    if (is_selective(params.refine)) mark_known(picture, nullptr, covering, targets != nullptr);
    draw(picture, bvh, targets, nullptr, nullptr, control);
    return {
        std::move(picture.color), std::move(picture.buffer.ids), {}, std::move(picture.inferred), picture.rays.get()};
}

Frame draw_hole(const Bvh& bvh, const Bvh* targets, const View& view, const RenderParams& params, const Cut& cut,
                const Frame& under, const Caps* caps, const Control& control) {
    Frame frame = under;
    frame.rays = {};
    frame.inside = Mask(view.window(), 0);
    Rect window = cut.empty() ? Rect{} : hole_window(cut, view);
    if (window.empty()) return frame;
    if (is_selective(params.refine)) window = whole_macro_pixels(window, params.refine_by, view);
    // Lines are drawn where the hole shows another surface than was there.
    const std::int64_t before = trace_inferred_ids(bvh, view, frame, window, control);
    const Camera camera(bvh, targets, view, &cut, caps);
    Picture picture(view, params, camera, window);
    mark_hole(picture, cut);
    if (is_selective(params.refine)) mark_known(picture, &cut, nullptr, true);
    draw(picture, bvh, targets, &cut, &frame.ids, control);
    // Only pixels with a sample in the hole change; the others stay the plain picture's.
    for (int y = window.y0; y < window.y1; ++y)
        for (int x = window.x0; x < window.x1; ++x) {
            const Pixel& pixel = picture.buffer.pixels(x, y);
            if (!pixel.has(Pixel::may_open) || !picture.opened(x, y)) continue;
            frame.color(x, y) = picture.color(x, y);
            if (!pixel.has(Pixel::in_hole)) continue;
            frame.ids.id(x, y) = picture.buffer.ids.id(x, y);
            frame.ids.depth(x, y) = picture.buffer.ids.depth(x, y);
            if (!frame.inferred.empty()) frame.inferred(x, y) = 0;
            frame.inside(x, y) = pixel.has(Pixel::cap)         ? std::uint8_t(Frame::cap)
                                 : pixel.has(Pixel::open_back) ? std::uint8_t(Frame::open_back)
                                                               : std::uint8_t{0};
        }
    frame.rays = picture.rays.get();
    frame.rays.primary += before;
    return frame;
}

template <typename Draw> Frame drawn(const View& view, const RenderParams& params, Draw&& draw) {
    check(params);
    try {
        return draw();
    } catch (const std::bad_alloc&) {
        throw Error(ErrorKind::limit, "E0902", "render",
                    "memory ran out for a picture of " + std::to_string(view.width) + " x " +
                        std::to_string(view.height));
    }
}

} // namespace

Frame render(const Bvh& bvh, const Bvh* targets, const View& view, const RenderParams& params, const Cut* cut,
             const Frame* under, const Control& control, const Caps* caps) {
    assert(!cut == !under);
    return drawn(view, params, [&] {
        return cut ? draw_hole(bvh, targets, view, params, *cut, *under, caps, control)
                   : draw_plain(bvh, targets, view, params, nullptr, control);
    });
}

Frame render_around(const Bvh& bvh, const View& view, const RenderParams& params, const Cut& cut,
                    const Control& control) {
    return drawn(view, params, [&] { return draw_plain(bvh, nullptr, view, params, &cut, control); });
}

} // namespace porthole
