#include <turbojpeg.h>
#include <zlib.h>

#include <algorithm>
#include <cstring>
#include <memory>
#include <new>

#include "porthole/io/image_file.h"

namespace porthole {
namespace {

[[noreturn]] void refuse(const std::string& reason) { throw Error(ErrorKind::output, "E0804", "picture", reason); }

struct PngLayout {
    std::int32_t width = 0, height = 0;
    int bit_depth = 8, channels = 3;
    [[nodiscard]] std::size_t row_bytes() const {
        return std::size_t(width) * std::size_t(channels) * std::size_t(bit_depth / 8);
    }
};

void append_u32(std::vector<std::byte>& out, std::uint32_t v) {
    for (int shift = 24; shift >= 0; shift -= 8) out.push_back(std::byte(v >> shift & 0xFF));
}

void append_chunk(std::vector<std::byte>& out, const char (&type)[5], std::span<const std::byte> data) {
    append_u32(out, std::uint32_t(data.size()));
    const std::size_t start = out.size();
    for (int i = 0; i < 4; ++i) out.push_back(std::byte(type[i]));
    out.insert(out.end(), data.begin(), data.end());
    append_u32(out,
               std::uint32_t(::crc32_z(0, reinterpret_cast<const Bytef*>(out.data() + start), out.size() - start)));
}

/// Rows that are filtered and compressed by themselves.
struct Stripe {
    std::vector<std::byte> deflated;
    std::size_t raw_bytes = 0;
    uLong checksum = 0; ///< of the raw bytes
};

/// Deflates `raw` up to a byte boundary, or to the end of the stream.
std::vector<std::byte> deflated(std::span<const Bytef> raw, bool last) {
    struct Deflater {
        z_stream stream{};
        bool ready = false;
        ~Deflater() {
            if (ready) ::deflateEnd(&stream);
        }
    } deflater;
    z_stream& z = deflater.stream;
    // The fastest level: a third of the default's time for twice the bytes on clean pictures, a
    // twelfth for a fifth more bytes on noisy ones.
    if (::deflateInit2(&z, 1, Z_DEFLATED, -MAX_WBITS, MAX_MEM_LEVEL, Z_DEFAULT_STRATEGY) != Z_OK)
        throw std::bad_alloc();
    deflater.ready = true;
    std::vector<std::byte> out(::deflateBound(&z, uLong(raw.size())) + 16); // and the marker of the flush
    z.next_in = const_cast<Bytef*>(raw.data());
    z.avail_in = uInt(raw.size());
    z.next_out = reinterpret_cast<Bytef*>(out.data());
    z.avail_out = uInt(out.size());
    const int result = ::deflate(&z, last ? Z_FINISH : Z_SYNC_FLUSH);
    if (result != (last ? Z_STREAM_END : Z_OK) || z.avail_in != 0) refuse("zlib reports " + std::to_string(result));
    out.erase(out.end() - z.avail_out, out.end());
    return out;
}

/// @param raw_row  raw_row(y, out) writes row y as PNG stores it, without a filter.
/// Stripes are cut by size alone, so that the bytes do not depend on the threads.
template <typename RawRow>
std::vector<std::byte> write_png(const PngLayout& layout, const RawRow& raw_row, const Control& control) {
    if (layout.width <= 0 || layout.height <= 0) refuse("a picture without pixels cannot be written");
    const std::size_t row_bytes = layout.row_bytes(), height = std::size_t(layout.height);
    if (row_bytes >= std::size_t(1) << 30) refuse("rows of over 2^30 bytes do not fit into a PNG");
    constexpr std::size_t kStripeBytes = std::size_t(1) << 18; // its first 32 kB compress a little worse
    const std::size_t rows = std::max<std::size_t>(1, kStripeBytes / row_bytes);
    std::vector<Stripe> stripes((height + rows - 1) / rows);
    parallel_for(stripes.size(), control, [&](std::size_t s) {
        const std::size_t first = s * rows, end = std::min(first + rows, height);
        std::vector<Bytef> raw((end - first) * (row_bytes + 1));
        std::vector<Bytef> above(row_bytes, 0), row(row_bytes);
        if (first > 0) raw_row(first - 1, above.data());
        Bytef* out = raw.data();
        for (std::size_t y = first; y < end; ++y) {
            raw_row(y, row.data());
            *out++ = 2; // filter "up"
            for (std::size_t i = 0; i < row_bytes; ++i) out[i] = Bytef(row[i] - above[i]);
            out += row_bytes;
            std::swap(row, above);
        }
        stripes[s] = {deflated(raw, end == height), raw.size(), ::adler32_z(1, raw.data(), raw.size())};
    });

    std::vector<std::byte> header;
    append_u32(header, std::uint32_t(layout.width));
    append_u32(header, std::uint32_t(layout.height));
    const int colour_type = layout.channels == 1 ? 0 : layout.channels == 3 ? 2 : 6;
    for (const int v : {layout.bit_depth, colour_type, 0, 0, 0}) header.push_back(std::byte(v));

    std::size_t size = 100;
    for (const Stripe& stripe : stripes) size += stripe.deflated.size() + 12;
    std::vector<std::byte> out;
    out.reserve(size);
    for (const int v : {0x89, 0x50, 0x4E, 0x47, 0x0D, 0x0A, 0x1A, 0x0A}) out.push_back(std::byte(v));
    append_chunk(out, "IHDR", header);
    append_chunk(out, "sRGB", std::vector<std::byte>{std::byte(0)}); // perceptual intent
    append_chunk(out, "IDAT", std::vector<std::byte>{std::byte(0x78), std::byte(0x01)});
    uLong checksum = 1;
    for (const Stripe& stripe : stripes) {
        append_chunk(out, "IDAT", stripe.deflated);
        checksum = ::adler32_combine(checksum, stripe.checksum, z_off_t(stripe.raw_bytes));
    }
    std::vector<std::byte> end;
    append_u32(end, std::uint32_t(checksum));
    append_chunk(out, "IDAT", end);
    append_chunk(out, "IEND", {});
    return out;
}

} // namespace

std::vector<std::byte> encode_png(const Image<Rgba8>& image, int channels, const Control& control) {
    if (channels != 3 && channels != 4) refuse("a PNG has 3 or 4 channels, not " + std::to_string(channels));
    const std::size_t width = std::size_t(image.width());
    const auto raw_row = [&](std::size_t y, Bytef* out) {
        const Rgba8* const in = image.pixels().data() + y * width;
        if (channels == 4) {
            std::memcpy(out, in, width * sizeof(Rgba8));
            return;
        }
        for (std::size_t x = 0; x < width; ++x, out += 3) out[0] = in[x].r, out[1] = in[x].g, out[2] = in[x].b;
    };
    return write_png({image.width(), image.height(), 8, channels}, raw_row, control);
}

std::vector<std::byte> encode_png16(std::span<const std::uint16_t> samples, int width, int height, int channels,
                                    const Control& control) {
    if (channels != 1 && channels != 3 && channels != 4)
        refuse("a 16-bit PNG has 1, 3 or 4 channels, not " + std::to_string(channels));
    if (width < 0 || height < 0 || samples.size() != std::size_t(width) * std::size_t(height) * std::size_t(channels))
        refuse("the samples do not fill " + std::to_string(width) + "x" + std::to_string(height) + "x" +
               std::to_string(channels));
    const std::size_t row_samples = std::size_t(width) * std::size_t(channels);
    const auto raw_row = [&](std::size_t y, Bytef* out) {
        const std::uint16_t* const in = samples.data() + y * row_samples;
        for (std::size_t i = 0; i < row_samples; ++i, out += 2)
            out[0] = Bytef(in[i] >> 8), out[1] = Bytef(in[i] & 0xFF);
    };
    return write_png({width, height, 16, channels}, raw_row, control);
}

std::vector<std::byte> encode_jpeg(const Image<Rgba8>& image, int quality) {
    if (image.empty() || image.width() > 65535 || image.height() > 65535)
        refuse("a JPEG has 1 to 65535 pixels on a side");
    if (quality < 1 || quality > 100) refuse("JPEG quality is 1 to 100, not " + std::to_string(quality));
    const std::unique_ptr<void, decltype(&tjDestroy)> encoder(tjInitCompress(), &tjDestroy);
    if (!encoder) throw std::bad_alloc();
    std::vector<std::byte> bytes(tjBufSize(image.width(), image.height(), TJSAMP_444));
    auto* out = reinterpret_cast<unsigned char*>(bytes.data());
    unsigned long size = static_cast<unsigned long>(bytes.size());
    if (tjCompress2(encoder.get(), reinterpret_cast<const unsigned char*>(image.pixels().data()), image.width(), 0,
                    image.height(), TJPF_RGBX, &out, &size, TJSAMP_444, quality, TJFLAG_NOREALLOC) != 0)
        refuse(std::string("the JPEG encoder refuses: ") + tjGetErrorStr2(encoder.get()));
    bytes.resize(size);
    return bytes;
}

} // namespace porthole
