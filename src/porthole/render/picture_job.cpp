#include "porthole/render/picture_job.h"

#include <algorithm>
#include <cassert>
#include <string>

#include "porthole/render/emphasis.h"
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

std::vector<PartId> parts_of(const Scene& scene, const Bvh* bvh) {
    std::vector<PartId> parts;
    for (const PartId id : all_parts(scene))
        if (bvh && bvh->holds(id)) parts.push_back(id);
    return parts;
}

} // namespace

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

Lattice::Lattice(const Picture& picture) : map(picture), blocks(lone_blocks(picture, map)) {
    const Rect area = map.area();
    for (int by = area.y0; by < area.y1; ++by)
        for (int bx = area.x0; bx < area.x1; ++bx)
            if (map.state(bx, by) == BlockMap::wanted && map.columns.on_lattice(kPreviewLevel, bx) &&
                map.rows.on_lattice(kPreviewLevel, by))
                blocks(bx, by) = 1;
}

Rect PictureJob::window(const Of& of) {
    if (!of.cut) return of.view.window();
    const Rect window = of.cut->empty() ? Rect{} : hole_window(*of.cut, of.view);
    if (window.empty() || !is_selective(of.params.refine)) return window;
    return whole_macro_pixels(window, of.params.refine_by, of.view);
}

PictureJob::PictureJob(const Of& of)
    : bvh_(of.bvh), targets_(of.targets), view_(of.view), params_((check(of.params), of.params)), cut_(of.cut),
      plain_(of.plain), camera_(bvh_, targets_, view_, cut_, of.caps), picture_(view_, params_, camera_, window(of)),
      lighting_(make_lighting(bvh_.scene(), view_, parts_of(bvh_.scene(), targets_))),
      occlusion_(bvh_, cut_, lighting_, params_),
      placements_(make_placements(bvh_.scene())), stage_{bvh_.scene(), bvh_,       cut_,        params_,
                                                         lighting_,    occlusion_, placements_, tints_} {
    const bool selective = is_selective(params_.refine);
    const bool all = params_.refine == Refine::full || params_.uniform;
    // Blocks reach under the hole: what is inferred outside depends on what would be seen there.
    if (cut_)
        mark_hole(picture_, *cut_);
    else
        mark_everything(picture_, all ? of.covering : nullptr);
    if (selective) mark_known(picture_, cut_, of.covering, targets_ != nullptr);

    const bool preview = of.preview && !selective;
    const FrameStep first = preview ? FrameStep::preview : FrameStep::refined;
    if (params_.refine == Refine::adaptive && !params_.uniform) {
        // Where more than colours is looked at, what each pixel sees is traced.
        adaptive_.emplace(picture_, stage_, !cut_ && !targets_ && params_.lines != Lines::all);
        passes_.push_back({first, 0.05, &PictureJob::trace_lattice});
    } else if (preview) {
        lattice_.emplace(picture_);
        passes_.push_back({first, 0.05, &PictureJob::trace_lattice});
    }
    if (preview) {
        if (targets_) passes_.push_back({first, 0, &PictureJob::choose_tints});
        passes_.push_back({first, 0, &PictureJob::shade_lattice});
        passes_.push_back({first, 0, &PictureJob::interpolate});
    }
    const auto refined = [this](double share, Run pass) { passes_.push_back({FrameStep::refined, share, pass}); };
    if (selective)
        refined(0.3, &PictureJob::look);
    else
        refined(0.45, &PictureJob::gather);
    if (targets_) refined(0, &PictureJob::choose_tints);
    if (selective) {
        refined(0.6, &PictureJob::draw_by_macro_pixels);
    } else {
        refined(0.2, &PictureJob::shade);
        if (adaptive_) refined(0, &PictureJob::infer);
        if (params_.samples > 1) {
            passes_.push_back({FrameStep::antialiased, 0.02, &PictureJob::mark_edges});
            passes_.push_back({FrameStep::antialiased, 0.23, &PictureJob::antialias});
        }
    }
    const bool has_rim = cut_ && params_.lines != Lines::none && params_.shading != Shading::flat && params_.rim_px > 0;
    if (has_rim) passes_.push_back({FrameStep::complete, 0, &PictureJob::find_rim});
    if (has_rim || params_.lines == Lines::all) passes_.push_back({FrameStep::complete, 0.05, &PictureJob::draw_lines});
}

