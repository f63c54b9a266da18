// From linear light to the numbers in a file: the exact sRGB curve.
#pragma once

#include <cstdint>
#include <vector>

#include "porthole/base/image.h"
#include "porthole/base/parallel.h"

namespace porthole {

/// sRGB-encoded, straight-alpha pixels of a linear, premultiplied picture. Values are
/// clamped to [0, 1], NaN counts as 0, and the encoded value is the nearest one.
/// @param background  linear; laid under the picture unless `keep_alpha`.
/// @param keep_alpha  true: alpha stays, colours are divided by it; false: alpha is 255.
/// Cost: about 10 ms of one thread for 1920x1080.
[[nodiscard]] Image<Rgba8> to_srgb8(const Image<Vec4f>& linear, Vec3f background, bool keep_alpha,
                                    const Control& control = {});

/// The same with 16 bits a channel, for encode_png16: width*height*channels samples, 4
/// channels if keep_alpha, else 3.
[[nodiscard]] std::vector<std::uint16_t> to_srgb16(const Image<Vec4f>& linear, Vec3f background, bool keep_alpha,
                                                   const Control& control = {});

/// The linear value of an sRGB-encoded one, both in [0, 1].
[[nodiscard]] double linear_from_srgb(double encoded);

} // namespace porthole
