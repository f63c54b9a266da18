#include "porthole/io/image_file.h"

#include <png.h>
#include <webp/encode.h>

#include <cstring>
#include <random>

#include <gtest/gtest.h>

namespace porthole {
namespace {

using Bytes = std::vector<std::byte>;

template <typename F> std::string code_of(F&& f) {
    try {
        f();
    } catch (const Error& error) {
        return error.code;
    }
    return "none";
}
std::string decoding(const Bytes& bytes) {
    return code_of([&] { (void)decode_image(bytes, "x"); });
}

Image<Rgba8> noise(int width, int height, bool opaque) {
    std::mt19937 random(7);
    Image<Rgba8> image(width, height);
    const auto byte = [&] { return static_cast<std::uint8_t>(random()); };
    for (Rgba8& p : image.pixels()) p = {byte(), byte(), byte(), opaque ? std::uint8_t(255) : byte()};
    return image;
}

/// A PNG of any kind, written with libpng directly. `rows` are as PNG stores them.
struct PngKind {
    int width, height, bit_depth, colour_type, interlace = PNG_INTERLACE_NONE;
    std::vector<png_color> palette = {};
    std::vector<png_byte> palette_alpha = {};
    const png_color_16* transparent = nullptr;
};
Bytes plain_png(const PngKind& kind, std::vector<std::vector<std::uint8_t>> rows) {
    Bytes out;
    png_structp png = png_create_write_struct(PNG_LIBPNG_VER_STRING, nullptr, nullptr, nullptr);
    png_infop info = png_create_info_struct(png);
    png_set_write_fn(
        png, &out,
        [](png_structp p, png_bytep data, std::size_t size) {
            auto* to = static_cast<Bytes*>(png_get_io_ptr(p));
            const auto* first = reinterpret_cast<const std::byte*>(data);
            to->insert(to->end(), first, first + size);
        },
        nullptr);
    png_set_IHDR(png, info, png_uint_32(kind.width), png_uint_32(kind.height), kind.bit_depth, kind.colour_type,
                 kind.interlace, PNG_COMPRESSION_TYPE_DEFAULT, PNG_FILTER_TYPE_DEFAULT);
    if (!kind.palette.empty()) png_set_PLTE(png, info, kind.palette.data(), int(kind.palette.size()));
    if (!kind.palette_alpha.empty() || kind.transparent)
        png_set_tRNS(png, info, kind.palette_alpha.data(), int(kind.palette_alpha.size()), kind.transparent);
    std::vector<png_bytep> pointers;
    for (auto& row : rows) pointers.push_back(row.data());
    png_set_rows(png, info, pointers.data());
    png_write_png(png, info, PNG_TRANSFORM_IDENTITY, nullptr);
    png_destroy_write_struct(&png, &info);
    return out;
}

TEST(Png, RoundTrip) {
    for (const int width : {1, 7, 64}) {
        const Image<Rgba8> image = noise(width, 5, false);
        EXPECT_EQ(decode_image(encode_png(image, 4), "x"), image);
        Image<Rgba8> opaque = image;
        for (Rgba8& p : opaque.pixels()) p.a = 255;
        EXPECT_EQ(decode_image(encode_png(image, 3), "x"), opaque);
        EXPECT_EQ(encode_png(image, 4), encode_png(image, 4));
    }
}

TEST(Png, SixteenBitsKeepEverySample) {
    std::vector<std::uint16_t> samples;
    for (int i = 0; i < 5 * 4 * 3; ++i) samples.push_back(static_cast<std::uint16_t>(i * 1111));
    const Bytes file = encode_png16(samples, 5, 4, 3);
    // Read back with libpng: our own reader makes 8 bits of it.
    png_structp png = png_create_read_struct(PNG_LIBPNG_VER_STRING, nullptr, nullptr, nullptr);
    png_infop info = png_create_info_struct(png);
    std::span<const std::byte> left(file);
    png_set_read_fn(png, &left, [](png_structp p, png_bytep out, std::size_t size) {
        auto* from = static_cast<std::span<const std::byte>*>(png_get_io_ptr(p));
        std::memcpy(out, from->data(), size);
        *from = from->subspan(size);
    });
    png_read_png(png, info, PNG_TRANSFORM_SWAP_ENDIAN, nullptr);
    ASSERT_EQ(png_get_bit_depth(png, info), 16);
    png_bytepp rows = png_get_rows(png, info);
    for (std::size_t y = 0; y < 4; ++y) EXPECT_EQ(std::memcmp(rows[y], samples.data() + y * 15, 30), 0);
    png_destroy_read_struct(&png, &info, nullptr);

    const Image<Rgba8> eight = decode_image(file, "x");
    EXPECT_EQ(int(eight(1, 0).r), (3333 * 255 + 32895) >> 16);
}

TEST(Png, EveryColourTypeBecomesRgba) {
    const std::vector<png_color> palette{{255, 0, 0}, {0, 255, 0}, {0, 0, 255}};
    for (const int interlace : {PNG_INTERLACE_NONE, PNG_INTERLACE_ADAM7}) {
        const Image<Rgba8> from_palette = decode_image(
            plain_png({5, 1, 2, PNG_COLOR_TYPE_PALETTE, interlace, palette, {128}}, {{0b00011000, 0b01000000}}), "x");
        EXPECT_EQ(from_palette(0, 0), (Rgba8{255, 0, 0, 128}));
        EXPECT_EQ(from_palette(1, 0), (Rgba8{0, 255, 0, 255}));
        EXPECT_EQ(from_palette(2, 0), (Rgba8{0, 0, 255, 255}));
        EXPECT_EQ(from_palette(4, 0), (Rgba8{0, 255, 0, 255}));
        const Image<Rgba8> grey1 =
            decode_image(plain_png({3, 2, 1, PNG_COLOR_TYPE_GRAY, interlace}, {{0xA0}, {0x40}}), "x");
        EXPECT_EQ(grey1(0, 0), (Rgba8{255, 255, 255, 255}));
        EXPECT_EQ(grey1(1, 0), (Rgba8{0, 0, 0, 255}));
        EXPECT_EQ(grey1(1, 1), (Rgba8{255, 255, 255, 255}));
        const Image<Rgba8> grey_alpha =
            decode_image(plain_png({1, 1, 8, PNG_COLOR_TYPE_GRAY_ALPHA, interlace}, {{77, 99}}), "x");
        EXPECT_EQ(grey_alpha(0, 0), (Rgba8{77, 77, 77, 99}));
    }
    png_color_16 key{};
    key.red = 1;
    key.green = 2;
    key.blue = 3;
    const Image<Rgba8> keyed = decode_image(
        plain_png({2, 1, 8, PNG_COLOR_TYPE_RGB, PNG_INTERLACE_NONE, {}, {}, &key}, {{1, 2, 3, 4, 5, 6}}), "x");
    EXPECT_EQ(keyed(0, 0), (Rgba8{1, 2, 3, 0}));
    EXPECT_EQ(keyed(1, 0), (Rgba8{4, 5, 6, 255}));
}

TEST(Png, IndexBeyondThePaletteIsAnError) {
    const std::vector<png_color> palette{{255, 0, 0}, {0, 255, 0}};
    EXPECT_EQ(decoding(plain_png({1, 1, 8, PNG_COLOR_TYPE_PALETTE, PNG_INTERLACE_NONE, palette}, {{1}})), "none");
    EXPECT_EQ(decoding(plain_png({1, 1, 8, PNG_COLOR_TYPE_PALETTE, PNG_INTERLACE_NONE, palette}, {{2}})), "E0702");
}

TEST(Jpeg, RoundTripIsClose) {
    Image<Rgba8> image(40, 30);
    for (int y = 0; y < 30; ++y)
        for (int x = 0; x < 40; ++x) image(x, y) = {std::uint8_t(6 * x), std::uint8_t(8 * y), 128, 255};
    const Image<Rgba8> back = decode_image(encode_jpeg(image, 95), "x");
    ASSERT_EQ(back.width(), 40);
    ASSERT_EQ(back.height(), 30);
    for (int y = 0; y < 30; ++y)
        for (int x = 0; x < 40; ++x) {
            EXPECT_NEAR(back(x, y).r, image(x, y).r, 8);
            EXPECT_NEAR(back(x, y).g, image(x, y).g, 8);
            EXPECT_EQ(back(x, y).a, 255);
        }
    EXPECT_EQ(encode_jpeg(image), encode_jpeg(image));
    EXPECT_LT(encode_jpeg(image, 20).size(), encode_jpeg(image, 95).size());
}

TEST(WebP, LosslessRoundTrip) {
    const Image<Rgba8> image = noise(19, 11, true);
    std::uint8_t* encoded = nullptr;
    const std::size_t size =
        WebPEncodeLosslessRGBA(reinterpret_cast<const std::uint8_t*>(image.row(0)), 19, 11, 76, &encoded);
    const Bytes file(reinterpret_cast<std::byte*>(encoded), reinterpret_cast<std::byte*>(encoded) + size);
    WebPFree(encoded);
    EXPECT_EQ(decode_image(file, "x"), image);
    EXPECT_EQ(image_info(file, "x").kind, ImageKind::webp);
    for (std::size_t n = 0; n < file.size() - 1; ++n)
        EXPECT_NE(decoding(Bytes(file.begin(), file.begin() + std::ptrdiff_t(n))), "none") << n;
}

TEST(Images, ACutFileIsNeverHalfAPicture) {
    const Image<Rgba8> image = noise(30, 20, true);
    for (const Bytes& file : {encode_png(image, 3), encode_jpeg(image, 90)}) {
        ASSERT_EQ(decoding(file), "none");
        // The last two bytes of a JPEG are its end mark; nothing is missing but that.
        for (std::size_t n = 0; n < file.size() - 2; ++n)
            ASSERT_NE(decoding(Bytes(file.begin(), file.begin() + std::ptrdiff_t(n))), "none") << n;
    }
}

TEST(Images, FlippedBitsNeverCrash) {
    const Image<Rgba8> image = noise(16, 12, false);
    std::mt19937 random(3);
    for (const Bytes& file : {encode_png(image, 4), encode_jpeg(image, 80)})
        for (int round = 0; round < 3000; ++round) {
            Bytes bad = file;
            for (int k = 0; k <= round % 4; ++k) bad[random() % bad.size()] ^= std::byte(1u << (random() % 8));
            (void)decoding(bad);
        }
}

TEST(Images, SizesAreCheckedBeforeAnythingIsAllocated) {
    Bytes bomb = encode_png(Image<Rgba8>(4, 4), 3);
    const auto set = [&](std::size_t at, std::uint32_t value) {
        for (std::size_t i = 0; i < 4; ++i) bomb[at + i] = std::byte(value >> (24 - 8 * i));
    };
    set(16, 20000);
    EXPECT_EQ(decoding(bomb), "E0901");
    set(16, 16384);
    set(20, 16384);
    EXPECT_EQ(decoding(bomb), "E0702") << "a few bytes cannot hold 2^28 pixels";
    set(16, 0);
    EXPECT_EQ(decoding(bomb), "E0702");
    set(16, 0x80000000u);
    EXPECT_EQ(decoding(bomb), "E0702");
}

TEST(Images, UnknownKindsAreNamed) {
    const auto reason = [](std::string_view text) {
        try {
            (void)decode_image(std::as_bytes(std::span(text)), "x");
        } catch (const Error& error) {
            return error.code + " " + error.what();
        }
        return std::string("none");
    };
    EXPECT_NE(reason("GIF89a...").find("a GIF"), std::string::npos);
    EXPECT_NE(reason("\xABKTX 20\xBB\r\n").find("KTX2"), std::string::npos);
    EXPECT_NE(reason("<html>").find("web page"), std::string::npos);
    EXPECT_EQ(reason("").substr(0, 5), "E0701");
}

TEST(Images, OddMetadataIsAWarning) {
    Bytes file = encode_jpeg(noise(8, 8, true), 90);
    // An Exif block whose only value has a type that does not exist.
    const std::string_view block("\xFF\xE1\x00\x22"
                                 "Exif\0\0II*\0\x08\0\0\0\x01\0\x0E\x01\x81\0\x01\0\0\0\0\0\0\0\0\0\0\0",
                                 36);
    const auto* first = reinterpret_cast<const std::byte*>(block.data());
    file.insert(file.begin() + 2, first, first + block.size());
    Warnings warnings;
    EXPECT_EQ(decode_image(file, "x", &warnings).width(), 8);
    ASSERT_EQ(warnings.size(), 1u);
    EXPECT_EQ(warnings[0].code, "W0703");
}

TEST(Images, WritersRefuseWhatCannotBe) {
    EXPECT_EQ(code_of([] { (void)encode_png(Image<Rgba8>{}, 3); }), "E0804");
    EXPECT_EQ(code_of([] { (void)encode_png(Image<Rgba8>(1, 1), 2); }), "E0804");
    EXPECT_EQ(code_of([] { (void)encode_png16(std::vector<std::uint16_t>(5), 2, 1, 3); }), "E0804");
    EXPECT_EQ(code_of([] { (void)encode_jpeg(Image<Rgba8>{}, 90); }), "E0804");
    EXPECT_EQ(code_of([] { (void)encode_jpeg(Image<Rgba8>(1, 1), 0); }), "E0804");
    EXPECT_EQ(code_of([] { (void)encode_jpeg(Image<Rgba8>(1, 1), 101); }), "E0804");
}

} // namespace
} // namespace porthole
