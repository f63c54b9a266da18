// Cutting polygons into triangles.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "porthole/base/math.h"

namespace porthole {

/// Cuts planar or nearly planar polygons into triangles: a fan where the polygon is convex,
/// ears otherwise. Buffers are kept from one polygon to the next.
class Triangulator {
public:
    /// @param budget  point-in-triangle tests over all calls; the default takes about 2 s.
    explicit Triangulator(std::int64_t budget = 1'000'000'000) : budget_(budget) {}

    /// Triangles of the polygon with these corners, counter-clockwise as they are: always
    /// corners.size() - 2, with indices into `corners`; none for fewer than 3. Self-crossing
    /// polygons give some triangles. Valid until the next call.
    ///
    /// Cost: linear if convex; else about corners * log(corners), at worst the square of the
    /// number of reflex corners, until the budget is used up: from then on concave polygons are cut as fans and
    /// `gave_up` counts them.
    [[nodiscard]] std::span<const Vec3u> triangulate(std::span<const Vec3f> corners);

    [[nodiscard]] std::uint64_t gave_up() const { return gave_up_; }

private:
    void cut_ears();
    [[nodiscard]] bool is_ear(std::uint32_t i);

    std::vector<Vec3u> triangles_;
    std::vector<Vec2d> points_; ///< corners on the polygon's plane, counter-clockwise
    std::vector<std::uint32_t> previous_, next_;
    std::vector<std::uint32_t> reflex_; ///< corners that were reflex at the start, by x
    std::vector<std::uint8_t> is_reflex_, queued_;
    std::int64_t budget_;
    std::uint64_t gave_up_ = 0;
};

} // namespace porthole
