// Pictures in and out: PNG, JPEG and WebP decoding; PNG (8, 16 bit) and JPEG encoding.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "porthole/base/error.h"
#include "porthole/base/image.h"
#include "porthole/base/parallel.h"

namespace porthole {

enum class ImageKind : std::uint8_t { png, jpeg, webp };

struct ImageInfo {
    ImageKind kind = ImageKind::png;
    std::int32_t width = 0, height = 0;
};

/// What the header says, before anything is allocated; the same limits as decode_image.
/// @throws Error input E0701, E0702; limit E0901.
[[nodiscard]] ImageInfo image_info(std::span<const std::byte> bytes, const std::string& where);

/// Decodes a PNG, JPEG or WebP picture, told apart by its first bytes, to sRGB-encoded RGBA8
/// with straight alpha. Colour profiles and orientation tags are not applied, as glTF asks.
/// @param where     the file and place that errors name.
/// @param warnings  receives what is odd in a picture that is nevertheless whole (W0703:
///                  damaged metadata, stray bytes).
/// @throws Error input E0701 (unknown or unsupported kind), E0702 (broken or cut short), limit
///         E0901 (more than 16384 pixels on a side or 2^28 in all: checked from the header
///         first).
/// Safe to call concurrently.
[[nodiscard]] Image<Rgba8> decode_image(std::span<const std::byte> bytes, const std::string& where,
                                        Warnings* warnings = nullptr);

/// The channel values that a PNG or another picture holds: of 16 bits if it is a 16-bit PNG,
/// else of 8 (alpha is then 255 where there is none).
/// @throws Error as decode_image.
[[nodiscard]] Image<Rgba16> decode_values(std::span<const std::byte> bytes, const std::string& where);

/// PNG of straight-alpha sRGB pixels. `channels` 3 drops alpha. Same bytes every time, for any
/// number of threads.
/// @throws Error output E0804 when the image is empty or too large for a PNG; Cancelled.
/// Cost: about 20 ms of one thread for 1920x1080.
[[nodiscard]] std::vector<std::byte> encode_png(const Image<Rgba8>& image, int channels, const Control& control = {});
/// 16-bit PNG; `samples` holds width*height*channels native-endian values, sRGB-encoded, row
/// by row; `channels` 1 (grey), 3 or 4.
/// @throws Error output E0804 as encode_png, or when the sizes do not agree.
[[nodiscard]] std::vector<std::byte> encode_png16(std::span<const std::uint16_t> samples, int width, int height,
                                                  int channels, const Control& control = {});
/// JPEG 4:4:4 (alpha dropped), quality 1..100.
/// @throws Error output E0804 when the image is empty, above 65535 pixels on a side, or
///         `quality` is out of range.
[[nodiscard]] std::vector<std::byte> encode_jpeg(const Image<Rgba8>& image, int quality = 92);

} // namespace porthole
