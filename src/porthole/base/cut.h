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
    cut_set, ///< removed where nearer than the cut depth of its level
    loose    ///< removed where nearer than the loose depth
};

/// Where the cut surface of a part is drawn, as a cap.
enum class CapRule : std::uint8_t {
    none,  ///< open, around the eye, or not cut: back faces are seen
    shell, ///< closed around a target: on the chamfer only
    solid  ///< closed: wherever the cut passes through it
};

/// How deep one level of parts is cut along the rays of one pixel, as a function of how far
/// inside the rim a ray is. Depths are metres along camera -z.
struct CutProfile {
    float start = 0;          ///< pixels inside the rim from which on the level is cut
    float front = -kInfinity; ///< depth of the chamfer where it starts
    float slope = 0;          ///< metres of depth a pixel, over the chamfer; >= 0
    float width = 0;          ///< of the chamfer, pixels; 0: straight walls
    float floor = -kInfinity; ///< depth beyond the chamfer, and the most anywhere; -infinity outside the hole

    friend bool operator==(const CutProfile&, const CutProfile&) = default;
    /// Depth nearer than which the level is gone `inside` pixels inside the rim; -infinity: nothing is.
    [[nodiscard]] float depth(float inside) const {
        const float r = inside - start;
        if (!(r >= 0)) return -kInfinity;
        if (!(r < width)) return floor;
        const float z = front + slope * r;
        return z < floor ? z : floor;
    }
    [[nodiscard]] bool on_chamfer(float inside) const { return inside >= start && inside - start < width; }
};

/// Parts that open together: one step of the rim.
using CutLevel = Image<CutProfile>;

/// Depth of a level's cut at a point of the picture.
struct CutDepth {
    float depth = -kInfinity; ///< nearer is gone
    bool chamfer = false;     ///< on the chamfer, where shells are capped
};

/// Between which depths the cut of a level runs in a pixel: what is nearer than `near` is gone
/// wherever in the pixel it lies, what is not nearer than `far` is not.
struct CutRange {
    float near = -kInfinity, far = kInfinity;
    friend bool operator==(const CutRange&, const CutRange&) = default;
};

/// The hole as it acts on rays.
///
/// All images share one window, which covers every pixel of the hole and one more around.
struct Cut {
    View view;
    Image<float> distance;           ///< signed distance to the hole's rim, pixels; <= 0 inside
    std::vector<CutLevel> levels;    ///< outermost first; at least one unless empty()
    Image<float> loose_depth;        ///< loose parts nearer than this are gone; -infinity where no cut part was removed
    std::vector<CutRole> role;       ///< by part id
    std::vector<std::uint8_t> level; ///< by part id: of parts of the cut set; empty: all 0
    std::vector<CapRule> cap;        ///< by part id; empty: no caps
    std::vector<Image<CutRange>> ranges; ///< by level, from index_ranges(); empty: removes() is slower

    [[nodiscard]] bool empty() const { return distance.empty(); }
    [[nodiscard]] std::size_t level_of(PartId part) const { return level.empty() ? 0 : level[porthole::index(part)]; }
    [[nodiscard]] CapRule cap_of(PartId part) const { return cap.empty() ? CapRule::none : cap[porthole::index(part)]; }

    /// Signed distance at a continuous pixel position, bilinear; positive outside the window.
    [[nodiscard]] float distance_at(float x, float y) const;
    /// How deep a level is cut at a continuous pixel position inside the hole: the profile,
    /// interpolated between the pixels around that lie in the hole unless their floors are a
    /// step apart, at the interpolated distance from the rim. Exact at pixel centres.
    [[nodiscard]] CutDepth depth_at(float x, float y, std::size_t level) const;
    /// The loose depth of the pixel, or of the nearest one across the rim.
    [[nodiscard]] float loose_depth_at(float x, float y) const;
    /// Whether the point `world` of `part` is gone for light: it is in front of the eye, projects
    /// into the hole, and is nearer than the cut (loose) depth there, or behind the cut by less
    /// than a pixel's size: what lies on the cut surface, such as the half of a shaft that is
    /// left in its bore, would only speckle it.
    [[nodiscard]] bool removes(Vec3f world, PartId part) const;
};

/// Fills `cut.ranges`, which let removes() answer at a glance for most points. To be called again
/// when the cut has changed. Cost: linear in the window.
void index_ranges(Cut& cut);

} // namespace porthole
