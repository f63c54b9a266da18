#include "porthole/base/cut.h"

#include <cmath>

namespace porthole {

float Cut::distance_at(float x, float y) const {
    const Rect w = distance.window();
    // Pixel centres are the grid points.
    const float gx = x - 0.5f, gy = y - 0.5f;
    const float fx = std::floor(gx), fy = std::floor(gy);
    if (!(fx >= float(w.x0)) || !(fy >= float(w.y0)) || !(fx < float(w.x1 - 1)) || !(fy < float(w.y1 - 1))) {
        // On the last row or column only the pixel itself is known.
        const bool inside = x >= float(w.x0) && y >= float(w.y0) && x < float(w.x1) && y < float(w.y1);
        return inside ? distance(int(std::floor(x)), int(std::floor(y))) : 1.0f;
    }
    const int ix = int(fx), iy = int(fy);
    const float ax = gx - fx, ay = gy - fy;
    // At a grid point this is that pixel's value exactly: the other weights are zero.
    const float top = distance(ix, iy) * (1 - ax) + distance(ix + 1, iy) * ax;
    const float bottom = distance(ix, iy + 1) * (1 - ax) + distance(ix + 1, iy + 1) * ax;
    return top * (1 - ay) + bottom * ay;
}

float Cut::depth_at(float x, float y, CutRole which) const {
    if (which == CutRole::fixed) return -kInfinity;
    const int ix = int(std::floor(x)), iy = int(std::floor(y));
    const Image<float>& depths = which == CutRole::cut_set ? cut_depth : loose_depth;
    const float own = depths.at_or(ix, iy, -kInfinity);
    if (distance.at_or(ix, iy, 1.0f) <= 0) return own;
    // A sample inside the rim whose pixel's centre is outside: the neighbour across the rim
    // that is nearest to the sample knows the depth.
    float best = kInfinity, depth = own;
    for (int dy = -1; dy <= 1; ++dy)
        for (int dx = -1; dx <= 1; ++dx) {
            if (distance.at_or(ix + dx, iy + dy, 1.0f) > 0) continue;
            const float ex = float(ix + dx) + 0.5f - x, ey = float(iy + dy) + 0.5f - y;
            const float d2 = ex * ex + ey * ey;
            if (d2 < best) best = d2, depth = depths(ix + dx, iy + dy);
        }
    return depth;
}

bool Cut::removes(Vec3f world, PartId part) const {
    const CutRole which = role[porthole::index(part)];
    if (which == CutRole::fixed || empty()) return false;
    const PixelPoint p = view.project(world);
    if (!(p.depth > 0) && !view.orthographic) return false;
    if (!(std::abs(p.x) < 1e8f) || !(std::abs(p.y) < 1e8f)) return false;
    if (distance_at(p.x, p.y) > 0) return false;
    return p.depth < depth_at(p.x, p.y, which);
}

} // namespace porthole
