// The cut surface as something that is seen: its points and what it is made of.
#pragma once

#include "porthole/base/cut.h"
#include "porthole/render/render.h"
#include "porthole/render/surface.h"

namespace porthole {

/// The point of a level's cut surface at continuous pixel position (x, y), which lies in the
/// hole, at `depth`. Its normal follows from the depths a pixel to the sides, not across
/// steps; it faces the viewer. Secondary rays start as far off the surface as it bends within a
/// pixel, so that the facets of the cap mesh cast no shadow on it.
[[nodiscard]] SurfacePoint cap_point(const Cut& cut, std::size_t level, float x, float y, float depth);

/// What a cap is made of.
/// CapStyle::own: the part's colour at `hit`, darker if it is light, greyer if it is dark. Matte,
/// but see-through materials stay as they are.
/// @param at  continuous pixel position.
[[nodiscard]] Substance cap_substance(const Scene& scene, const Placement& placement, const Hit& hit,
                                      const RenderParams& params, Vec2f at, int picture_height);

} // namespace porthole
