#include "porthole/render/emphasis.h"

namespace porthole {

namespace {

constexpr float kDistinct = 0.13f; ///< color_distance() at which two colours are told apart at a glance
constexpr float kFew = 0.3f;       ///< share of pixels that may have a target's colour
constexpr float kThin = 0.3f;      ///< share of inner pixels below which a target is thin
constexpr float kBetter = 1.3f;    ///< how much more another accent must stand out to be taken
constexpr Vec3f kAccents[] = {{0.95f, 0.36f, 0.06f}, {0.02f, 0.42f, 0.95f}};

/// OKLab (Ottosson 2020) with lightness halved.
Vec3f seen_as(Vec3f c) {
    const float l = std::cbrt(0.4122214708f * c.x + 0.5363325363f * c.y + 0.0514459929f * c.z);
    const float m = std::cbrt(0.2119034982f * c.x + 0.6806995451f * c.y + 0.1073969566f * c.z);
    const float s = std::cbrt(0.0883024619f * c.x + 0.2817188376f * c.y + 0.6299787005f * c.z);
    return {0.5f * (0.2104542553f * l + 0.7936177850f * m - 0.0040720468f * s),
            1.9779984951f * l - 2.4285922050f * m + 0.4505937099f * s,
            0.0259040371f * l + 0.7827717662f * m - 0.8086757660f * s};
}

/// Colours of pixels, as seen.
struct Surroundings {
    std::vector<Vec3f> lab;
    Vec3d sum;

    void add(Vec3f color) {
        lab.push_back(seen_as(color));
        sum += Vec3d(lab.back());
    }
    /// Mean distance to the pixels; beyond some distance more does not help.
    [[nodiscard]] float contrast(Vec3f color) const {
        const Vec3f c = seen_as(color);
        double total = 0;
        for (const Vec3f& l : lab) total += double(std::min(length(l - c), 0.4f));
        return lab.empty() ? 0.0f : float(total / double(lab.size()));
    }
    /// Share of the pixels that are hard to tell from `color`.
    [[nodiscard]] float share_like(Vec3f color) const {
        const Vec3f c = seen_as(color);
        std::size_t like = 0;
        for (const Vec3f& l : lab) like += length(l - c) < kDistinct;
        return lab.empty() ? 0.0f : float(like) / float(lab.size());
    }
    [[nodiscard]] bool sets_off(Vec3f color) const {
        if (lab.empty()) return true;
        const Vec3f mean(sum / double(lab.size()));
        return length(seen_as(color) - mean) >= kDistinct && share_like(color) < kFew;
    }
};

/// What is seen of one target.
struct Seen {
    Vec3d sum;
    double count = 0, inner = 0; ///< inner: all four neighbours see it too
    [[nodiscard]] Vec3f mean() const { return Vec3f(sum / count); }
    [[nodiscard]] bool thin() const { return inner < double(kThin) * count; }
};

bool shows_target(const GBuffer& buffer, int x, int y, PartId part) {
    return buffer.pixels.contains(x, y) && buffer.ids.id(x, y) == part && buffer.pixels(x, y).has(Pixel::on_target);
}

Vec3f as_drawn(Vec3f c) {
    return {std::clamp(c.x, kDarkest, kLightest), std::clamp(c.y, kDarkest, kLightest),
            std::clamp(c.z, kDarkest, kLightest)};
}

} // namespace

float color_distance(Vec3f a, Vec3f b) { return length(seen_as(a) - seen_as(b)); }

std::vector<Tint> target_tints(const Scene& scene, const std::vector<Placement>& placements, const GBuffer& buffer,
                               Emphasis emphasis) {
    if (emphasis == Emphasis::none) return {};
    if (emphasis == Emphasis::saturate) return std::vector<Tint>(scene.parts.size(), Tint{Tint::Kind::saturate, {}});

    Surroundings around;
    std::vector<Seen> targets(scene.parts.size());
    const Rect w = buffer.window();
    for (int y = w.y0 & ~1; y < w.y1; y += 2)
        for (int x = w.x0 & ~1; x < w.x1; x += 2) {
            if (!buffer.pixels.contains(x, y)) continue;
            const Hit hit = buffer.hit(x, y);
            if (!hit.any()) continue;
            const Vec3f c = substance(scene, placements[index(hit.part)], hit).color;
            if (!shows_target(buffer, x, y, hit.part)) {
                around.add(as_drawn(c));
                continue;
            }
            Seen& seen = targets[index(hit.part)];
            seen.sum += Vec3d(c);
            seen.count += 1;
            seen.inner += shows_target(buffer, x - 1, y, hit.part) && shows_target(buffer, x + 1, y, hit.part) &&
                          shows_target(buffer, x, y - 1, hit.part) && shows_target(buffer, x, y + 1, hit.part);
        }
    Tint accent{Tint::Kind::accent, kAccents[0]};
    if (around.contrast(kAccents[1]) > kBetter * around.contrast(kAccents[0])) accent.accent = kAccents[1];
    // What is thin, or too small to be met here, needs the accent most.
    std::vector<Tint> tints(scene.parts.size(), accent);
    for (std::size_t i = 0; i < tints.size(); ++i) {
        if (targets[i].count == 0 || targets[i].thin()) continue;
        const Tint own{Tint::Kind::saturate, {}};
        if (around.sets_off(as_drawn(tinted(targets[i].mean(), own)))) tints[i] = own;
    }
    return tints;
}

} // namespace porthole
