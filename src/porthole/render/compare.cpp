#include "porthole/render/compare.h"

#include <algorithm>
#include <cassert>
#include <cmath>

#include "porthole/base/tone.h"

namespace porthole {

double Refinement::psnr_db() const {
    return mean_squared_error > 0 ? 10 * std::log10(255.0 * 255.0 / mean_squared_error) : double(kInfinity);
}

Refinement compare_frames(const Frame& frame, const Frame& full, Vec3f background) {
    assert(frame.color.window() == full.color.window());
    Refinement c;
    c.pixels = std::int64_t(full.color.pixels().size());
    const std::span<const std::uint8_t> inferred = frame.inferred.pixels();
    c.traced = c.pixels - std::count(inferred.begin(), inferred.end(), std::uint8_t(1));
    c.rays = frame.rays, c.full_rays = full.rays;

    const std::span<const PartId> found = frame.ids.id.pixels(), right = full.ids.id.pixels();
    std::vector<std::uint8_t> shown;
    const auto note = [&](PartId id, std::uint8_t bit) {
        if (id == kNoPart) return;
        if (shown.size() <= index(id)) shown.resize(index(id) + std::size_t(1));
        shown[index(id)] |= bit;
    };
    for (std::size_t i = 0; i < right.size(); ++i) {
        c.wrong_ids += found[i] != right[i];
        note(found[i], 1), note(right[i], 2);
    }
    for (std::size_t id = 0; id < shown.size(); ++id)
        if (shown[id] == 2) c.missed.push_back(PartId(std::uint32_t(id)));

    const Image<Rgba8> a = to_srgb8(frame.color, background, false), b = to_srgb8(full.color, background, false);
    const auto squared = [](int x, int y) { return std::int64_t(x - y) * (x - y); };
    std::int64_t sum = 0;
    for (std::size_t i = 0; i < a.pixels().size(); ++i) {
        const Rgba8 p = a.pixels()[i], q = b.pixels()[i];
        sum += squared(p.r, q.r) + squared(p.g, q.g) + squared(p.b, q.b);
    }
    if (c.pixels > 0) c.mean_squared_error = double(sum) / double(3 * c.pixels);
    return c;
}

RenderParams full_of(RenderParams params) {
    if (is_selective(params.refine)) params.samples = 1;
    params.refine = Refine::full;
    return params;
}

} // namespace porthole
