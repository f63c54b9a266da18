// KHR_draco_mesh_compression.
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "porthole/io/gltf_accessor.h"

namespace porthole::gltf {

/// An attribute to take out of Draco data: its identifier there, and whether its integers are
/// normalised, which only the glTF accessor knows.
struct DracoAttribute {
    std::uint32_t id = 0;
    bool normalized = false;

    friend bool operator<(DracoAttribute a, DracoAttribute b) {
        return a.id != b.id ? a.id < b.id : a.normalized < b.normalized;
    }
};

struct DracoMesh {
    std::vector<Accessor> attributes; ///< as asked for, one element per point
    Accessor indices;                 ///< three per triangle
    std::uint64_t points = 0;
    std::shared_ptr<const void> owner; ///< what the accessors point into
    std::string error;                 ///< why decoding failed; empty when it did not
};

/// Decodes one Draco mesh. Attributes that Draco stores once per point are not copied.
/// Never throws for bad data: `error` says what is wrong. Safe to call concurrently.
/// Refuses data that claims over 1000 triangles per compressed byte before decoding it.
[[nodiscard]] DracoMesh decode_draco(std::span<const std::byte> bytes, std::span<const DracoAttribute> wanted);

} // namespace porthole::gltf
