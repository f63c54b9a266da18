// A camera with its raster: rays of pixels and pixels of points. A plain value that every
// stage shares; scene/camera.h makes one from a model and the user's options.
#pragma once

#include "porthole/base/image.h"
#include "porthole/base/math.h"

namespace porthole {

struct Ray {
    Vec3f origin;
    Vec3f direction;       ///< unit length
    float depth_per_t = 1; ///< depth (metres along camera -z) of a point at t: t * depth_per_t
};

/// A point on the picture: continuous pixel coordinates (pixel centres at .5) and depth.
struct PixelPoint {
    float x = 0, y = 0;
    float depth = 0; ///< metres along camera -z; not positive: behind the eye
};

struct View {
    Affine3f world_from_camera; ///< orthonormal; the camera looks along its own -z, y up
    bool orthographic = false;
    float half_height = 0.5f; ///< perspective: tan(fovy/2); orthographic: half the picture's height, metres
    std::int32_t width = 1920, height = 1080;

    [[nodiscard]] Rect window() const { return {0, 0, width, height}; }
    [[nodiscard]] Vec3f eye() const { return world_from_camera.p; }
    [[nodiscard]] Vec3f forward() const { return -world_from_camera.z; }

    /// Size of a pixel at depth 1 m (perspective) or anywhere (orthographic), metres.
    [[nodiscard]] float pixel_scale() const { return 2.0f * half_height / float(height); }
    /// Size of a pixel at `depth`, metres.
    [[nodiscard]] float pixel_size(float depth) const { return orthographic ? pixel_scale() : pixel_scale() * depth; }

    /// The ray through continuous pixel position (x, y), inside the picture or not. The same
    /// bits for the same position, whatever window is being traced.
    [[nodiscard]] Ray ray(float x, float y) const {
        const float s = pixel_scale();
        const float cx = (x - 0.5f * float(width)) * s;
        const float cy = (0.5f * float(height) - y) * s;
        if (orthographic) return {world_from_camera.point({cx, cy, 0.0f}), forward(), 1.0f};
        const float inv = 1.0f / std::sqrt(cx * cx + cy * cy + 1.0f);
        return {eye(), world_from_camera.vector({cx * inv, cy * inv, -inv}), inv};
    }

    [[nodiscard]] PixelPoint project(Vec3f world) const {
        const Vec3f d = world - world_from_camera.p;
        const float depth = -dot(d, world_from_camera.z);
        const float scale = 1.0f / pixel_size(orthographic ? 1.0f : depth);
        return {0.5f * float(width) + dot(d, world_from_camera.x) * scale,
                0.5f * float(height) - dot(d, world_from_camera.y) * scale, depth};
    }
};

} // namespace porthole
