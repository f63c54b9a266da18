#include "porthole/io/gltf_accessor.h"

#include <algorithm>
#include <cstring>
#include <limits>
#include <type_traits>
#include <utility>

namespace porthole::gltf {
namespace {

int components_of(std::string_view type) {
    constexpr std::pair<std::string_view, int> kTypes[] = {{"SCALAR", 1}, {"VEC2", 2}, {"VEC3", 3}, {"VEC4", 4},
                                                           {"MAT2", 4},   {"MAT3", 9}, {"MAT4", 16}};
    for (const auto& [name, n] : kTypes)
        if (name == type) return n;
    return 0;
}

std::optional<Component> component_of(std::uint64_t code) {
    switch (code) {
    case 5120:
    case 5121:
    case 5122:
    case 5123:
    case 5125:
    case 5126: return Component(code);
    default: return std::nullopt;
    }
}

Component need_component(const Document& doc, const Json& json) {
    const std::uint64_t code = doc.need_uint(json, "componentType");
    const auto component = component_of(code);
    if (!component)
        doc.fail("E0303", json, "componentType",
                 "is " + std::to_string(code) + ", expected 5120, 5121, 5122, 5123, 5125 or 5126");
    return *component;
}

// The bytes of `view` from `offset` on, where `need` bytes must lie.
const std::byte* bytes_at(const Document& doc, const BufferView& view, std::uint64_t offset, std::uint64_t need,
                          const Json& json, std::string_view below) {
    if (offset > view.length || need > view.length - offset) {
        const bool offset_alone = offset > view.length;
        doc.fail("E0301", json, offset_alone ? "byteOffset" : below,
                 "the data ends at byte " + (offset_alone ? std::to_string(offset) : std::to_string(offset + need)) +
                     " of " + std::to_string(view.length) + " in its buffer view; the file is truncated?");
    }
    return view.undefined ? nullptr : view.bytes.data.data() + offset;
}

void read_sparse(const Document& doc, std::span<const BufferView> views, const Json& sparse, Accessor& accessor) {
    const std::uint64_t n = doc.need_uint(sparse, "count");
    if (n > accessor.count)
        doc.fail("E0303", sparse, "count",
                 "is " + std::to_string(n) + ", more than the accessor's " + std::to_string(accessor.count));
    const Json* indices = doc.object(sparse, "indices");
    const Json* values = doc.object(sparse, "values");
    if (!indices || !values) doc.fail("E0303", sparse, {}, "needs \"indices\" and \"values\"");

    Accessor index;
    index.components = 1;
    index.count = n;
    index.component = need_component(doc, *indices);
    if (index.component != Component::u8 && index.component != Component::u16 && index.component != Component::u32)
        doc.fail("E0303", *indices, "componentType", "sparse indices must be unsigned integers");
    index.stride = component_bytes(index.component);
    const BufferView& index_view = views[doc.need_index(*indices, "bufferView", views.size(), "buffer view")];
    index.data =
        bytes_at(doc, index_view, doc.uint_or(*indices, "byteOffset", 0), n * index.stride, *indices, "byteOffset");
    const BufferView& value_view = views[doc.need_index(*values, "bufferView", views.size(), "buffer view")];
    accessor.sparse_data = bytes_at(doc, value_view, doc.uint_or(*values, "byteOffset", 0),
                                    n * accessor.element_bytes(), *values, "byteOffset");
    if (!index.data || !accessor.sparse_data) return; // of undefined content: zeros replace nothing

    accessor.sparse_index.resize(n);
    read_uints(index, 0, n, accessor.sparse_index.data());
    for (std::size_t i = 0; i < n; ++i) {
        const std::uint32_t v = accessor.sparse_index[i];
        if (v >= accessor.count || (i > 0 && v <= accessor.sparse_index[i - 1]))
            doc.fail("E0303", *indices, {},
                     "sparse index " + std::to_string(i) + " is " + std::to_string(v) +
                         "; they must increase and stay below the accessor's count of " +
                         std::to_string(accessor.count));
    }
}

template <typename T, bool kNormalized> float as_float(T v) {
    if constexpr (!kNormalized || sizeof(T) == 4)
        return static_cast<float>(v);
    else if constexpr (std::is_signed_v<T>)
        return std::max(float(v) / float(std::numeric_limits<T>::max()), -1.0f);
    else
        return float(v) / float(std::numeric_limits<T>::max());
}

template <typename T> T load(const std::byte* p) {
    T value;
    std::memcpy(&value, p, sizeof value);
    return value;
}

// kWidth components of each element; 0: as many as `used`, then `fill` up to `width`.
template <typename T, bool kNormalized, int kWidth>
void convert(const std::byte* in, std::size_t stride, std::size_t count, float* out, int width, int used, float fill) {
    for (std::size_t i = 0; i < count; ++i, in += stride) {
        if constexpr (kWidth > 0) {
            for (int k = 0; k < kWidth; ++k)
                *out++ = as_float<T, kNormalized>(load<T>(in + std::size_t(k) * sizeof(T)));
        } else {
            for (int k = 0; k < used; ++k) *out++ = as_float<T, kNormalized>(load<T>(in + std::size_t(k) * sizeof(T)));
            for (int k = used; k < width; ++k) *out++ = fill;
        }
    }
}

template <typename T, bool kNormalized> void convert_width(const Accessor& a, const std::byte* in, std::size_t stride,
                                                           std::size_t count, int width, float* out, float fill) {
    const int used = std::min(width, a.components);
    if (used < width || width > 4)
        convert<T, kNormalized, 0>(in, stride, count, out, width, used, fill);
    else if (width == 1)
        convert<T, kNormalized, 1>(in, stride, count, out, width, used, fill);
    else if (width == 2)
        convert<T, kNormalized, 2>(in, stride, count, out, width, used, fill);
    else if (width == 3)
        convert<T, kNormalized, 3>(in, stride, count, out, width, used, fill);
    else
        convert<T, kNormalized, 4>(in, stride, count, out, width, used, fill);
}

template <typename T> void convert_any(const Accessor& a, const std::byte* in, std::size_t stride, std::size_t count,
                                       int width, float* out, float fill) {
    if (a.normalized)
        convert_width<T, true>(a, in, stride, count, width, out, fill);
    else
        convert_width<T, false>(a, in, stride, count, width, out, fill);
}

void convert_elements(const Accessor& a, const std::byte* in, std::size_t stride, std::size_t count, int width,
                      float* out, float fill) {
    switch (a.component) {
    case Component::i8: return convert_any<std::int8_t>(a, in, stride, count, width, out, fill);
    case Component::u8: return convert_any<std::uint8_t>(a, in, stride, count, width, out, fill);
    case Component::i16: return convert_any<std::int16_t>(a, in, stride, count, width, out, fill);
    case Component::u16: return convert_any<std::uint16_t>(a, in, stride, count, width, out, fill);
    case Component::u32: return convert_any<std::uint32_t>(a, in, stride, count, width, out, fill);
    case Component::f32: return convert_any<float>(a, in, stride, count, width, out, fill);
    }
}

template <typename T>
void widen(const Accessor& a, const std::byte* in, std::size_t stride, std::size_t count, std::uint32_t* out) {
    if (stride == sizeof(T) * std::size_t(a.components)) { // packed, as indices always are
        for (std::size_t i = 0; i < count * std::size_t(a.components); ++i) out[i] = load<T>(in + i * sizeof(T));
        return;
    }
    for (std::size_t i = 0; i < count; ++i, in += stride)
        for (int k = 0; k < a.components; ++k) *out++ = load<T>(in + std::size_t(k) * sizeof(T));
}

void widen_elements(const Accessor& a, const std::byte* in, std::size_t stride, std::size_t count, std::uint32_t* out) {
    switch (a.component) {
    case Component::u8: return widen<std::uint8_t>(a, in, stride, count, out);
    case Component::u16: return widen<std::uint16_t>(a, in, stride, count, out);
    case Component::u32: return widen<std::uint32_t>(a, in, stride, count, out);
    default: std::fill_n(out, count * std::size_t(a.components), 0u);
    }
}

// Sparse elements that fall into [first, first + count), as (position in range, bytes).
template <typename F> void for_each_sparse(const Accessor& a, std::size_t first, std::size_t count, const F& f) {
    auto at = std::lower_bound(a.sparse_index.begin(), a.sparse_index.end(), first);
    for (; at != a.sparse_index.end() && *at < first + count; ++at)
        f(*at - first, a.sparse_data + std::size_t(at - a.sparse_index.begin()) * a.element_bytes());
}

} // namespace

std::vector<Accessor> read_accessors(Document& doc, std::span<const BufferView> views, std::uint64_t file_bytes) {
    // An accessor without bytes is all zeros: only this keeps it from asking for any amount
    // of memory. Compressed data stays far below 64 elements per byte.
    const std::uint64_t most_zeros = std::max<std::uint64_t>(file_bytes, 1024) * 64;

    std::uint64_t sparse_total = 0;
    std::vector<Accessor> accessors;
    const std::span<const Json> list = doc.list_of_objects(doc.root(), "accessors");
    accessors.reserve(list.size());
    for (const Json& json : list) {
        Accessor& a = accessors.emplace_back();
        a.json = &json;
        a.component = need_component(doc, json);
        a.count = doc.need_uint(json, "count");
        if (a.count == 0) doc.fail("E0303", json, "count", "is 0, expected at least 1");
        const std::string_view type = doc.string_or(json, "type");
        a.components = components_of(type);
        a.normalized = doc.bool_or(json, "normalized", false);
        if (a.normalized && (a.component == Component::u32 || a.component == Component::f32))
            doc.warn("W0307", json, "normalized", "only bytes and shorts can be normalised; ignored");
        if (a.components == 0) {
            if (!Document::find(json, "type")) doc.fail("E0303", json, {}, "has no \"type\", which glTF requires");
            continue; // an error only where it is read
        }
        const std::size_t bytes = component_bytes(a.component);
        // The padded size of small matrices; the last column may lack its padding.
        const bool matrix = type.starts_with("MAT");
        const std::size_t rows = type == "MAT2" ? 2 : type == "MAT3" ? 3 : 4;
        const std::size_t column = matrix ? (bytes * rows + 3) / 4 * 4 : 0;
        const std::size_t element = matrix ? column * rows : a.element_bytes();

        const auto view_index = doc.index(json, "bufferView", views.size(), "buffer view");
        const std::uint64_t offset = doc.uint_or(json, "byteOffset", 0);
        const BufferView* view = view_index ? &views[*view_index] : nullptr;
        if (!view || view->undefined) {
            if (a.count > most_zeros)
                doc.fail_limit(json, "count",
                               "is " + std::to_string(a.count) + " without any data; at most " +
                                   std::to_string(most_zeros) + " are read for a file of this size");
        }
        if (view) {
            a.stride = view->stride ? view->stride : element;
            if (a.stride < element) {
                const Json& at = doc.list(doc.root(), "bufferViews")[*view_index];
                doc.fail("E0303", at, "byteStride",
                         "is " + std::to_string(a.stride) + ", less than the " + std::to_string(element) +
                             " bytes of an element of " + doc.where(json));
            }
            // Counts are below 2^53 and strides below 2^9: the product cannot wrap.
            const std::uint64_t last = (a.count - 1) * a.stride + (matrix ? element - column + bytes * rows : element);
            const bool stride_to_blame =
                view->stride != 0 && offset <= view->length && a.count * element <= view->length - offset;
            if (stride_to_blame && last > view->length - offset) {
                const Json& at = doc.list(doc.root(), "bufferViews")[*view_index];
                doc.fail("E0301", at, "byteStride",
                         "of " + std::to_string(a.stride) + " takes " + doc.where(json) + " to byte " +
                             std::to_string(offset + last) + " of " + std::to_string(view->length));
            }
            a.data = bytes_at(doc, *view, offset, last, json, "count");
        } else if (offset != 0) {
            doc.warn("W0307", json, "byteOffset", "has no meaning without a buffer view; ignored");
        }
        const Json* sparse = doc.object(json, "sparse");
        if (!sparse) continue;
        // Every replaced element has bytes of its own; views that are shared to excess would
        // make a small file slow.
        sparse_total += doc.need_uint(*sparse, "count");
        if (sparse_total > std::max<std::uint64_t>(file_bytes, 1024))
            doc.fail_limit(*sparse, "count", "more sparse elements than the file has bytes");
        read_sparse(doc, views, *sparse, a);
    }
    return accessors;
}

void read_floats(const Accessor& a, std::size_t first, std::size_t count, int width, float* out, float fill) {
    const std::byte* in = a.data ? a.data + first * a.stride : nullptr;
    if (!in) {
        const int used = std::min(width, a.components);
        for (std::size_t i = 0; i < count; ++i)
            for (int k = 0; k < width; ++k) out[i * std::size_t(width) + std::size_t(k)] = k < used ? 0.0f : fill;
    } else if (a.component == Component::f32 && a.components == width && a.stride == 4 * std::size_t(width)) {
        std::memcpy(out, in, count * a.stride);
    } else {
        convert_elements(a, in, a.stride, count, width, out, fill);
    }
    for_each_sparse(a, first, count, [&](std::size_t at, const std::byte* bytes) {
        convert_elements(a, bytes, 0, 1, width, out + at * std::size_t(width), fill);
    });
}

void read_uints(const Accessor& a, std::size_t first, std::size_t count, std::uint32_t* out) {
    const std::size_t width = std::size_t(a.components);
    const std::byte* in = a.data ? a.data + first * a.stride : nullptr;
    if (!in)
        std::fill_n(out, count * width, 0u);
    else if (a.component == Component::u32 && a.stride == 4 * width)
        std::memcpy(out, in, count * a.stride);
    else
        widen_elements(a, in, a.stride, count, out);
    for_each_sparse(a, first, count,
                    [&](std::size_t at, const std::byte* bytes) { widen_elements(a, bytes, 0, 1, out + at * width); });
}

} // namespace porthole::gltf
