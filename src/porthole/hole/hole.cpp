#include "porthole/hole/hole.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <string>

#include "porthole/base/error.h"
#include "porthole/hole/blur.h"
#include "porthole/hole/distance.h"
#include "porthole/hole/masks.h"

namespace porthole {
namespace {

/// Squared pixels are counted in 36ths: 36 r^2 is whole for r = depth, D/3 and 1/2.
constexpr std::int64_t kScale = 36;
constexpr std::int64_t kHalfPixelDisc = kScale / 4;

void require(bool holds, const char* where, const std::string& reason) {
    if (!holds) throw Error(ErrorKind::usage, "E0120", where, reason);
}

void check(std::span<const Vec2i> contour, const IdBuffer& targets, const Mask& covered, const Mask& enclosing,
           const HoleParams& params) {
    const Rect w = targets.window();
    require(targets.depth.window() == w && covered.window() == w, "grow_hole",
            "the windows of targets and covered differ");
    require(enclosing.window().intersected(w) == w, "grow_hole", "the window of enclosing does not hold the targets'");
    require(params.depth_px >= 1 && params.depth_px <= 4096, "depth_px",
            std::to_string(params.depth_px) + " is not in [1, 4096]");
    require(params.blur_px >= 0 && params.blur_px <= 4096, "blur_px",
            std::to_string(params.blur_px) + " is not in [0, 4096]");
    for (const Vec2i p : contour)
        require(targets.id.at_or(p.x, p.y, kNoPart) != kNoPart, "grow_hole", "a contour pixel is not a target's");
}

/// Mask, distance and unsmoothed floor of targets and discs; sites[i] is the disc of
/// hole.band[i].
void draw_discs(Hole& hole, const IdBuffer& target_ids, std::span<const PowerSite> sites, Rect box, int depth_px) {
    const Image<PartId>& targets = target_ids.id;
    hole.floor_depth = target_ids.depth;
    const auto deep = -(float(depth_px) + kRimReach);
    hole.mask = Mask(hole.window);
    hole.distance = Image<float>(hole.window);
    hole.width = Image<float>(hole.window);
    for (std::size_t i = 0; i < targets.pixels().size(); ++i) {
        const bool inside = targets.pixels()[i] != kNoPart;
        hole.mask.pixels()[i] = inside;
        hole.distance.pixels()[i] = inside ? deep : kRimReach;
    }

    // What a disc of the greatest radius is worth kRimReach beyond its rim; all others are
    // worth less there. A fixed limit, so that the same pixels are left out in every window.
    const std::int64_t limit = kScale * (2 * depth_px * std::int64_t(kRimReach) + std::int64_t(kRimReach * kRimReach));
    const PowerDistance power = power_distance_transform(box, sites, kScale, limit);
    std::vector<double> radius(sites.size());
    std::transform(sites.begin(), sites.end(), radius.begin(),
                   [](const PowerSite& s) { return std::sqrt(double(s.weight) / double(kScale)); });
    for (std::int32_t y = box.y0; y < box.y1; ++y)
        for (std::int32_t x = box.x0; x < box.x1; ++x) {
            const std::int32_t site = power.nearest(x, y);
            if (site < 0) continue;
            const Vec2i to = sites[std::size_t(site)].center - Vec2i{x, y};
            const double far_side = std::sqrt(double(dot(to, to))) + radius[std::size_t(site)];
            float& distance = hole.distance(x, y);
            hole.width(x, y) = float(radius[std::size_t(site)]);
            if (targets(x, y) != kNoPart) {
                distance = std::max(deep, float(-far_side));
            } else {
                // (|p-c|^2 - r^2) / (|p-c| + r) = |p-c| - r, with the sign of the integer.
                const std::int64_t value = power.value(x, y);
                distance = std::min(kRimReach, float(double(value) / (double(kScale) * far_side)));
                if (value > 0) continue;
                hole.mask(x, y) = 1;
                const Vec2i owner = sites[std::size_t(site)].center;
                hole.floor_depth(x, y) = target_ids.depth(owner.x, owner.y);
            }
        }

    // Where a target meets the outside the rim is the target's own silhouette. Its pixels
    // there are contour pixels or, with only a corner outside, 4-neighbours of one.
    const auto outside = [&](std::int32_t x, std::int32_t y) { return hole.mask.at_or(x, y, 1) == 0; };
    const auto meet = [&](std::int32_t x, std::int32_t y) {
        if (!targets.contains(x, y) || targets(x, y) == kNoPart) return;
        const bool side = outside(x - 1, y) || outside(x + 1, y) || outside(x, y - 1) || outside(x, y + 1);
        const bool corner =
            outside(x - 1, y - 1) || outside(x + 1, y - 1) || outside(x - 1, y + 1) || outside(x + 1, y + 1);
        if (side)
            hole.distance(x, y) = -0.5f;
        else if (corner)
            hole.distance(x, y) = float(0.5 - std::sqrt(2.0));
    };
    for (const BandPixel& c : hole.band)
        for (const Vec2i step : {Vec2i{0, 0}, Vec2i{1, 0}, Vec2i{-1, 0}, Vec2i{0, 1}, Vec2i{0, -1}})
            meet(c.pixel.x + step.x, c.pixel.y + step.y);
    hole.bounds = bounds_of(hole.mask);
}

} // namespace

int hole_margin_px(const HoleParams& params) {
    // The interpolated distance reads a pixel beyond the picture, and there discs whose rim
    // is kRimReach away; a contour pixel on the window's own edge may not be seen as one.
    return 4 * params.depth_px + 2 * int(std::lround(params.blur_px)) + int(kRimReach) + 2;
}

Hole grow_hole(std::span<const Contour> contours, const IdBuffer& targets, const Mask& covered, const Mask& enclosing,
               const HoleParams& params) {
    const std::vector<Vec2i> pixels = contour_pixels(contours);
    check(pixels, targets, covered, enclosing, params);

    const std::vector<std::int64_t> clearance2 = squared_distances(complement(enclosing), pixels);

    // The width of the band at each contour pixel, as a disc.
    Hole hole;
    hole.window = targets.window();
    std::vector<PowerSite> sites;
    bool any_band = false;
    const std::int64_t depth = params.depth_px;
    for (std::size_t i = 0; i < pixels.size(); ++i) {
        const Vec2i c = pixels[i];
        BandPixel& b = hole.band.emplace_back();
        b.pixel = c;
        b.target = targets.id(c.x, c.y);
        b.covered = covered(c.x, c.y) != 0;
        if (clearance2[i] != kFar) b.clearance_px = float(std::sqrt(double(clearance2[i])));
        std::int64_t weight = kHalfPixelDisc;
        if (b.covered) {
            b.width_px = float(std::min(double(depth), std::sqrt(double(clearance2[i])) / 3));
            const std::int64_t wanted = std::min(9 * depth * depth, clearance2[i]) * (kScale / 9);
            // A disc under a pixel wide holds no band, so half a pixel changes no mask.
            weight = std::max(weight, wanted);
            any_band |= wanted >= kScale;
        }
        sites.push_back({c, weight});
    }
    // One pixel more than anything below the limit of the distances reaches.
    const Rect box = bounds_of(pixels).grown(params.depth_px + int(kRimReach) + 1).intersected(hole.window);
    draw_discs(hole, targets, sites, pixels.empty() ? Rect{} : box, params.depth_px);
    if (any_band)
        hole.floor_depth =
            blur_floor(std::move(hole.floor_depth), hole.mask, targets.id, box, int(std::lround(params.blur_px)), 2);
    return hole;
}

std::vector<PartId> targets_without_room(const Hole& hole) {
    struct Count {
        std::size_t all = 0, covered = 0, narrow = 0;
    };
    std::map<PartId, Count> counts;
    for (const BandPixel& c : hole.band) {
        Count& count = counts[c.target];
        ++count.all;
        if (!c.covered) continue;
        ++count.covered;
        count.narrow += c.width_px < 1;
    }
    std::vector<PartId> refused;
    for (const auto& [target, count] : counts)
        if (2 * count.narrow > count.covered && 4 * count.covered > count.all) refused.push_back(target);
    return refused;
}

} // namespace porthole
