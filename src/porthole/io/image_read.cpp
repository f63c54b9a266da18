#include <png.h>
#include <turbojpeg.h>
#include <webp/decode.h>

#include <algorithm>
#include <array>
#include <csetjmp>
#include <cstdio>
#include <cstring>
#include <memory>
#include <string_view>

#include "porthole/io/image_file.h"

namespace porthole {
namespace {

using Bytes = std::span<const std::byte>;

constexpr std::int32_t kMaxSide = 16384;
constexpr std::int64_t kMaxPixels = std::int64_t(1) << 28;

bool begins_with(Bytes bytes, std::string_view magic, std::size_t at = 0) {
    return bytes.size() >= at + magic.size() && std::memcmp(bytes.data() + at, magic.data(), magic.size()) == 0;
}

std::uint32_t big_endian(Bytes bytes, std::size_t at, int count) {
    std::uint32_t value = 0;
    for (int i = 0; i < count; ++i) value = value << 8 | std::to_integer<std::uint32_t>(bytes[at + std::size_t(i)]);
    return value;
}

[[noreturn]] void broken(const std::string& where, const std::string& reason) {
    throw Error(ErrorKind::input, "E0702", where, reason);
}

/// `least_bytes`: fewer than this cannot encode so many pixels, so that a tiny file with a
/// huge claim is refused before memory is set aside for it.
ImageInfo checked(ImageInfo info, Bytes bytes, std::int64_t least_bytes, const std::string& where) {
    const std::string size = std::to_string(info.width) + "x" + std::to_string(info.height);
    if (info.width <= 0 || info.height <= 0) broken(where, "the picture says it is " + size + " pixels");
    if (info.width > kMaxSide || info.height > kMaxSide || std::int64_t(info.width) * info.height > kMaxPixels)
        throw Error(ErrorKind::limit, "E0901", where,
                    "the picture is " + size + " pixels; at most " + std::to_string(kMaxSide) + " on a side and " +
                        std::to_string(kMaxPixels) + " in all are read");
    if (std::int64_t(bytes.size()) < least_bytes)
        broken(where, "a picture of " + size + " pixels cannot fit in " + std::to_string(bytes.size()) +
                          " bytes; the file is cut short?");
    return info;
}

ImageInfo png_info(Bytes bytes, const std::string& where) {
    if (bytes.size() < 33 || !begins_with(bytes, "IHDR", 12)) broken(where, "the PNG has no header");
    const std::uint32_t width = big_endian(bytes, 16, 4), height = big_endian(bytes, 20, 4);
    if (width > 0x7FFFFFFFu || height > 0x7FFFFFFFu) broken(where, "the PNG's size is out of range");
    const std::uint32_t bit_depth = big_endian(bytes, 24, 1), colour_type = big_endian(bytes, 25, 1);
    const std::uint32_t channels = colour_type == 2 ? 3 : colour_type == 4 ? 2 : colour_type == 6 ? 4 : 1;
    // Deflate shrinks at most 1032 to 1.
    const double raw = double(width) * double(height) * double(channels * bit_depth) / 8.0;
    const std::int64_t least = raw / 1032 > 1e15 ? std::int64_t(1e15) : std::int64_t(raw / 1032);
    return checked({ImageKind::png, std::int32_t(width), std::int32_t(height)}, bytes, least, where);
}

ImageInfo webp_info(Bytes bytes, const std::string& where) {
    WebPBitstreamFeatures features;
    if (WebPGetFeatures(reinterpret_cast<const std::uint8_t*>(bytes.data()), bytes.size(), &features) != VP8_STATUS_OK)
        broken(where, "the WebP header is damaged or cut short");
    if (features.has_animation)
        throw Error(ErrorKind::input, "E0701", where, "an animated WebP is not read; save one frame");
    return checked({ImageKind::webp, features.width, features.height}, bytes, 0, where);
}

/// A TurboJPEG decoder of its own, so that calls are independent.
using JpegDecoder = std::unique_ptr<void, decltype(&tjDestroy)>;

struct JpegHeader {
    ImageInfo info;
    int colour_space = 0;
};

JpegHeader read_jpeg_header(const JpegDecoder& decoder, Bytes bytes, const std::string& where) {
    JpegHeader header;
    header.info.kind = ImageKind::jpeg;
    int subsampling = 0;
    const int result = tjDecompressHeader3(decoder.get(), reinterpret_cast<const unsigned char*>(bytes.data()),
                                           static_cast<unsigned long>(bytes.size()), &header.info.width,
                                           &header.info.height, &subsampling, &header.colour_space);
    if (result != 0 && (tjGetErrorCode(decoder.get()) == TJERR_FATAL || header.info.width == 0))
        broken(where, std::string("the JPEG header is damaged or cut short: ") + tjGetErrorStr2(decoder.get()));
    // Every 8x8 block of the first component takes at least one bit.
    const std::int64_t blocks =
        ((std::int64_t(header.info.width) + 7) / 8) * ((std::int64_t(header.info.height) + 7) / 8);
    header.info = checked(header.info, bytes, blocks / 8, where);
    return header;
}

JpegDecoder make_jpeg_decoder() {
    JpegDecoder decoder(tjInitDecompress(), &tjDestroy);
    if (!decoder) throw std::bad_alloc();
    return decoder;
}

ImageKind image_kind(Bytes bytes, const std::string& where) {
    if (begins_with(bytes, "\x89PNG\r\n\x1a\n")) return ImageKind::png;
    if (begins_with(bytes, "\xFF\xD8\xFF")) return ImageKind::jpeg;
    if (begins_with(bytes, "RIFF") && begins_with(bytes, "WEBP", 8)) return ImageKind::webp;

    const char* found = "of an unknown kind";
    if (bytes.empty())
        found = "empty";
    else if (begins_with(bytes, "\xABKTX 20\xBB"))
        found = "a KTX2 texture";
    else if (begins_with(bytes, "\xABKTX 11\xBB"))
        found = "a KTX texture";
    else if (begins_with(bytes, "DDS "))
        found = "a DDS texture";
    else if (begins_with(bytes, "GIF8"))
        found = "a GIF";
    else if (begins_with(bytes, "BM"))
        found = "a BMP";
    else if (begins_with(bytes, std::string_view("II*\0", 4)) || begins_with(bytes, std::string_view("MM\0*", 4)))
        found = "a TIFF";
    else if (begins_with(bytes, "\x76\x2f\x31\x01"))
        found = "an OpenEXR picture";
    else if (begins_with(bytes, "#?RADIANCE"))
        found = "a Radiance HDR picture";
    else if (begins_with(bytes, "8BPS"))
        found = "a Photoshop file";
    else if (begins_with(bytes, "ftyp", 4))
        found = "an AVIF or HEIC picture";
    else if (begins_with(bytes, "version https://git-lfs"))
        found = "a Git LFS pointer (run: git lfs pull)";
    else if (begins_with(bytes, "<!DOCTYPE") || begins_with(bytes, "<html"))
        found = "a web page";
    else if (begins_with(bytes, "<svg") || begins_with(bytes, "<?xml"))
        found = "an XML or SVG file";
    throw Error(ErrorKind::input, "E0701", where,
                std::string("the picture is ") + found + "; PNG, JPEG and WebP are read");
}

void note(Warnings* warnings, const std::string& where, std::string reason) {
    if (warnings) warnings->push_back({"W0703", where, std::move(reason)});
}

// ---------------------------------------------------------------- PNG

/// What libpng's callbacks share with the caller. Fixed buffers: longjmp runs no destructor.
struct PngSource {
    Bytes bytes;
    std::size_t at = 0;
    std::jmp_buf give_up;
    char error[160] = "";
    char warning[160] = "";
    int warnings = 0;
};

void png_failed(png_structp png, png_const_charp message) {
    auto* source = static_cast<PngSource*>(png_get_error_ptr(png));
    std::snprintf(source->error, sizeof source->error, "%s", message);
    std::longjmp(source->give_up, 1);
}

void png_warned(png_structp png, png_const_charp message) {
    auto* source = static_cast<PngSource*>(png_get_error_ptr(png));
    if (source->warnings++ == 0) std::snprintf(source->warning, sizeof source->warning, "%s", message);
}

void png_read(png_structp png, png_bytep out, std::size_t size) {
    auto* source = static_cast<PngSource*>(png_get_io_ptr(png));
    if (source->bytes.size() - source->at < size) png_error(png, "the file ends too early");
    std::memcpy(out, source->bytes.data() + source->at, size);
    source->at += size;
}

enum class PngRows : std::uint8_t { palette, rgba8, rgba16 };

/// The one function that libpng may jump out of: nothing in it has a destructor. Fills `height`
/// rows of `row_bytes`.
/// @return false when source.error says why not.
bool read_png_rows(PngSource& source, png_structp png, png_infop info, std::int32_t width, std::int32_t height,
                   PngRows kind, std::uint8_t* rows, std::size_t row_bytes) {
    if (setjmp(source.give_up)) return false;
    png_set_read_fn(png, &source, png_read);
    png_set_user_limits(png, kMaxSide, kMaxSide);
    png_set_chunk_malloc_max(png, 8u << 20);
    png_read_info(png, info);
    if (std::int32_t(png_get_image_width(png, info)) != width ||
        std::int32_t(png_get_image_height(png, info)) != height)
        png_error(png, "two headers that differ");
    if (kind == PngRows::palette) {
        png_set_packing(png);
    } else {
        png_set_expand(png); // low bit depths to 8 bits, tRNS to alpha
        if (kind == PngRows::rgba16)
            png_set_swap(png); // to this machine's order
        else
            png_set_scale_16(png);
        png_set_gray_to_rgb(png);
        png_set_add_alpha(png, kind == PngRows::rgba16 ? 0xFFFF : 0xFF, PNG_FILLER_AFTER);
    }
    const int passes = png_set_interlace_handling(png);
    png_read_update_info(png, info);
    if (png_get_rowbytes(png, info) != row_bytes) png_error(png, "rows of an odd size");
    for (int pass = 0; pass < passes; ++pass)
        for (std::int32_t y = 0; y < height; ++y) png_read_row(png, rows + std::size_t(y) * row_bytes, nullptr);
    png_read_end(png, info);
    return true;
}

/// libpng sets memory aside for a chunk before it knows whether the file is that long.
/// @throws Error E0702 unless the chunks follow each other up to the end chunk.
void check_png_chunks(Bytes bytes, const std::string& where) {
    std::size_t at = 8;
    while (bytes.size() - at >= 12) {
        const std::uint32_t length = big_endian(bytes, at, 4);
        if (length > bytes.size() - at - 12) break;
        if (begins_with(bytes, "IEND", at + 4)) return;
        at += 12 + std::size_t(length);
    }
    broken(where, "the PNG is damaged: the chunk at byte " + std::to_string(at) + " of " +
                      std::to_string(bytes.size()) + " goes past the end; the file is cut short?");
}

std::vector<Rgba8> png_palette(png_structp png, png_infop info) {
    png_colorp colours = nullptr;
    png_bytep alpha = nullptr;
    int colour_count = 0, alpha_count = 0;
    if (!png_get_PLTE(png, info, &colours, &colour_count)) return {};
    if (!png_get_tRNS(png, info, &alpha, &alpha_count, nullptr)) alpha_count = 0;
    std::vector<Rgba8> palette;
    palette.reserve(std::size_t(colour_count));
    for (int i = 0; i < colour_count; ++i)
        palette.push_back(
            {colours[i].red, colours[i].green, colours[i].blue, i < alpha_count ? alpha[i] : std::uint8_t(255)});
    return palette;
}

/// libpng's state for one picture.
struct PngReader {
    std::unique_ptr<PngSource> source = std::make_unique<PngSource>();
    png_structp png = nullptr;
    png_infop info = nullptr;

