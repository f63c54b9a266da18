#include "porthole/debug.h"

#include <algorithm>
#include <cmath>

namespace porthole {

namespace {

Rgba8 color_of(PartId id) {
    if (id == kNoPart) return {255, 255, 255, 255};
    std::uint32_t h = index(id) * 2654435761u;
    h ^= h >> 15;
    h *= 2246822519u;
    h ^= h >> 13;
    // Neither black nor white, so that parts stand off the background.
    return {std::uint8_t(40 + (h & 0xFF) * 180 / 255), std::uint8_t(40 + (h >> 8 & 0xFF) * 180 / 255),
            std::uint8_t(40 + (h >> 16 & 0xFF) * 180 / 255), 255};
}

template <typename T, typename Color> Image<Rgba8> drawn(const Image<T>& image, Color&& color) {
    Image<Rgba8> out(image.window());
    for (std::size_t i = 0; i < image.pixels().size(); ++i) out.pixels()[i] = color(image.pixels()[i]);
    return out;
}

Image<Rgba8> drawn_ids(const Image<PartId>& ids) { return drawn(ids, color_of); }

Image<Rgba8> drawn_mask(const Mask& mask) {
    return drawn(mask, [](std::uint8_t v) { return v ? Rgba8{255, 255, 255, 255} : Rgba8{30, 30, 30, 255}; });
}

Image<Rgba8> drawn_depth(const Image<float>& depth) {
    float near = kInfinity, far = -kInfinity;
    for (const float d : depth.pixels())
        if (std::isfinite(d)) near = std::min(near, d), far = std::max(far, d);
    const float scale = far > near ? 1 / (far - near) : 0.0f;
    return drawn(depth, [&](float d) {
        if (!std::isfinite(d)) return Rgba8{30, 30, 60, 255};
        const auto v = std::uint8_t(std::lround(240 - 190 * (d - near) * scale));
        return Rgba8{v, v, v, 255};
    });
}

Image<Rgba8> drawn_distance(const Image<float>& distance) {
    return drawn(distance, [](float d) {
        const float line = std::abs(std::remainder(d, 10.0f));
        const float shade = (line < 0.5f ? 0.5f : 1.0f) * (1 - std::min(std::abs(d), 200.0f) / 400);
        const auto byte = [&](float v) { return std::uint8_t(std::lround(v * shade)); };
        return d <= 0 ? Rgba8{byte(90), byte(150), byte(255), 255} : Rgba8{byte(255), byte(190), byte(110), 255};
    });
}

Image<Rgba8> drawn_contours(const ViewPlan& plan) {
    Image<Rgba8> out = drawn(plan.target_ids.id, [](PartId id) {
        return id == kNoPart ? Rgba8{30, 30, 30, 255} : Rgba8{90, 90, 90, 255};
    });
    for (const BandPixel& c : plan.hole.band)
        out(c.pixel.x, c.pixel.y) = c.covered ? Rgba8{255, 140, 30, 255} : Rgba8{80, 160, 255, 255};
    if (plan.hole.empty())
        for (const Vec2i p : contour_pixels(plan.contours)) out(p.x, p.y) = {80, 160, 255, 255};
    return out;
}

/// Each band pixel's own disc centre, bright where the band got all it asked for.
Image<Rgba8> drawn_widths(const ViewPlan& plan) {
    Image<Rgba8> out(plan.window, {30, 30, 30, 255});
    for (const BandPixel& c : plan.hole.band) {
        const float share = plan.depth_px > 0 ? std::clamp(c.width_px / float(plan.depth_px), 0.0f, 1.0f) : 0.0f;
        out(c.pixel.x, c.pixel.y) = {std::uint8_t(255 - std::lround(175 * share)),
                                     std::uint8_t(80 + std::lround(175 * share)), 80, 255};
    }
    return out;
}

/// Caps yellow, backs of parts without caps red.
Image<Rgba8> drawn_inside(const Mask& inside) {
    return drawn(inside, [](std::uint8_t v) {
        if (v == Frame::cap) return Rgba8{240, 200, 60, 255};
        return v == Frame::open_back ? Rgba8{220, 60, 50, 255} : Rgba8{30, 30, 30, 255};
    });
}

} // namespace

std::vector<NamedPicture> debug_pictures(const ViewPlan& plan, const Frame* before, const Frame* after,
                                         const Mask* inferred) {
    std::vector<NamedPicture> pictures;
    const auto add = [&](const std::string& name, Image<Rgba8> picture) {
        if (!picture.empty()) pictures.push_back({name, std::move(picture)});
    };
    if (before) add("01-parts-before", drawn_ids(before->ids.id));
    if (before) add("02-depth-before", drawn_depth(before->ids.depth));
    add("03-targets", drawn_ids(plan.target_ids.id));
    add("04-target-depth", drawn_depth(plan.target_ids.depth));
    add("05-nearest-in-front", drawn_depth(plan.spans.nearest));
    if (!plan.window.empty() && !plan.target_ids.id.empty()) add("06-contour", drawn_contours(plan));
    add("07-enclosing", drawn_mask(plan.enclosing));
    if (!plan.hole.empty()) {
        add("08-width", drawn_widths(plan));
        add("09-hole", drawn_mask(plan.hole.mask));
        add("10-distance", drawn_distance(plan.hole.distance));
        add("11-floor-depth", drawn_depth(plan.hole.floor_depth));
    }
    add("11-core-depth", drawn_depth(plan.core.depth));
    for (std::size_t level = 0; level < plan.walls.size(); ++level) {
        add("11-wall-front-" + std::to_string(level), drawn_depth(plan.walls[level].first));
        add("11-wall-next-" + std::to_string(level), drawn_depth(plan.walls[level].next));
    }
    for (std::size_t level = 0; level < plan.cut.levels.size(); ++level) {
        Image<float> depth(plan.window, kInfinity);
        for (std::size_t i = 0; i < depth.pixels().size(); ++i)
            depth.pixels()[i] = plan.cut.levels[level].pixels()[i].depth(-plan.cut.distance.pixels()[i]);
        add("12-cut-depth-" + std::to_string(level), drawn_depth(depth));
    }
    add("13-loose-depth", drawn_depth(plan.cut.loose_depth));
    if (after) add("16-inside", drawn_inside(after->inside));
    if (after) add("14-parts-after", drawn_ids(after->ids.id));
    if (after) add("15-depth-after", drawn_depth(after->ids.depth));
    if (inferred)
        add("17-traced", drawn(*inferred, [](std::uint8_t v) {
                const std::uint8_t grey = v ? 0 : 255;
                return Rgba8{grey, grey, grey, 255};
            }));
    return pictures;
}

} // namespace porthole
