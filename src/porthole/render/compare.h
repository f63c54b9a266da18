// What refinement costs and saves: a picture against the same one with every pixel traced.
#pragma once

#include <vector>

#include "porthole/render/render.h"

namespace porthole {

/// A refined picture compared with the full one.
struct Refinement {
    std::int64_t pixels = 0;       ///< of the picture
    std::int64_t traced = 0;       ///< of them whose id was traced for the picture
    std::int64_t wrong_ids = 0;    ///< whose id is not the full picture's
    std::vector<PartId> missed;    ///< parts that the full picture shows and this one nowhere; by id
    double mean_squared_error = 0; ///< of the 8-bit sRGB channels
    RayCounts rays, full_rays;     ///< of both

    [[nodiscard]] double psnr_db() const; ///< +infinity: not one channel differs
};

/// @param frame  as render() made it: before trace_inferred_ids().
/// @param full   of the same view, with RenderParams of full_of().
/// @param background  linear; laid under both.
/// Cost: passes over the pictures.
[[nodiscard]] Refinement compare_frames(const Frame& frame, const Frame& full, Vec3f background);

/// What a picture of `params` is compared with: every pixel traced, with as many samples.
[[nodiscard]] RenderParams full_of(RenderParams params);

} // namespace porthole
