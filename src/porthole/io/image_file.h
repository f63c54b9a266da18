// Pictures in and out: PNG, JPEG and WebP decoding; PNG (8, 16 bit) and JPEG encoding.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "porthole/base/image.h"

namespace porthole {

/// Decodes a PNG, JPEG or WebP picture, told apart by its first bytes, to sRGB-encoded RGBA8
/// with straight alpha.
/// @param where  the file and place that errors name.
/// @throws Error input E0701 (unknown or unsupported kind), E0702 (broken), limit E0901
///         (more than 16384 pixels on a side or 2^28 in all: checked from the header first).
/// Safe to call concurrently.
[[nodiscard]] Image<Rgba8> decode_image(std::span<const std::byte> bytes, const std::string& where);

/// PNG of straight-alpha sRGB pixels. `channels` 3 drops alpha. Same bytes every time.
[[nodiscard]] std::vector<std::byte> encode_png(const Image<Rgba8>& image, int channels);
/// 16-bit PNG; `rgba` holds width*height*channels native-endian samples, sRGB-encoded.
[[nodiscard]] std::vector<std::byte> encode_png16(std::span<const std::uint16_t> samples, int width, int height,
                                                  int channels);
/// JPEG 4:4:4 (alpha dropped), quality 1..100.
[[nodiscard]] std::vector<std::byte> encode_jpeg(const Image<Rgba8>& image, int quality = 92);

} // namespace porthole
