// How targets are made to stand out in the hole.
#pragma once

#include <vector>

#include "porthole/render/gbuffer.h"
#include "porthole/render/render.h"
#include "porthole/render/surface.h"

namespace porthole {

/// How differently two linear colours catch the eye: distance in OKLab with lightness at
/// half weight, because light and shadow change it anyway. Black to white is 0.5.
[[nodiscard]] float color_distance(Vec3f a, Vec3f b);

/// The tint of every part, for its pixels that see it as a target through the hole. With
/// Emphasis::accent a target keeps its colour, more saturated, if that is distinct from what
/// is seen in and around the hole: far from the mean colour, and from all but a few of the
/// pixels, and if it is not thin. Else it gets an accent colour: orange, or azure where that stands out far more.
/// Cost: one material lookup for every fourth pixel of the buffer. One thread.
[[nodiscard]] std::vector<Tint> target_tints(const Scene& scene, const std::vector<Placement>& placements,
                                             const GBuffer& buffer, Emphasis emphasis);

} // namespace porthole
