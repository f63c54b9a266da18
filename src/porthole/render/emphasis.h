// How targets are made to stand out in the hole.
#pragma once

#include <vector>

#include "porthole/render/gbuffer.h"
#include "porthole/render/render.h"
#include "porthole/render/surface.h"

namespace porthole {

/// Distance of two linear colours as seen, in OKLab units (black to white is 1).
[[nodiscard]] float color_distance(Vec3f a, Vec3f b);

/// The tint of every part, for its pixels that see it as a target through the hole. With
/// Emphasis::accent a target keeps its colour, more saturated, if that is distinct from the
/// mean colour of what is seen in and around the hole; else it gets the accent colour.
/// Cost: one material lookup for every fourth pixel of the buffer. One thread.
[[nodiscard]] std::vector<Tint> target_tints(const Scene& scene, const std::vector<Placement>& placements,
                                             const GBuffer& buffer, Emphasis emphasis);

} // namespace porthole