void PictureJob::run(FrameStep last, const Control& control) {
    while (!done() && passes_[at_].step <= last) {
        const Pass& pass = passes_[at_];
        (this->*pass.run)(control);
        tiles_done_ = 0;
        ++at_;
        share_ += pass.share;
        if (control.progress) control.progress("render", std::min(1.0, share_));
    }
    if (last > FrameStep::preview) preview_.reset();
}

/// Runs a pass over all tiles that it has not done yet, and reports its share of the work.
template <typename Body> void PictureJob::for_tiles(const Control& control, Body&& body) {
    constexpr std::int64_t kSize = FilteredTile::kSize;
    const Rect window = picture_.buffer.window();
    const std::int64_t tiles = (window.width() / kSize + 2) * (window.height() / kSize + 2);
    loop_.run(window, kSize, control, [&](Rect tile) {
        body(tile);
        const std::int64_t n = ++tiles_done_;
        if (control.progress)
            control.progress("render", share_ + passes_[at_].share * std::min(1.0, double(n) / double(tiles)));
    });
}

template <typename Body> void PictureJob::for_levels(int end, const Control& control, Body&& body) {
    for (; level_ < end; ++level_) for_tiles(control, [&](Rect tile) { body(level_, tile); });
    level_ = 0;
}

void PictureJob::trace_lattice(const Control& control) {
    if (adaptive_) return adaptive_->trace_lattice(control);
    for_tiles(control, [&](Rect tile) {
        std::vector<Vec2i> blocks;
        for (int by = tile.y0 / kCell; by <= (tile.y1 - 1) / kCell; ++by)
            for (int bx = tile.x0 / kCell; bx <= (tile.x1 - 1) / kCell; ++bx)
                if (lattice_->blocks(bx, by)) blocks.push_back({bx, by});
        gather_blocks(picture_, occlusion_, placements_, blocks, true);
        for (const Vec2i b : blocks) lattice_->map.state(b.x, b.y) = BlockMap::traced;
    });
}

void PictureJob::shade_lattice(const Control& control) {
    if (!preview_) preview_.emplace(picture_);
    for_tiles(control, [&](Rect tile) { shade_preview(*preview_, picture_, stage_, lattice_map(), tile); });
}

void PictureJob::interpolate(const Control& control) {
    for_levels(kPreviewLevel + 1, control,
               [&](int level, Rect tile) { interpolate_preview(*preview_, picture_, lattice_map(), level, tile); });
}

void PictureJob::gather(const Control& control) {
    if (adaptive_) return adaptive_->trace_rest(control);
    picture_.buffer.pixels.expect_all();
    picture_.buffer.light.expect_all();
    const Mask* traced = lattice_ ? &lattice_->blocks : nullptr;
    for_tiles(control, [&](Rect tile) { gather_tile(picture_, occlusion_, placements_, tile, traced); });
}

void PictureJob::look(const Control& control) {
    for_tiles(control, [&](Rect tile) { look_tile(picture_, placements_, tile); });
}

void PictureJob::choose_tints(const Control&) {
    tints_ = target_tints(stage_.scene, placements_, picture_.buffer, params_.emphasis);
}

void PictureJob::draw_by_macro_pixels(const Control& control) {
    const RayCounts before = picture_.rays.get();
    try {
        draw_selectively(picture_, stage_, control);
    } catch (const Cancelled&) {
        // What decides the blocks is gone, so all of it is done again.
        picture_.rays.set(before);
        throw;
    }
}

