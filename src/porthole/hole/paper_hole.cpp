#include <algorithm>
#include <cmath>
#include <set>
#include <string>
#include <tuple>

#include "porthole/base/error.h"
#include "porthole/hole/directions.h"
#include "porthole/hole/distance.h"
#include "porthole/hole/hole.h"
#include "porthole/hole/masks.h"

namespace porthole {
namespace {

/// A contour pixel C and one of its outgoing normals N_0.
struct Outgoing {
    Vec2i pixel;
    int normal = 0; ///< direction code
};

int code_of(Vec2i step) { return int(std::find(std::begin(kDirections), std::end(kDirections), step) - kDirections); }

std::vector<Outgoing> outgoing_normals(const Contour& contour, const Image<PartId>& ids, PartId id) {
    std::vector<Outgoing> outgoing;
    const std::vector<Vec2i>& chain = contour.pixels;
    if (chain.size() < 2) return outgoing; // no following pixel, no tangent
    for (std::size_t i = 0; i < chain.size(); ++i) {
        const bool last = i + 1 == chain.size();
        const int tangent = !last            ? code_of(chain[i + 1] - chain[i])
                            : contour.closed ? code_of(chain[0] - chain[i])
                                             : code_of(chain[i] - chain[i - 1]);
        for (const int normal : {tangent + 2, tangent - 2}) {
            const Vec2i n = neighbour(chain[i], normal);
            if (ids.at_or(n.x, n.y, kNoPart) != id) outgoing.push_back({chain[i], normal & 7});
        }
    }
    return outgoing;
}

/// Pixels of the hole at depth k: N_k, P_k and F_k, but those on targets or beyond the window.
std::vector<Vec2i> pixels_at_depth(std::span<const Outgoing> outgoing, int k, const Image<PartId>& ids) {
    std::vector<Vec2i> pixels;
    for (const Outgoing& o : outgoing)
        for (const int code : {o.normal, o.normal - 1, o.normal + 1}) {
            const Vec2i p = o.pixel + direction(code) * k;
            if (ids.contains(p.x, p.y) && ids(p.x, p.y) == kNoPart) pixels.push_back(p);
        }
    return pixels;
}

/// Pixels of E with a 4-neighbour outside E.
Mask border_of(const Mask& enclosing) {
    const Rect w = enclosing.window();
    Mask border(w);
    for (std::int32_t y = w.y0; y < w.y1; ++y)
        for (std::int32_t x = w.x0; x < w.x1; ++x)
            border(x, y) = enclosing(x, y) && !(enclosing.at_or(x - 1, y, 1) && enclosing.at_or(x + 1, y, 1) &&
                                                enclosing.at_or(x, y - 1, 1) && enclosing.at_or(x, y + 1, 1));
    return border;
}

/// d: smallest distance, in pixels, from `pixels` to the border of E; 0 if one is outside E.
float smallest_distance(std::span<const Vec2i> pixels, const Mask& enclosing, const Image<std::int64_t>& to_border) {
    std::int64_t least = kFar;
    for (const Vec2i p : pixels) least = std::min(least, enclosing(p.x, p.y) ? to_border(p.x, p.y) : 0);
    return least == kFar ? kInfinity : float(std::sqrt(double(least)));
}

/// Signed distance to the border of `mask`, up to kRimReach outside.
Image<float> distance_near(const Mask& mask, Rect bounds) {
    Image<float> distance(mask.window(), kRimReach);
    if (bounds.empty()) return distance;
    // The frame of outside pixels makes distances in the box the same as in the window.
    const Rect box = bounds.grown(int(kRimReach) + 1).intersected(mask.window());
    Mask inside(box);
    for (std::int32_t y = box.y0; y < box.y1; ++y)
        for (std::int32_t x = box.x0; x < box.x1; ++x) inside(x, y) = mask(x, y);
    const Image<float> exact = signed_distance(inside);
    for (std::int32_t y = box.y0; y < box.y1; ++y)
        for (std::int32_t x = box.x0; x < box.x1; ++x) distance(x, y) = std::min(exact(x, y), kRimReach);
    return distance;
}

void check(const PaperContours& contours, const IdBuffer& targets, const Mask& enclosing, int depth_px,
           const Mask& covered) {
    const auto require = [](bool holds, const char* where, const std::string& reason) {
        if (!holds) throw Error(ErrorKind::usage, "E0120", where, reason);
    };
    const Rect w = targets.window();
    require(covered.empty() || covered.window() == w, "grow_hole_paper", "the windows of targets and covered differ");
    require(enclosing.window().intersected(w) == w, "grow_hole_paper",
            "the window of enclosing does not hold the targets'");
    require(depth_px >= 1 && depth_px <= 4096, "depth_px", std::to_string(depth_px) + " is not in [1, 4096]");
    require(contours.ids.size() == contours.contours.size(), "grow_hole_paper", "a contour has no id");
    for (const Contour& contour : contours.contours)
        for (const Vec2i p : contour.pixels)
            require(targets.id.at_or(p.x, p.y, kNoPart) != kNoPart, "grow_hole_paper",
                    "a contour pixel is not a target's");
}

} // namespace

PaperHole grow_hole_paper(const PaperContours& contours, const IdBuffer& targets, const Mask& enclosing, int depth_px,
                          const Mask& covered) {
    check(contours, targets, enclosing, depth_px, covered);
    const Image<PartId>& ids = targets.id;
    const Image<std::int64_t> to_border = distance_transform(border_of(enclosing));
    PaperHole result;
    Hole& hole = result.hole;
    hole.window = targets.window();
    hole.mask = Mask(hole.window);
    hole.floor_depth = Image<float>(hole.window, kInfinity);

    std::set<PartId> accepted;
    for (std::size_t i = 0; i < contours.contours.size(); ++i) {
        const PartId id = contours.ids[i];
        const std::vector<Outgoing> outgoing = outgoing_normals(contours.contours[i], ids, id);
        PaperHole::PerTarget& target = result.targets.emplace_back();
        target.target = id;
        for (int k = 1; k <= depth_px; ++k) {
            const std::vector<Vec2i> pixels = pixels_at_depth(outgoing, k, ids);
            const float d = smallest_distance(pixels, enclosing, to_border);
            if (k == 1) target.distance_px = d;
            if (!(float(k) <= d / 2)) break;
            target.depth_px = k;
            target.distance_px = d;
            for (const Vec2i p : pixels) hole.mask(p.x, p.y) = 1;
        }
        if (target.depth_px > 0) accepted.insert(id);
        for (const Vec2i c : contours.contours[i].pixels) {
            BandPixel& b = hole.band.emplace_back();
            b.pixel = c;
            b.target = id;
            b.covered = (covered.empty() ? enclosing : covered)(c.x, c.y) != 0;
            b.width_px = float(target.depth_px);
        }
    }
    std::sort(hole.band.begin(), hole.band.end(), [](const BandPixel& a, const BandPixel& b) {
        return std::tie(a.pixel.y, a.pixel.x) < std::tie(b.pixel.y, b.pixel.x);
    });
    std::vector<Vec2i> pixels;
    for (const BandPixel& b : hole.band) pixels.push_back(b.pixel);
    const std::vector<std::int64_t> clearance2 = squared_distances(complement(enclosing), pixels);
    for (std::size_t i = 0; i < pixels.size(); ++i)
        if (clearance2[i] != kFar) hole.band[i].clearance_px = float(std::sqrt(double(clearance2[i])));

    PartId last = kNoPart; // neighbours mostly share their part
    bool last_accepted = false;
    for (std::size_t i = 0; i < ids.pixels().size(); ++i) {
        const PartId id = ids.pixels()[i];
        if (id == kNoPart) continue;
        if (id != last) last = id, last_accepted = accepted.contains(id);
        hole.mask.pixels()[i] = last_accepted;
    }
    hole.bounds = bounds_of(hole.mask);
    hole.distance = distance_near(hole.mask, hole.bounds);
    return result;
}

} // namespace porthole
