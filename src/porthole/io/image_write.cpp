#include <png.h>
#include <turbojpeg.h>
#include <zlib.h>

#include <bit>
#include <csetjmp>
#include <cstdio>
#include <cstring>
#include <memory>
#include <new>

#include "porthole/io/image_file.h"

namespace porthole {
namespace {

[[noreturn]] void refuse(const std::string& reason) { throw Error(ErrorKind::output, "E0804", "picture", reason); }

/// What libpng's callbacks share with the caller.
struct PngSink {
    std::vector<std::byte> bytes;
    bool out_of_memory = false;
    std::jmp_buf give_up;
    char error[160] = "";
};

void png_failed(png_structp png, png_const_charp message) {
    auto* sink = static_cast<PngSink*>(png_get_error_ptr(png));
    std::snprintf(sink->error, sizeof sink->error, "%s", message);
    std::longjmp(sink->give_up, 1);
}

void png_ignored(png_structp, png_const_charp) {}

void png_append(png_structp png, png_bytep data, std::size_t size) {
    auto* sink = static_cast<PngSink*>(png_get_io_ptr(png));
    try {
        const auto* first = reinterpret_cast<const std::byte*>(data);
        sink->bytes.insert(sink->bytes.end(), first, first + size);
    } catch (const std::bad_alloc&) { // must not travel through C code
        sink->out_of_memory = true;
    }
    if (sink->out_of_memory) png_error(png, "out of memory");
}

void png_flush_nothing(png_structp) {}

struct PngLayout {
    std::int32_t width = 0, height = 0;
    int bit_depth = 8;
    int colour_type = PNG_COLOR_TYPE_RGB;
    bool drop_alpha = false; ///< rows are RGBA, the file is RGB
};

/// The one function that libpng may jump out of: nothing in it has a destructor.
/// @return false when sink.error says why not.
bool write_png_rows(PngSink& sink, png_structp png, png_infop info, const PngLayout& layout, const std::uint8_t* rows,
                    std::size_t row_bytes) {
    if (setjmp(sink.give_up)) return false;
    png_set_write_fn(png, &sink, png_append, png_flush_nothing);
    png_set_user_limits(png, 0x7FFFFFFF, 0x7FFFFFFF);
    // One fixed filter and the fastest level: a third of the default's time for twice the
    // bytes on clean pictures, a twelfth for a fifth more bytes on noisy ones.
    png_set_compression_level(png, 1);
    png_set_compression_strategy(png, Z_DEFAULT_STRATEGY);
    png_set_filter(png, PNG_FILTER_TYPE_BASE, PNG_FILTER_UP);
    png_set_IHDR(png, info, png_uint_32(layout.width), png_uint_32(layout.height), layout.bit_depth, layout.colour_type,
                 PNG_INTERLACE_NONE, PNG_COMPRESSION_TYPE_DEFAULT, PNG_FILTER_TYPE_DEFAULT);
    png_set_sRGB(png, info, PNG_sRGB_INTENT_PERCEPTUAL);
    png_write_info(png, info);
    if (layout.drop_alpha) png_set_filler(png, 0, PNG_FILLER_AFTER);
    if (layout.bit_depth == 16 && std::endian::native == std::endian::little) png_set_swap(png);
    for (std::int32_t y = 0; y < layout.height; ++y) png_write_row(png, rows + std::size_t(y) * row_bytes);
    png_write_end(png, info);
    return true;
}

std::vector<std::byte> write_png(const PngLayout& layout, const void* rows, std::size_t row_bytes) {
    if (layout.width <= 0 || layout.height <= 0) refuse("a picture without pixels cannot be written");
    const auto sink = std::make_unique<PngSink>();
    struct Writer {
        png_structp png = nullptr;
        png_infop info = nullptr;
        ~Writer() { png_destroy_write_struct(&png, &info); }
    } writer;
    writer.png = png_create_write_struct(PNG_LIBPNG_VER_STRING, sink.get(), png_failed, png_ignored);
    writer.info = writer.png ? png_create_info_struct(writer.png) : nullptr;
    if (!writer.info) throw std::bad_alloc();
    if (!write_png_rows(*sink, writer.png, writer.info, layout, static_cast<const std::uint8_t*>(rows), row_bytes)) {
        if (sink->out_of_memory) throw std::bad_alloc();
        refuse(std::string("the PNG encoder refuses: ") + sink->error);
    }
    return std::move(sink->bytes);
}

} // namespace

std::vector<std::byte> encode_png(const Image<Rgba8>& image, int channels) {
    if (channels != 3 && channels != 4) refuse("a PNG has 3 or 4 channels, not " + std::to_string(channels));
    PngLayout layout{image.width(), image.height(), 8, channels == 4 ? PNG_COLOR_TYPE_RGBA : PNG_COLOR_TYPE_RGB,
                     channels == 3};
    return write_png(layout, image.pixels().data(), std::size_t(image.width()) * sizeof(Rgba8));
}

std::vector<std::byte> encode_png16(std::span<const std::uint16_t> samples, int width, int height, int channels) {
    if (channels != 1 && channels != 3 && channels != 4)
        refuse("a 16-bit PNG has 1, 3 or 4 channels, not " + std::to_string(channels));
    if (width < 0 || height < 0 || samples.size() != std::size_t(width) * std::size_t(height) * std::size_t(channels))
        refuse("the samples do not fill " + std::to_string(width) + "x" + std::to_string(height) + "x" +
               std::to_string(channels));
    const int colour_type = channels == 1   ? PNG_COLOR_TYPE_GRAY
                            : channels == 3 ? PNG_COLOR_TYPE_RGB
                                            : PNG_COLOR_TYPE_RGBA;
    return write_png({width, height, 16, colour_type, false}, samples.data(),
                     std::size_t(width) * std::size_t(channels) * sizeof(std::uint16_t));
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
