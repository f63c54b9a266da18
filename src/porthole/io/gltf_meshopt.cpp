// Buffer views, plain and EXT_meshopt_compression (KHR_meshopt_compression has the same form).
#include <algorithm>
#include <cstring>

#include <meshoptimizer.h>

#include "porthole/io/gltf_accessor.h"

namespace porthole::gltf {
namespace {

struct Compressed {
    std::size_t view = 0; // index of the buffer view that it fills
    const Json* json = nullptr;
    std::span<const std::byte> bytes;
    std::size_t count = 0, stride = 0;
    enum class Mode { attributes, triangles, indices } mode = Mode::attributes;
    enum class Filter { none, octahedral, quaternion, exponential } filter = Filter::none;
    std::shared_ptr<std::vector<std::byte>> decoded;
};

// The range of a buffer that the object names.
std::span<const std::byte> range_of(const Document& doc, const Json& json, std::span<const Buffer> buffers,
                                    const Buffer** buffer_out = nullptr, std::uint64_t* length_out = nullptr) {
    const std::uint32_t index = doc.need_index(json, "buffer", buffers.size(), "buffer");
    const Buffer& buffer = buffers[index];
    const std::uint64_t offset = doc.uint_or(json, "byteOffset", 0);
    const std::uint64_t length = doc.need_uint(json, "byteLength");
    if (length == 0) doc.fail("E0303", json, "byteLength", "is 0, expected at least 1");
    const std::uint64_t size = buffer.undefined ? doc.need_uint(doc.list(doc.root(), "buffers")[index], "byteLength")
                                                : buffer.bytes.data.size();
    if (offset > size || length > size - offset)
        doc.fail("E0301", json, offset > size ? "byteOffset" : "byteLength",
                 "the view ends at byte " + std::to_string(offset + length) + " of " + std::to_string(size) +
                     " in buffer " + std::to_string(index) + "; the file is truncated?");
    if (buffer_out) *buffer_out = &buffer;
    if (length_out) *length_out = length;
    return buffer.undefined ? std::span<const std::byte>{} : buffer.bytes.data.subspan(offset, length);
}

// The codecs' own limits, and the most that the bytes at hand can unfold to, so that nothing
// is allocated on the word of a number in the file.
void check_form(const Document& doc, const Compressed& c) {
    const auto refuse = [&](std::string_view below, const std::string& reason) {
        doc.fail("E0303", *c.json, below, reason);
    };
    std::uint64_t most = 0;
    if (c.mode == Compressed::Mode::attributes) {
        if (c.stride == 0 || c.stride > 256 || c.stride % 4 != 0)
            refuse("byteStride", "is " + std::to_string(c.stride) + ", expected a multiple of 4 up to 256");
        // A byte of header covers four groups of 16 values of one byte column.
        most = (c.bytes.size() * 64 / c.stride + 1) * c.stride + 256 * c.stride;
    } else {
        if (c.stride != 2 && c.stride != 4)
            refuse("byteStride", "is " + std::to_string(c.stride) + ", expected 2 or 4");
        if (c.mode == Compressed::Mode::triangles && c.count % 3 != 0)
            refuse("count", "is " + std::to_string(c.count) + ", not a multiple of 3");
        most = c.bytes.size() * 3 * c.stride;
    }
    using Filter = Compressed::Filter;
    if (c.filter != Filter::none && c.mode != Compressed::Mode::attributes)
        refuse("filter", "is for mode ATTRIBUTES only");
    if ((c.filter == Filter::octahedral && c.stride != 4 && c.stride != 8) ||
        (c.filter == Filter::quaternion && c.stride != 8))
        refuse("filter", "does not fit a byteStride of " + std::to_string(c.stride));
    if (c.count > most || c.count * c.stride > most)
        doc.fail("E0308", *c.json, "count",
                 "is " + std::to_string(c.count) + ", more than " + std::to_string(c.bytes.size()) +
                     " compressed bytes can hold; the file is truncated?");
}

Compressed read_form(const Document& doc, const Json& json, std::span<const Buffer> buffers, std::size_t view) {
    Compressed c;
    c.view = view;
    c.json = &json;
    c.bytes = range_of(doc, json, buffers);
    c.count = doc.need_uint(json, "count");
    c.stride = doc.need_uint(json, "byteStride");

    const std::string_view mode = doc.string_or(json, "mode");
    if (mode == "ATTRIBUTES")
        c.mode = Compressed::Mode::attributes;
    else if (mode == "TRIANGLES")
        c.mode = Compressed::Mode::triangles;
    else if (mode == "INDICES")
        c.mode = Compressed::Mode::indices;
    else
        doc.fail("E0303", json, "mode", "is \"" + shortened(mode) + "\", expected ATTRIBUTES, TRIANGLES or INDICES");

    const std::string_view filter = doc.string_or(json, "filter", "NONE");
    if (filter == "NONE")
        c.filter = Compressed::Filter::none;
    else if (filter == "OCTAHEDRAL")
        c.filter = Compressed::Filter::octahedral;
    else if (filter == "QUATERNION")
        c.filter = Compressed::Filter::quaternion;
    else if (filter == "EXPONENTIAL")
        c.filter = Compressed::Filter::exponential;
    else
        doc.fail("E0303", json, "filter",
                 "is \"" + shortened(filter) + "\", expected NONE, OCTAHEDRAL, QUATERNION or EXPONENTIAL");
    check_form(doc, c);
    return c;
}

bool decode(Compressed& c) {
    auto* out = c.decoded->data();
    const auto* in = reinterpret_cast<const unsigned char*>(c.bytes.data());
    int failed = 0;
    switch (c.mode) {
    case Compressed::Mode::attributes:
        failed = meshopt_decodeVertexBuffer(out, c.count, c.stride, in, c.bytes.size());
        break;
    case Compressed::Mode::triangles:
        failed = meshopt_decodeIndexBuffer(out, c.count, c.stride, in, c.bytes.size());
        break;
    case Compressed::Mode::indices:
        failed = meshopt_decodeIndexSequence(out, c.count, c.stride, in, c.bytes.size());
        break;
    }
    if (failed != 0) return false;
    switch (c.filter) {
    case Compressed::Filter::none: break;
    case Compressed::Filter::octahedral: meshopt_decodeFilterOct(out, c.count, c.stride); break;
    case Compressed::Filter::quaternion: meshopt_decodeFilterQuat(out, c.count, c.stride); break;
    case Compressed::Filter::exponential: meshopt_decodeFilterExp(out, c.count, c.stride); break;
    }
    return true;
}

} // namespace

std::vector<BufferView> read_buffer_views(const Document& doc, std::span<const Buffer> buffers, std::uint64_t max_bytes,
                                          const Control& control) {
    const std::span<const Json> list = doc.list_of_objects(doc.root(), "bufferViews");
    std::vector<BufferView> views(list.size());
    std::vector<Compressed> compressed;
    std::uint64_t total = 0;
    for (std::size_t i = 0; i < list.size(); ++i) {
        const Json& json = list[i];
        BufferView& view = views[i];
        const Buffer* buffer = nullptr;
        view.bytes.data = range_of(doc, json, buffers, &buffer, &view.length);
        view.undefined = buffer->undefined;
        view.stride = doc.uint_or(json, "byteStride", 0);
        if (Document::find(json, "byteStride") && (view.stride < 4 || view.stride > 252))
            doc.fail("E0303", json, "byteStride", "is " + std::to_string(view.stride) + ", expected 4 to 252");

        const Json* meshopt = doc.extension(json, "EXT_meshopt_compression");
        if (!meshopt) meshopt = doc.extension(json, "KHR_meshopt_compression");
        if (!meshopt) continue;
        Compressed c = read_form(doc, *meshopt, buffers, i);
        total += c.count * c.stride;
        if (total > max_bytes)
            doc.fail_limit(*meshopt, "count",
                           "decoding takes more than the allowed " + std::to_string(max_bytes) + " bytes");
        compressed.push_back(std::move(c));
    }

    std::vector<std::uint8_t> good(compressed.size(), 0);
    parallel_for(compressed.size(), control, [&](std::size_t i) {
        Compressed& c = compressed[i];
        c.decoded = std::make_shared<std::vector<std::byte>>(c.count * c.stride);
        good[i] = decode(c) ? 1 : 0;
    });
    for (std::size_t i = 0; i < compressed.size(); ++i) {
        const Compressed& c = compressed[i];
        if (!good[i])
            doc.fail("E0308", *c.json, {},
                     "the meshopt data cannot be decoded; the file is damaged, or of a newer codec version?");
        BufferView& view = views[c.view];
        view.bytes = {*c.decoded, c.decoded};
        view.length = c.decoded->size();
        view.undefined = false;
    }
    return views;
}

} // namespace porthole::gltf
