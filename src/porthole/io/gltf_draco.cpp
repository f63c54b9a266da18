#include "porthole/io/gltf_draco.h"

#include <cstring>
#include <new>
#include <stdexcept>

#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wconversion"
#pragma GCC diagnostic ignored "-Wshadow"
#pragma GCC diagnostic ignored "-Wpedantic"
#pragma GCC diagnostic ignored "-Wextra"
#include <draco/compression/decode.h>
#include <draco/core/varint_decoding.h>
#include <draco/metadata/metadata_decoder.h>
#pragma GCC diagnostic pop

namespace porthole::gltf {
namespace {

// Number of triangles that the header claims; the decoder allocates for it at once.
bool claimed_triangles(std::span<const std::byte> bytes, std::uint64_t& triangles) {
    draco::DecoderBuffer buffer;
    buffer.Init(reinterpret_cast<const char*>(bytes.data()), bytes.size());
    char magic[5];
    std::uint8_t major = 0, minor = 0, type = 0, method = 0;
    std::uint16_t flags = 0;
    if (!buffer.Decode(magic, 5) || std::memcmp(magic, "DRACO", 5) != 0) return false;
    if (!buffer.Decode(&major) || !buffer.Decode(&minor) || !buffer.Decode(&type) || !buffer.Decode(&method) ||
        !buffer.Decode(&flags))
        return false;
    const auto version = static_cast<std::uint16_t>(DRACO_BITSTREAM_VERSION(major, minor));
    buffer.set_bitstream_version(version);
    if (version >= DRACO_BITSTREAM_VERSION(1, 3) && (flags & METADATA_FLAG_MASK)) {
        draco::GeometryMetadata metadata;
        if (!draco::MetadataDecoder().DecodeGeometryMetadata(&buffer, &metadata)) return false;
    }
    const auto number = [&](std::uint32_t& value, bool varint) {
        return varint ? draco::DecodeVarint(&value, &buffer) : buffer.Decode(&value);
    };
    std::uint32_t faces = 0, skipped = 0;
    if (method == draco::MESH_EDGEBREAKER_ENCODING) {
        std::uint8_t traversal = 0;
        const bool varint = version >= DRACO_BITSTREAM_VERSION(2, 0);
        if (!buffer.Decode(&traversal)) return false;
        if (version < DRACO_BITSTREAM_VERSION(2, 2) && !number(skipped, varint)) return false; // new vertices
        if (!number(skipped, varint) || !number(faces, varint)) return false;                  // vertices, faces
    } else if (!number(faces, version >= DRACO_BITSTREAM_VERSION(2, 2))) {
        return false;
    }
    triangles = faces;
    return true;
}

bool component_of(draco::DataType type, Component& component) {
    switch (type) {
    case draco::DT_INT8: component = Component::i8; return true;
    case draco::DT_UINT8: component = Component::u8; return true;
    case draco::DT_INT16: component = Component::i16; return true;
    case draco::DT_UINT16: component = Component::u16; return true;
    case draco::DT_UINT32: component = Component::u32; return true;
    case draco::DT_FLOAT32: component = Component::f32; return true;
    default: return false;
    }
}

// The attribute as an accessor with one element per point.
std::string view_attribute(const draco::Mesh& mesh, const DracoAttribute& wanted, Accessor& a) {
    const draco::PointAttribute* attribute = mesh.GetAttributeByUniqueId(wanted.id);
    if (!attribute) return "has no attribute " + std::to_string(wanted.id);
    if (!component_of(attribute->data_type(), a.component) || attribute->num_components() > 4)
        return "attribute " + std::to_string(wanted.id) + " has a type that glTF does not have";
    a.count = mesh.num_points();
    a.components = attribute->num_components();
    a.normalized = wanted.normalized;
    a.stride = a.element_bytes();

    const std::size_t values = attribute->size(), stride = std::size_t(attribute->byte_stride());
    const draco::DataBuffer* buffer = attribute->buffer();
    if (!buffer || stride < a.stride || std::size_t(attribute->byte_offset()) + values * stride > buffer->data_size())
        return "attribute " + std::to_string(wanted.id) + " is incomplete";
    const auto* data = reinterpret_cast<const std::byte*>(buffer->data()) + attribute->byte_offset();
    if (attribute->is_mapping_identity()) {
        if (values < a.count) return "attribute " + std::to_string(wanted.id) + " is incomplete";
        a.data = data;
        a.stride = stride;
        return {};
    }
    a.owned.resize(a.count * a.stride);
    for (std::size_t i = 0; i < a.count; ++i) {
        const std::size_t value = attribute->mapped_index(draco::PointIndex(std::uint32_t(i))).value();
        if (value >= values) return "attribute " + std::to_string(wanted.id) + " is incomplete";
        std::memcpy(a.owned.data() + i * a.stride, data + value * stride, a.stride);
    }
    a.data = a.owned.data();
    return {};
}

} // namespace

DracoMesh decode_draco(std::span<const std::byte> bytes, std::span<const DracoAttribute> wanted) {
    DracoMesh out;
    std::uint64_t claimed = 0;
    if (!claimed_triangles(bytes, claimed)) {
        out.error = "is not Draco data, or is cut off";
        return out;
    }
    if (claimed > bytes.size() * 1000) {
        out.error = "claims " + std::to_string(claimed) + " triangles in " + std::to_string(bytes.size()) + " bytes";
        return out;
    }
    try {
        draco::DecoderBuffer buffer;
        buffer.Init(reinterpret_cast<const char*>(bytes.data()), bytes.size());
        draco::Decoder decoder;
        auto result = decoder.DecodeMeshFromBuffer(&buffer);
        if (!result.ok() || !result.value()) {
            out.error = "cannot be decoded: " + std::string(result.status().error_msg());
            return out;
        }
        const std::shared_ptr<draco::Mesh> mesh = std::move(result).value();
        out.owner = mesh;
        out.points = mesh->num_points();
        for (const DracoAttribute& attribute : wanted) {
            out.error = view_attribute(*mesh, attribute, out.attributes.emplace_back());
            if (!out.error.empty()) return out;
        }
        static_assert(sizeof(draco::Mesh::Face) == 12, "faces are read as three 32-bit indices");
        out.indices.component = Component::u32;
        out.indices.components = 1;
        out.indices.stride = 4;
        out.indices.count = std::uint64_t(mesh->num_faces()) * 3;
        if (out.indices.count > 0)
            out.indices.data = reinterpret_cast<const std::byte*>(mesh->face(draco::FaceIndex(0)).data());
    } catch (const std::bad_alloc&) {
        out.error = "asks for more memory than there is";
    } catch (const std::length_error&) {
        out.error = "asks for more memory than there is";
    }
    return out;
}

} // namespace porthole::gltf
