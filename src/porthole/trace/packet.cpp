#include "porthole/trace/packet.h"

#include <immintrin.h>

#include <algorithm>

namespace porthole {

namespace {

constexpr int kWide = 8; ///< lanes of a vector register

__m256 all(float v) { return _mm256_set1_ps(v); }

/// x * a + y * b + z * c, in the order in which Affine3f::vector adds.
template <typename A, typename B, typename C> __m256 sum(float x, A a, float y, B b, float z, C c) {
    return all(x) * a + all(y) * b + all(z) * c;
}

} // namespace

void set_rays(RayHit16& rays, float (&depth_per_t)[kLanes], const View& view, const float (&x)[kLanes],
              const float (&y)[kLanes], std::uint32_t mask) {
    const Affine3f& a = view.world_from_camera;
    const __m256 scale = all(view.pixel_scale());
    const __m256 middle_x = all(0.5f * float(view.width)), middle_y = all(0.5f * float(view.height));
    for (int i = 0; i < kLanes; i += kWide) {
        const __m256 cx = (_mm256_loadu_ps(x + i) - middle_x) * scale;
        const __m256 cy = (middle_y - _mm256_loadu_ps(y + i)) * scale;
        __m256 org_x = all(a.p.x), org_y = all(a.p.y), org_z = all(a.p.z), dir_x, dir_y, dir_z, depth = all(1.0f);
        if (view.orthographic) {
            const __m256 zero = all(0.0f);
            org_x = sum(a.x.x, cx, a.y.x, cy, a.z.x, zero) + org_x;
            org_y = sum(a.x.y, cx, a.y.y, cy, a.z.y, zero) + org_y;
            org_z = sum(a.x.z, cx, a.y.z, cy, a.z.z, zero) + org_z;
            dir_x = all(-a.z.x), dir_y = all(-a.z.y), dir_z = all(-a.z.z);
        } else {
            depth = all(1.0f) / _mm256_sqrt_ps(cx * cx + cy * cy + all(1.0f));
            const __m256 vx = cx * depth, vy = cy * depth, vz = -depth;
            dir_x = sum(a.x.x, vx, a.y.x, vy, a.z.x, vz);
            dir_y = sum(a.x.y, vx, a.y.y, vy, a.z.y, vz);
            dir_z = sum(a.x.z, vx, a.y.z, vy, a.z.z, vz);
        }
        _mm256_store_ps(rays.org_x + i, org_x), _mm256_store_ps(rays.org_y + i, org_y);
        _mm256_store_ps(rays.org_z + i, org_z);
        _mm256_store_ps(rays.dir_x + i, dir_x), _mm256_store_ps(rays.dir_y + i, dir_y);
        _mm256_store_ps(rays.dir_z + i, dir_z);
        _mm256_storeu_ps(depth_per_t + i, depth);
    }
    std::fill(rays.tnear, rays.tnear + kLanes, 0.0f);
    std::fill(rays.tfar, rays.tfar + kLanes, kInfinity);
    std::fill(rays.time, rays.time + kLanes, 0.0f);
    std::fill(rays.mask, rays.mask + kLanes, mask);
    for (int i = 0; i < kLanes; ++i) rays.id[i] = std::uint32_t(i);
    std::fill(rays.flags, rays.flags + kLanes, 0u);
    std::fill(rays.geometry, rays.geometry + kLanes, 0xFFFFFFFFu);
    std::fill(rays.instance, rays.instance + kLanes, 0xFFFFFFFFu);
}

int set_block_rays(RayHit16& rays, float (&depth_per_t)[kLanes], const View& view, int x0, int y0, Rect window,
                   std::uint32_t mask) {
    float x[kLanes], y[kLanes];
    for (int i = 0; i < kLanes; ++i) {
        x[i] = float(x0 + (i & 3)) + 0.5f;
        y[i] = float(y0 + (i >> 2)) + 0.5f;
    }
    set_rays(rays, depth_per_t, view, x, y, mask);
    if (window.contains(x0, y0) && window.contains(x0 + 3, y0 + 3)) return kLanes;
    int active = 0;
    for (int i = 0; i < kLanes; ++i) {
        if (window.contains(x0 + (i & 3), y0 + (i >> 2)))
            ++active;
        else
            rays.clear(i);
    }
    return active;
}

} // namespace porthole
