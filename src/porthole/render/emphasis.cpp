#include "porthole/render/emphasis.h"

namespace porthole {

namespace {

constexpr float kDistinct = 0.13f; ///< at least this far from the surroundings keeps its own colour

Vec3f oklab(Vec3f c) { // Ottosson 2020
    const float l = std::cbrt(0.4122214708f * c.x + 0.5363325363f * c.y + 0.0514459929f * c.z);
    const float m = std::cbrt(0.2119034982f * c.x + 0.6806995451f * c.y + 0.1073969566f * c.z);
    const float s = std::cbrt(0.0883024619f * c.x + 0.2817188376f * c.y + 0.6299787005f * c.z);
    return {0.2104542553f * l + 0.7936177850f * m - 0.0040720468f * s,
            1.9779984951f * l - 2.4285922050f * m + 0.4505937099f * s,
            0.0259040371f * l + 0.7827717662f * m - 0.8086757660f * s};
}

struct Mean {
    Vec3d sum;
    double count = 0;
    void add(Vec3f c) {
        sum += Vec3d(c);
        count += 1;
    }
    [[nodiscard]] Vec3f value() const { return Vec3f(sum / count); }
};

} // namespace

float color_distance(Vec3f a, Vec3f b) { return length(oklab(a) - oklab(b)); }

std::vector<Tint> target_tints(const Scene& scene, const std::vector<Placement>& placements, const GBuffer& buffer,
                               Emphasis emphasis) {
    if (emphasis == Emphasis::none) return {};
    if (emphasis == Emphasis::saturate) return std::vector<Tint>(scene.parts.size(), Tint{Tint::Kind::saturate});

    Mean around;
    std::vector<Mean> targets(scene.parts.size());
    const Rect w = buffer.window();
    for (int y = w.y0 & ~1; y < w.y1; y += 2)
        for (int x = w.x0 & ~1; x < w.x1; x += 2) {
            if (!buffer.pixels.contains(x, y)) continue;
            const Hit hit = buffer.hit(x, y);
            if (!hit.any()) continue;
            const Vec3f c = substance(scene, placements[index(hit.part)], hit).color;
            const Vec3f seen{std::clamp(c.x, kDarkest, kLightest), std::clamp(c.y, kDarkest, kLightest),
                             std::clamp(c.z, kDarkest, kLightest)};
            if (buffer.pixels(x, y).has(Pixel::on_target)) targets[index(hit.part)].add(seen);
            else around.add(seen);
        }
    // What is too small to be met here needs the accent most.
    std::vector<Tint> tints(scene.parts.size(), Tint{Tint::Kind::accent});
    for (std::size_t i = 0; i < tints.size(); ++i) {
        if (targets[i].count == 0) continue;
        if (around.count == 0 || color_distance(targets[i].value(), around.value()) >= kDistinct)
            tints[i].kind = Tint::Kind::saturate;
    }
    return tints;
}

} // namespace porthole
