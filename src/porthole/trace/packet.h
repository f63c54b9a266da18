// Rays of the eye through sixteen points of the picture at once.
#pragma once

#include <cstdint>

#include "porthole/base/view.h"
#include "porthole/trace/bvh.h"

namespace porthole {

/// Sets every lane to the ray through (x[i], y[i]), continuous pixel coordinates, from the eye to
/// infinity: ready for intersect() or occluded(). Bit for bit the rays of View::ray().
/// @param depth_per_t  Ray::depth_per_t of each lane.
/// Cost: about two rays of View::ray().
void set_rays(RayHit16& rays, float (&depth_per_t)[kLanes], const View& view, const float (&x)[kLanes],
              const float (&y)[kLanes], std::uint32_t mask = kMaskAll);

/// The same through the centres of a 4x4 block of pixels; lane i is pixel (x0 + i % 4, y0 + i / 4).
/// Lanes outside `window` are inactive.
/// @return number of active lanes
int set_block_rays(RayHit16& rays, float (&depth_per_t)[kLanes], const View& view, int x0, int y0, Rect window,
                   std::uint32_t mask = kMaskAll);

} // namespace porthole
