// What is gone: the one definition that primary, shadow, ambient, reflected and refracted
// rays share. hole/ makes it, trace/ and render/ obey it.
#pragma once

#include <cstdint>
#include <vector>

#include "porthole/base/ids.h"
#include "porthole/base/view.h"

namespace porthole {

enum class CutRole : std::uint8_t {
    fixed,   ///< targets and kept parts: never removed
    cut_set, ///< removed where nearer than the cut depth
    loose    ///< removed where nearer than the loose depth
};

/// The hole as it acts on rays.
///
/// All images share one window, which covers every pixel of the hole and one more around.
struct Cut {
    View view;
    Image<float> distance;     ///< signed distance to the hole's rim, pixels; <= 0 inside
    Image<float> cut_depth;    ///< metres along camera -z; geometry of the cut set nearer than this is gone
    Image<float> loose_depth;  ///< the same for loose parts; -infinity where nothing of the cut set was removed
    std::vector<CutRole> role; ///< by part id

    [[nodiscard]] bool empty() const { return distance.empty(); }

    /// Signed distance at a continuous pixel position, bilinear; positive outside the window.
    [[nodiscard]] float distance_at(float x, float y) const;
    /// Cut depth of `role` at a continuous pixel position that lies inside the hole: that of
    /// the pixel it falls in.
    [[nodiscard]] float depth_at(float x, float y, CutRole role) const;
    /// Whether the point `world` of `part` is gone: it is in front of the eye, projects into
    /// the hole, and is nearer than the cut (loose) depth there. Exact at pixel centres.
    [[nodiscard]] bool removes(Vec3f world, PartId part) const;
};

} // namespace porthole
