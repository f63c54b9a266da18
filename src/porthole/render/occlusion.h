// Shadow and ambient rays.
#pragma once

#include <span>
#include <vector>

#include "porthole/render/lighting.h"
#include "porthole/render/render.h"
#include "porthole/render/sampling.h"
#include "porthole/render/shade.h"

namespace porthole {

/// A point that asks what light reaches it.
struct Asker {
    Vec3f position, start, flat_normal, normal;
    bool in_hole = false;
    int pattern = 0; ///< which part of the patterns it traces, any number >= 0
};

/// Shadow rays of a pixel centre and lamp.
inline constexpr int kLampRays = 2;

/// Traces occlusion for one picture. Holds references; const use is thread-safe.
class Occlusion {
public:
    Occlusion(const Bvh& bvh, const Cut* cut, const Lighting& lighting, const RenderParams& params);

    /// Share of the lamps' light that reaches up to 16 points.
    /// @param each  rays a point and lamp, 1 or kLampRays; those of a point's pattern.
    void lamps(std::span<const Asker> points, int each, Vec3f* shares, RayCounts& rays) const;

    /// Sums over ambient rays: what is open, and what would be.
    struct Ambient {
        float open = 0, all = 0;
        [[nodiscard]] float share() const { return all > 0 ? open / all : 1.0f; }
    };
    /// Ambient rays of many points, params.ao_samples each: those of the points' patterns.
    /// Fastest when points that follow each other have the same pattern and lie close.
    void ambient(std::span<const Asker> points, Ambient* sums, RayCounts& rays) const;

    /// Both for a single point, from one packet of rays: for what is seen in mirrors, through
    /// glass, and where neighbours cannot help. No grain: the directions are always the same.
    [[nodiscard]] Reach reach(const Asker& point, RayCounts& rays) const;

private:
    [[nodiscard]] bool lamp_ray(const Lamp& lamp, std::size_t index, const Asker& point, int pattern, Vec3f& direction,
                                float& tfar, float& weight) const;
    void ambient_group(std::span<const Asker> points, Ambient* sums, bool in_hole, RayCounts& rays) const;

    const Bvh* bvh_;
    const Cut* cut_;
    const Lighting* lighting_;
    bool shadows_;
    int ambient_rays_;
    bool tinted_;                     ///< some surfaces tint the light that passes
    std::vector<AmbientRay> pattern_; ///< of a cell of pixels
    std::vector<AmbientRay> lone_;    ///< of a single point
    std::vector<Vec2f> disc_;
    std::vector<Frame3> lamp_frames_;
};

} // namespace porthole
