// Camera rays: what each sample sees, with and without a hole.
#pragma once

#include "porthole/render/render.h"
#include "porthole/render/surface.h"

namespace porthole {

/// Sixteen camera samples at continuous pixel positions.
struct Samples16 {
    float x[kLanes] = {}, y[kLanes] = {};
    bool active[kLanes] = {};
    bool at_centres = false;    ///< of pixels, all of them
    bool may_open[kLanes] = {}; ///< the sample's pixel can have samples in the hole
};

struct Seen16 {
    Hit hit[kLanes];
    Vec3f origin[kLanes];
    Vec3f direction[kLanes];
    float depth[kLanes];    ///< metres along camera -z; +infinity if nothing is hit
    bool in_hole[kLanes];   ///< the sample lies in the hole: its rays obey the cut
    bool on_target[kLanes]; ///< what it sees is an opened target, with a cut: in the hole
};

/// Traces camera rays of one view. Holds references; const use is thread-safe.
class Camera {
public:
    /// @param targets  opened ones; null: none.
    /// @param cut      null for a plain picture.
    /// @param caps          of the cut; may be null.
    Camera(const Bvh& bvh, const Bvh* targets, const View& view, const Cut* cut, const Caps* caps = nullptr);

    /// Nearest hits. A sample that may open asks the targets first: one that hits sees the
    /// target, or what is kept in front of it; else it is in the hole where the rim's signed
    /// distance is not positive, and sees the nearest of what the cut leaves. Other samples
    /// see the plain scene.
    [[nodiscard]] Seen16 trace(const Samples16& samples, RayCounts& rays) const;

    /// The point that a sample at continuous pixel position (x, y) sees.
    [[nodiscard]] SurfacePoint surface(const std::vector<Placement>& placements, const Hit& hit, float x, float y,
                                       float depth, Vec3f direction) const;
    [[nodiscard]] const Cut* cut() const { return cut_; }

private:
    void trace_open(const Samples16& samples, const float (&depth_per_t)[kLanes], Seen16& seen, bool (&plain)[kLanes],
                    RayCounts& rays) const;
    void trace_role(std::uint32_t mask, const float (&tnear)[kLanes], const float (&depth_per_t)[kLanes],
                    float tolerance, Seen16& seen, RayCounts& rays, const float* end = nullptr) const;

    /// Where rays meet the cut surface of each level, and what of it is capped.
    struct LevelLanes {
        CutLanes cut;
        CapLanes caps;
        float depth[kMostLevels][kLanes]; ///< metres along camera -z
        [[nodiscard]] bool is_capped(std::size_t level, int lane) const {
            return cut.t[level][lane] < kInfinity && caps.cap[level][lane].part != kNoPart;
        }
    };
    void find_levels(const Samples16& samples, const float (&depth_per_t)[kLanes], const Seen16& seen,
                     LevelLanes& found) const;
    void trace_level(std::size_t k, LevelLanes& levels, const float (&depth_per_t)[kLanes], Seen16& seen,
                     RayCounts& rays) const;

    const Bvh* bvh_;
    const Bvh* targets_;
    const View* view_;
    const Cut* cut_;
    const Caps* caps_;
    float tolerance_ = 0; ///< metres in front of a target that count as behind it
    bool has_kept_ = false, has_cut_set_ = false, has_loose_ = false;
};

} // namespace porthole
