// Shading of what rays meet, and the mirrored, refracted and straight rays that go on from
// there. Iterative: rays wait in a queue and are traced sixteen at a time.
#pragma once

#include <array>
#include <span>
#include <vector>

#include "porthole/render/lighting.h"
#include "porthole/render/occlusion.h"
#include "porthole/render/primary.h"
#include "porthole/render/shade.h"

namespace porthole {

/// Light gathered for one sample.
struct Radiance {
    Vec3f light{0, 0, 0};      ///< scene-linear
    Vec3f shown{0, 0, 0};      ///< display-linear as it is
    Vec3f background{0, 0, 0}; ///< share of the background that shows
};

/// Display-linear, premultiplied: light through the shoulder. What shows of the background
/// goes into alpha as far as all channels share it, the rest is added in its colour.
[[nodiscard]] Vec4f display_color(const Radiance& radiance, Vec3f background);

/// Bodies that a ray is inside of, the innermost last.
struct Media {
    static constexpr int kMost = 4;
    std::array<std::int32_t, kMost> material{}; ///< index into Scene::materials
    int count = 0;
    void enter(std::int32_t m) {
        if (count < kMost) material[std::size_t(count++)] = m;
    }
    void leave(std::int32_t m);
    [[nodiscard]] std::int32_t innermost() const { return count > 0 ? material[std::size_t(count - 1)] : kNone; }
};

/// A ray that waits to be traced.
struct PathRay {
    Vec3f origin, direction;
    Vec3f weight{1, 1, 1};
    std::uint32_t slot = 0; ///< whose radiance it adds to
    int bounce = 0;         ///< surfaces behind it
    int pattern = 0;        ///< which part of the patterns it takes where it spreads, >= 0
    float roughness = 0;    ///< of the mirror it comes from
    float width = 0;        ///< of the cone around the ray at `origin`, metres; at add(), at the hit
    float widening = 0;     ///< of that cone, metres a metre
    bool in_hole = false;
    bool spread = false; ///< one of many that frosted glass made of a camera ray
    bool through = true; ///< it only ever passed through things: it sees the background, not the sky
    Media media;
};

/// Everything that shading needs to know. References; const use is thread-safe.
struct Stage {
    const Scene& scene;
    const Bvh& bvh;
    const Cut* cut;
    const RenderParams& params;
    const Lighting& lighting;
    const Occlusion& occlusion;
    const std::vector<Placement>& placements;
    const std::vector<Tint>& tints; ///< by part, for targets in the hole; may be empty
};

/// Shades samples and follows their rays. One per thread and batch of samples.
class Shader {
public:
    /// @param slots  how many samples are gathered at once.
    /// @param averaged  the samples are some of many that are averaged: few shadow and ambient
    ///                  rays at what mirrors and glass show, of patterns that differ by sample.
    Shader(const Stage& stage, std::size_t slots, bool averaged, RayCounts& rays)
        : stage_(&stage), radiance_(slots), averaged_(averaged), rays_(&rays) {}

    /// A camera ray that meets nothing.
    void miss(std::uint32_t slot) { radiance_[slot].background = {1, 1, 1}; }
    /// Adds what a ray sees at `hit` and queues the rays that go on.
    /// @param ray     `origin` is not used.
    /// @param point   of the hit.
    void add(const PathRay& ray, const Hit& hit, const SurfacePoint& point, const Reach& reach, bool on_target);
    /// Traces the queue until it is empty.
    void finish();
    [[nodiscard]] const Radiance& radiance(std::uint32_t slot) const { return radiance_[slot]; }
    void clear() { radiance_.assign(radiance_.size(), Radiance{}); }

private:
    void pass_through(const PathRay& ray, const Hit& hit, const Substance& substance, const SurfacePoint& point,
                      Vec3f normal, Vec3f weight, bool body);
    void push(const PathRay& ray);
    void end_in_surroundings(const PathRay& ray);
    void trace_oldest();
    void reach_of(std::span<const Asker> points, bool averaged, Reach* reach);

    const Stage* stage_;
    std::vector<Radiance> radiance_;
    bool averaged_;
    std::vector<PathRay> queue_;
    std::size_t oldest_ = 0; ///< in the queue, of those not yet traced
    RayCounts* rays_;
};

} // namespace porthole
