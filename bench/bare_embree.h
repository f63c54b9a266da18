// The yardstick: nearest hits of a whole picture by nothing but Embree.
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "porthole/base/view.h"
#include "porthole/scene/scene.h"

namespace porthole::bench {

/// The same two-level layout as the library's (a hierarchy per mesh, an instance per part,
/// robust, AVX2), traced by one thread with coherent 16-ray packets and nothing else: rays
/// are made, traced, and their hits added up so that no work can be left out.
class BareEmbree {
public:
    explicit BareEmbree(const Scene& scene);
    ~BareEmbree();
    BareEmbree(const BareEmbree&) = delete;
    BareEmbree& operator=(const BareEmbree&) = delete;

    /// Traces every pixel centre of the view. @return number of hits
    [[nodiscard]] std::int64_t trace(const View& view) const;

private:
    struct State;
    std::unique_ptr<State> state_;
};

/// What a ray tracer without instances has: one hierarchy over all triangles in the world, with a
/// ray mask that is looked at when a triangle is met. Robust, AVX2.
class FlatEmbree {
public:
    /// @param chosen  parts that rays of ids_at() can hit.
    FlatEmbree(const Scene& scene, std::span<const PartId> chosen);
    ~FlatEmbree();
    FlatEmbree(const FlatEmbree&) = delete;
    FlatEmbree& operator=(const FlatEmbree&) = delete;

    /// The nearest chosen part at pixel centres, sixteen rays at a time.
    [[nodiscard]] std::vector<PartId> ids_at(const View& view, std::span<const Vec2i> pixels) const;

private:
    struct State;
    std::unique_ptr<State> state_;
};

} // namespace porthole::bench
