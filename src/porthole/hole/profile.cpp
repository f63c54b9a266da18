#include "porthole/hole/profile.h"

#include <algorithm>
#include <cmath>

#include "porthole/hole/blur.h"
#include "porthole/hole/distance.h"

namespace porthole {
namespace {

/// A little more than the wall's thickness, so that the chamfer comes out behind it.
constexpr float kThrough = 1.1f;
/// Share of a step that its chamfer may take; the rest is a straight wall.
constexpr float kMostOfStep = 0.6f;
/// The same where the user fixes the chamfer: the core still begins beyond it, rounding included.
constexpr float kWholeStep = 0.98f;

/// Width of the band to be shared among steps: smooth, and on the core never more than the
/// distance to the rim, so that every step has come down to the floor there.
Image<float> band_widths(const Hole& hole, const Image<PartId>& core, int blur_px) {
    Mask known(hole.window);
    for (std::size_t i = 0; i < known.pixels().size(); ++i)
        known.pixels()[i] = hole.mask.pixels()[i] != 0 && hole.width.pixels()[i] > 0;
    Image<float> width = hole.width;
    smooth_over(width, known, hole.bounds, blur_px, Fit::mean);
    for (std::size_t i = 0; i < known.pixels().size(); ++i)
        if (core.pixels()[i] != kNoPart) width.pixels()[i] = std::min(width.pixels()[i], -hole.distance.pixels()[i]);
    return width;
}

} // namespace

Image<float> rim_distance(const Hole& hole) {
    Image<float> distance = hole.distance;
    const Rect w = hole.window, box = hole.bounds.grown(1).intersected(w);
    std::vector<PowerSite> sites;
    const auto inside = [&](int x, int y) { return hole.mask.at_or(x, y, 0) != 0; };
    for (int y = box.y0; y < box.y1; ++y)
        for (int x = box.x0; x < box.x1; ++x)
            if (!inside(x, y) && (inside(x - 1, y) || inside(x + 1, y) || inside(x, y - 1) || inside(x, y + 1)))
                sites.push_back({{x, y}, 0});
    if (sites.empty()) return distance;
    const PowerDistance nearest = power_distance_transform(box, sites, 1);
    Image<float> even = distance;
    for (int y = box.y0; y < box.y1; ++y)
        for (int x = box.x0; x < box.x1; ++x) {
            if (distance(x, y) > -1) continue;
            // As far as the nearest pixel outside, less what of that lies beyond the rim.
            const Vec2i out = sites[std::size_t(nearest.nearest(x, y))].center;
            const float beyond = std::clamp(distance(out.x, out.y), 0.0f, 1.0f);
            even(x, y) = beyond - float(std::sqrt(double(nearest.value(x, y))));
        }
    // The nearest pixel changes from one to the next: a little smoothing takes its place.
    smooth_over(even, Mask(hole.window, 1), hole.bounds, int(kRimReach) / 2, Fit::mean);
    for (int y = box.y0; y < box.y1; ++y)
        for (int x = box.x0; x < box.x1; ++x) {
            float& d = distance(x, y);
            if (d > -1) continue;
            const float share = std::min(-d - 1, 1.0f); // from one to the other within a pixel
            d = std::min(d * (1 - share) + even(x, y) * share, -0.5f);
        }
    return distance;
}

std::vector<CutLevel> rim_levels(const Hole& hole, const Image<PartId>& core, const View& view,
                                 std::span<const Wall> walls, const RimParams& params) {
    const Image<float> width = band_widths(hole, core, params.blur_px);
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