    PngReader(Bytes bytes, const std::string& where) {
        check_png_chunks(bytes, where);
        source->bytes = bytes;
        png = png_create_read_struct(PNG_LIBPNG_VER_STRING, source.get(), png_failed, png_warned);
        info = png ? png_create_info_struct(png) : nullptr;
        if (info) return;
        png_destroy_read_struct(&png, nullptr, nullptr);
        throw std::bad_alloc();
    }
    ~PngReader() { png_destroy_read_struct(&png, &info, nullptr); }
    PngReader(const PngReader&) = delete;
    PngReader& operator=(const PngReader&) = delete;
};

Image<Rgba16> decode_png16(Bytes bytes, const std::string& where) {
    const ImageInfo size = png_info(bytes, where);
    PngReader reader(bytes, where);
    Image<Rgba16> image(size.width, size.height);
    if (!read_png_rows(*reader.source, reader.png, reader.info, size.width, size.height, PngRows::rgba16,
                       reinterpret_cast<std::uint8_t*>(image.row(0)), std::size_t(size.width) * sizeof(Rgba16)))
        broken(where, std::string("the PNG is damaged: ") + reader.source->error);
    return image;
}

Image<Rgba8> decode_png(Bytes bytes, const std::string& where, Warnings* warnings) {
    const ImageInfo size = png_info(bytes, where);
    PngReader reader(bytes, where);
    const PngSource* const source = reader.source.get();

    // libpng would draw indices beyond the palette as black; they are looked up here instead.
    const bool palette = big_endian(bytes, 25, 1) == PNG_COLOR_TYPE_PALETTE;
    Image<Rgba8> image(size.width, size.height);
    std::vector<std::uint8_t> indices(palette ? image.pixels().size() : 0);
    auto* const rows = palette ? indices.data() : reinterpret_cast<std::uint8_t*>(image.row(0));
    if (!read_png_rows(*reader.source, reader.png, reader.info, size.width, size.height,
                       palette ? PngRows::palette : PngRows::rgba8, rows,
                       std::size_t(size.width) * (palette ? 1 : sizeof(Rgba8))))
        broken(where, std::string("the PNG is damaged: ") + source->error);
    if (palette) {
        const std::vector<Rgba8> colours = png_palette(reader.png, reader.info);
        for (std::size_t i = 0; i < indices.size(); ++i) {
            if (indices[i] >= colours.size())
                broken(where, "the PNG is damaged: a pixel has colour " + std::to_string(indices[i]) +
                                  " of a palette of " + std::to_string(colours.size()));
            image.pixels()[i] = colours[indices[i]];
        }
    }
    if (source->warnings)
        note(warnings, where,
             "the PNG is odd, but whole: " + std::string(source->warning) +
                 (source->warnings > 1 ? " (and " + std::to_string(source->warnings - 1) + " more)" : ""));
    return image;
}

// ---------------------------------------------------------------- JPEG

/// What is wrong with the first directory of the Exif block `tiff`, empty if nothing.
std::string exif_fault(Bytes tiff) {
    const bool little = begins_with(tiff, std::string_view("II*\0", 4));
    if (!little && !begins_with(tiff, std::string_view("MM\0*", 4))) return "its Exif block has no TIFF header";
    const auto read = [&](std::size_t at, int count) {
        std::uint32_t value = big_endian(tiff, at, count);
        if (little) value = count == 2 ? (value >> 8 | value << 8) & 0xFFFFu : __builtin_bswap32(value);
        return value;
    };
    const char* const beyond = "its Exif block points past its end";
    if (tiff.size() < 8) return beyond;
    const std::size_t directory = read(4, 4);
    if (directory + 2 > tiff.size()) return beyond;
    const std::size_t entries = read(directory, 2);
    if (directory + 2 + 12 * entries > tiff.size()) return beyond;
    for (std::size_t i = 0; i < entries; ++i) {
        const std::size_t entry = directory + 2 + 12 * i;
        static constexpr std::array<std::uint8_t, 14> bytes_of_type{0, 1, 1, 2, 4, 8, 1, 1, 2, 4, 8, 4, 8, 4};
        const std::uint32_t type = read(entry + 2, 2);
        if (type == 0 || type >= bytes_of_type.size())
            return "its Exif block has a value of unknown type " + std::to_string(type);
        const std::uint64_t size = std::uint64_t(read(entry + 4, 4)) * bytes_of_type[type];
        if (size > 4 && read(entry + 8, 4) + size > tiff.size()) return beyond;
    }
    return {};
}

/// What is wrong with the metadata that the decoder skips; empty if nothing.
std::string jpeg_metadata_fault(Bytes bytes) {
    constexpr std::uint32_t kStartOfScan = 0xDA, kApp1 = 0xE1;
    for (std::size_t at = 2; at + 4 <= bytes.size() && big_endian(bytes, at, 1) == 0xFF;) {
        const std::uint32_t marker = big_endian(bytes, at + 1, 1), length = big_endian(bytes, at + 2, 2);
        if (marker == kStartOfScan || length < 2 || at + 2 + length > bytes.size()) break;
        const Bytes segment = bytes.subspan(at + 4, length - 2);
        if (marker == kApp1 && begins_with(segment, std::string_view("Exif\0\0", 6)))
            return exif_fault(segment.subspan(6));
        at += 2 + length;
    }
    return {};
}

Image<Rgba8> decode_jpeg(Bytes bytes, const std::string& where, Warnings* warnings) {
    const JpegDecoder decoder = make_jpeg_decoder();
    const JpegHeader header = read_jpeg_header(decoder, bytes, where);
    const bool four_inks = header.colour_space == TJCS_CMYK || header.colour_space == TJCS_YCCK;

    Image<Rgba8> image(header.info.width, header.info.height);
    auto* out = reinterpret_cast<unsigned char*>(image.row(0));
    const int result = tjDecompress2(decoder.get(), reinterpret_cast<const unsigned char*>(bytes.data()),
                                     static_cast<unsigned long>(bytes.size()), out, header.info.width, 0,
                                     header.info.height, four_inks ? TJPF_CMYK : TJPF_RGBA, TJFLAG_LIMITSCANS);
    if (result != 0) {
        // Stray bytes before a marker lose nothing; every other complaint means lost pixels.
        const std::string reason = tjGetErrorStr2(decoder.get());
        if (tjGetErrorCode(decoder.get()) == TJERR_FATAL || reason.find("extraneous bytes") == std::string::npos)
            broken(where, "the JPEG is damaged: " + reason);
        note(warnings, where, "the JPEG is odd, but whole: " + reason);
    }
    if (four_inks) // Adobe stores inks inverted: 255 is no ink
        for (Rgba8& p : image.pixels()) {
            const auto under_black = [k = unsigned(p.a)](std::uint8_t ink) {
                return static_cast<std::uint8_t>((ink * k + 127u) / 255u);
            };
            p = {under_black(p.r), under_black(p.g), under_black(p.b), 255};
        }
    if (warnings)
        if (const std::string fault = jpeg_metadata_fault(bytes); !fault.empty())
            note(warnings, where, "the JPEG is odd, but whole: " + fault);
    return image;
}

// ---------------------------------------------------------------- WebP

Image<Rgba8> decode_webp(Bytes bytes, const std::string& where) {
    const ImageInfo size = webp_info(bytes, where);
    Image<Rgba8> image(size.width, size.height);
    const std::size_t out_size = image.pixels().size() * sizeof(Rgba8);
    if (!WebPDecodeRGBAInto(reinterpret_cast<const std::uint8_t*>(bytes.data()), bytes.size(),
                            reinterpret_cast<std::uint8_t*>(image.row(0)), out_size, size.width * 4))
        broken(where, "the WebP is damaged or cut short");
    return image;
}

} // namespace

ImageInfo image_info(Bytes bytes, const std::string& where) {
    switch (image_kind(bytes, where)) {
    case ImageKind::png: return png_info(bytes, where);
    case ImageKind::jpeg: return read_jpeg_header(make_jpeg_decoder(), bytes, where).info;
    case ImageKind::webp: break;
    }
    return webp_info(bytes, where);
}

Image<Rgba8> decode_image(Bytes bytes, const std::string& where, Warnings* warnings) {
    switch (image_kind(bytes, where)) {
    case ImageKind::png: return decode_png(bytes, where, warnings);
    case ImageKind::jpeg: return decode_jpeg(bytes, where, warnings);
    case ImageKind::webp: break;
    }
    return decode_webp(bytes, where);
}

Image<Rgba16> decode_values(Bytes bytes, const std::string& where) {
    if (image_kind(bytes, where) == ImageKind::png) {
        (void)png_info(bytes, where);
        if (big_endian(bytes, 24, 1) == 16) return decode_png16(bytes, where);
    }
    const Image<Rgba8> image = decode_image(bytes, where);
    Image<Rgba16> values(image.window());
    std::transform(image.pixels().begin(), image.pixels().end(), values.pixels().begin(), [](Rgba8 c) {
        return Rgba16{c.r, c.g, c.b, c.a};
    });
    return values;
}

} // namespace porthole
