// Primitives as a user geometry of Embree.
#pragma once

#include <embree3/rtcore.h>

#include "porthole/scene/scene.h"

namespace porthole {

/// What the callbacks of a geometry read.
struct PrimitiveGeometry {
    const Mesh* mesh = nullptr;                    ///< of primitives
    void* filter_data = nullptr;                   ///< handed to the filters as geometryUserPtr
    RTCFilterFunctionN intersect_filter = nullptr; ///< may be null: every hit counts
    RTCFilterFunctionN occluded_filter = nullptr;
};

/// Makes `geometry`, of type user, that of the primitives of a mesh. Rays meet surfaces after
/// tnear and up to tfar, as they do triangles. A hit's primID is the surface, u and v are its
/// surface_coordinates(), Ng is the outward unit normal, on the side that the order of crossings
/// says even where the ray only grazes. The occlusion filter is offered every crossing between
/// tnear and tfar, nearest first, until it accepts one.
/// @param data  must outlive the geometry.
void set_primitives(RTCGeometry geometry, const PrimitiveGeometry& data);

} // namespace porthole
