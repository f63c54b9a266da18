// Part ids and the buffers that hold them.
#pragma once

#include <cstdint>

#include "porthole/base/image.h"

namespace porthole {

enum class PartId : std::uint32_t {};
inline constexpr PartId kNoPart{0xFFFFFFFFu};

constexpr std::uint32_t index(PartId id) { return static_cast<std::uint32_t>(id); }

/// At each pixel centre the nearest part and its depth (metres along camera -z;
/// +infinity and kNoPart where nothing is hit).
struct IdBuffer {
    Image<PartId> id;
    Image<float> depth;

    IdBuffer() = default;
    explicit IdBuffer(Rect window) : id(window, kNoPart), depth(window, kInfinity) {}
    [[nodiscard]] Rect window() const { return id.window(); }
    friend bool operator==(const IdBuffer&, const IdBuffer&) = default;
};

} // namespace porthole