void PictureJob::shade(const Control& control) {
    for_tiles(control, [&](Rect tile) {
        if (adaptive_)
            shade_blocks(picture_, stage_, adaptive_->map(), tile);
        else
            shade_tile(picture_, stage_, tile);
    });
}

void PictureJob::infer(const Control& control) {
    if (picture_.inferred.empty()) picture_.inferred = Mask(picture_.buffer.window());
    for_levels(LatticeAxis::kLevels, control,
               [&](int level, Rect tile) { infer_colors(picture_, adaptive_->map(), level, tile); });
}

void PictureJob::mark_edges(const Control& control) {
    for_tiles(control, [&](Rect tile) {
        if (!adaptive_ || adaptive_->map().is_busy(tile)) find_edges(picture_, tile);
    });
}

void PictureJob::antialias(const Control& control) {
    for_tiles(control, [&](Rect tile) {
        if (!adaptive_ || adaptive_->map().is_busy(tile)) refine_tile(picture_, stage_, tile);
    });
}

void PictureJob::find_rim(const Control&) {
    rim_ = RimLine(picture_, *cut_, *plain_, float(1e-6 * scene_bounds(stage_.scene).diagonal()));
}

void PictureJob::draw_lines(const Control& control) {
    for_tiles(control, [&](Rect tile) { porthole::draw_lines(picture_, stage_, rim_, tile); });
}

void PictureJob::trace_ids(const Bvh& bvh, Rect window, const Control& control) {
    RayCounts rays;
    rays.primary = trace_inferred_ids(bvh, view_, picture_.buffer.ids, picture_.inferred, window, control);
    picture_.rays.add(rays);
}

Frame PictureJob::plain_frame() const {
    if (!preview_) return {picture_.color, ids(), {}, picture_.inferred, picture_.rays.get()};
    Frame frame{preview_->color, preview_->ids, {}, preview_->inferred, picture_.rays.get()};
    frame.rays += preview_->rays.get();
    return frame;
}

Frame PictureJob::take_plain_frame() {
    return {std::move(picture_.color),
            std::move(picture_.buffer.ids),
            {},
            std::move(picture_.inferred),
            picture_.rays.get()};
}

void PictureJob::lay_over(Frame& frame) const {
    const Rect window = picture_.buffer.window();
    if (frame.inside.empty()) frame.inside = Mask(frame.color.window(), 0);
    frame.rays += picture_.rays.get();
    if (preview_) {
        if (frame.inferred.empty()) frame.inferred = Mask(frame.color.window(), 0);
        frame.rays += preview_->rays.get();
        for (int y = window.y0; y < window.y1; ++y)
            for (int x = window.x0; x < window.x1; ++x) {
                if (!preview_->shown(x, y)) continue;
                frame.color(x, y) = preview_->color(x, y);
                frame.ids.id(x, y) = preview_->ids.id(x, y);
                frame.ids.depth(x, y) = preview_->ids.depth(x, y);
                frame.inferred(x, y) = preview_->inferred(x, y);
                frame.inside(x, y) = preview_->inside(x, y);
            }
        return;
    }
    // Only pixels with a sample in the hole change; the others stay the plain picture's.
    for (int y = window.y0; y < window.y1; ++y)
        for (int x = window.x0; x < window.x1; ++x) {
            const Pixel& pixel = picture_.buffer.pixels(x, y);
            if (!pixel.has(Pixel::may_open) || !picture_.opened(x, y)) continue;
            frame.color(x, y) = picture_.color(x, y);
            if (!pixel.has(Pixel::in_hole)) continue;
            frame.ids.id(x, y) = ids().id(x, y);
            frame.ids.depth(x, y) = ids().depth(x, y);
            if (!frame.inferred.empty()) frame.inferred(x, y) = 0;
            frame.inside(x, y) = inside_of(pixel);
        }
}

} // namespace porthole
