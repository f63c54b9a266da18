#include "porthole/render/sampling.h"

namespace porthole {

namespace {
constexpr double kGoldenAngle = 2.39996322972865332;
}

int cell_rank(int x, int y) {
    // Bayer's matrix: bits of x^y and y interleaved, lowest bit most significant.
    const int a = (x ^ y) & 3, b = y & 3;
    return ((a & 1) << 3) | ((b & 1) << 2) | ((a & 2) << 0) | ((b & 2) >> 1);
}

Vec2f pixel_sample(int i) {
    const double a = 0.5 + i * 0.75487766624669276, b = 0.5 + i * 0.56984029099805327;
    return {float(a - std::floor(a)), float(b - std::floor(b))};
}

Vec2f disc_point(int i, int n) {
    const double r = std::sqrt((i + 0.5) / n), phi = i * kGoldenAngle;
    return {float(r * std::cos(phi)), float(r * std::sin(phi))};
}

std::vector<AmbientRay> ambient_pattern(int per_pixel) {
    const int n = per_pixel * kCellPixels;
    std::vector<AmbientRay> rays(std::size_t(n < 0 ? 0 : n));
    for (int i = 0; i < n; ++i) {
        // Half a sphere of axes: a Fibonacci spiral. Ray j takes the j-th band of heights, so
        // the few rays of one pixel are spread as well.
        const double z = 1.0 - (i + 0.5) / n, r = std::sqrt(1.0 - z * z), phi = i * kGoldenAngle;
        // Lengths are spread too (7 is prime to every multiple of 16): occlusion fades with
        // distance and does not end in a visible circle.
        const double reach = 0.3 + 0.7 * std::sqrt((double((i * 7) % n) + 0.5) / n);
        rays[std::size_t(i)] = {{float(r * std::cos(phi)), float(z), float(r * std::sin(phi))}, float(reach)};
    }
    return rays;
}

} // namespace porthole
