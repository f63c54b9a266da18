// Buffer views and accessors: typed arrays in the buffers, checked once, then read in ranges.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "porthole/base/parallel.h"
#include "porthole/io/gltf_container.h"
#include "porthole/io/gltf_json.h"

namespace porthole::gltf {

struct BufferView {
    Bytes bytes;            ///< as many as byteLength says; decoded if it was meshopt-compressed
    std::size_t stride = 0; ///< bytes between elements, 0: tightly packed
    bool undefined = false; ///< no bytes in the file; zeros are read
    std::uint64_t length = 0;
};

/// All buffer views; meshopt-compressed ones are decoded in parallel.
/// @throws Error E0301 a view passes its buffer's end, E0303, E0306, E0308 (meshopt);
///         limit E0902 when decoding would take more than max_bytes.
[[nodiscard]] std::vector<BufferView> read_buffer_views(const Document& doc, std::span<const Buffer> buffers,
                                                        std::uint64_t max_bytes, const Control& control);

enum class Component : std::uint16_t { i8 = 5120, u8 = 5121, i16 = 5122, u16 = 5123, u32 = 5125, f32 = 5126 };
[[nodiscard]] constexpr std::size_t component_bytes(Component c) {
    return c == Component::i8 || c == Component::u8 ? 1 : c == Component::i16 || c == Component::u16 ? 2 : 4;
}

/// A checked accessor: every element it names lies inside its bytes.
struct Accessor {
    std::uint64_t count = 0;
    int components = 0; ///< 1, 2, 3, 4, 9, 16; 0: a type we do not know, which must not be read
    Component component = Component::f32;
    bool normalized = false;
    const std::byte* data = nullptr; ///< first element; null: all zero
    std::size_t stride = 0;          ///< bytes

    // Elements that replace some of the above.
    std::vector<std::uint32_t> sparse_index; ///< increasing, below count
    const std::byte* sparse_data = nullptr;  ///< tightly packed

    std::vector<std::byte> owned; ///< what `data` points into, if not a buffer view
    const Json* json = nullptr;

    [[nodiscard]] std::size_t element_bytes() const { return component_bytes(component) * std::size_t(components); }
};

/// All accessors, in the file's order.
/// @throws Error E0301 an element lies beyond its view, E0303, E0306; limit E0902.
[[nodiscard]] std::vector<Accessor> read_accessors(Document& doc, std::span<const BufferView> views,
                                                   std::uint64_t file_bytes);

/// Elements [first, first + count) as floats, `width` for each; missing components become
/// `fill`, surplus ones are skipped. Normalised integers map to [0, 1] or [-1, 1].
/// Precondition: the range lies within the accessor, whose components are not 0 (of matrices
/// only MAT4 is read).
void read_floats(const Accessor& accessor, std::size_t first, std::size_t count, int width, float* out,
                 float fill = 1.0f);

/// Elements [first, first + count) as unsigned integers, all components of each; other
/// component types give 0.
void read_uints(const Accessor& accessor, std::size_t first, std::size_t count, std::uint32_t* out);

} // namespace porthole::gltf
