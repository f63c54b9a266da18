#include "porthole/hole/profile.h"

#include <algorithm>
#include <cmath>

#include "porthole/hole/blur.h"

namespace porthole {
namespace {

/// A little more than the wall's thickness, so that the chamfer comes out behind it.
constexpr float kThrough = 1.1f;
/// Share of a step that its chamfer may take; the rest is a straight wall.
constexpr float kMostOfStep = 0.6f;
/// The same where the user fixes the chamfer: the core still begins beyond it, rounding included.
constexpr float kWholeStep = 0.98f;

/// Width of the band to be shared among steps: smooth, and never more than there is, so that
/// every step has come down to the floor where the core begins.
Image<float> band_widths(const Hole& hole, int blur_px) {
    Mask known(hole.window);
    for (std::size_t i = 0; i < known.pixels().size(); ++i)
        known.pixels()[i] = hole.mask.pixels()[i] != 0 && hole.width.pixels()[i] > 0;
    Image<float> width = hole.width;
    smooth_over(width, known, hole.bounds, blur_px, Fit::mean);
    for (std::size_t i = 0; i < known.pixels().size(); ++i)
        if (known.pixels()[i]) width.pixels()[i] = std::min(width.pixels()[i], hole.width.pixels()[i]);
    return width;
}

} // namespace

std::vector<CutLevel> rim_levels(const Hole& hole, const View& view, std::span<const Wall> walls,
                                 const RimParams& params) {
    const Image<float> width = band_widths(hole, params.blur_px);
    const Rect box = hole.bounds;
    std::vector<CutLevel> levels;
    for (std::size_t k = 0; k < walls.size(); ++k) {
        const Wall& wall = walls[k];
        Image<float> fronts = wall.front, thicknesses = wall.next;
        Mask known(hole.window);
        for (std::size_t i = 0; i < known.pixels().size(); ++i) {
            if (!hole.mask.pixels()[i] || !(fronts.pixels()[i] < kInfinity)) continue;
            known.pixels()[i] = 1;
            thicknesses.pixels()[i] -= fronts.pixels()[i];
        }
        smooth_over(fronts, known, box, params.blur_px, Fit::plane);
        smooth_over(thicknesses, known, box, params.blur_px, Fit::mean);

        CutLevel& level = levels.emplace_back(hole.window);
        for (int y = box.y0; y < box.y1; ++y)
            for (int x = box.x0; x < box.x1; ++x) {
                if (!hole.mask(x, y)) continue;
                CutProfile& p = level(x, y);
                p.floor = hole.floor_depth(x, y);
                const float step = width(x, y) / float(walls.size());
                if (!(step < kInfinity)) continue;
                p.start = float(k) * step;
                const float front = fronts(x, y);
                if (!(front < kInfinity)) continue;
                const float pixel = view.pixel_size(front), thick = kThrough * thicknesses(x, y);
                if (params.angle) {
                    p.width = kWholeStep * step;
                    p.slope = pixel / std::tan(*params.angle);
                } else {
                    p.width = params.bevel_px
                                  ? std::min(*params.bevel_px, kWholeStep * step)
                                  : std::clamp(thick / pixel, std::min(params.least_px, step / 2), kMostOfStep * step);
                    if (!(p.width > 0)) continue;
                    p.slope = thick / p.width;
                }
                p.front = front;
            }
    }
    return levels;
}

} // namespace porthole
