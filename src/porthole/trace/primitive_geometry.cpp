#include "porthole/trace/primitive_geometry.h"

#include <vector>

namespace porthole {

namespace {

const PrimitiveGeometry& data_of(const void* user) { return *static_cast<const PrimitiveGeometry*>(user); }

void bounds_of(const RTCBoundsFunctionArguments* args) {
    const Bounds3f& box = data_of(args->geometryUserPtr).mesh->bounds;
    // Instances turn rays in float, so that one may seem to pass a surface that it grazes.
    const float slack = 1e-6f * (box.diagonal() + length(box.lower) + length(box.upper));
    RTCBounds& out = *args->bounds_o;
    out.lower_x = box.lower.x - slack, out.lower_y = box.lower.y - slack, out.lower_z = box.lower.z - slack;
    out.upper_x = box.upper.x + slack, out.upper_y = box.upper.y + slack, out.upper_z = box.upper.z + slack;
}

/// `normal` moved to the side that a crossing has, where rounding put it on the other one.
Vec3f on_side(Vec3f normal, Vec3f direction, bool entering) {
    const float facing = dot(normal, direction), d2 = dot(direction, direction);
    if ((facing < 0) == entering && facing != 0) return normal;
    const float least = 1e-6f * std::sqrt(d2);
    return normal - direction * ((facing + (entering ? 1.0f : -1.0f) * (std::abs(facing) + least)) / d2);
}

RTCHit hit_of(const PrimitiveTree& tree, const RTCRay& ray, const PrimitiveCrossing& crossing, unsigned geometry,
              unsigned instance) {
    const Vec3f origin{ray.org_x, ray.org_y, ray.org_z}, direction{ray.dir_x, ray.dir_y, ray.dir_z};
    const Vec2f uv = surface_coordinates(tree, crossing.surface, Vec3d(origin) + Vec3d(direction) * crossing.t);
    const Vec3f normal = on_side(Vec3f(surface_point(tree, crossing.surface, uv).normal), direction, crossing.entering);
    RTCHit hit;
    hit.Ng_x = normal.x, hit.Ng_y = normal.y, hit.Ng_z = normal.z;
    hit.u = uv.x, hit.v = uv.y;
    hit.primID = crossing.surface, hit.geomID = geometry, hit.instID[0] = instance;
    return hit;
}

/// The nearest crossing of `ray` that `filter` accepts; its t becomes the ray's tfar.
/// @return whether there is one.
bool find_hit(const PrimitiveGeometry& data, RTCFilterFunctionN filter, RTCIntersectContext* context, unsigned geometry,
              RTCRay& ray, RTCHit& hit) {
    thread_local std::vector<PrimitiveCrossing> crossings; // only its memory outlives the call
    const PrimitiveTree& tree = data.mesh->primitives;
    const float end = ray.tfar;
    // A little more than the interval, as t is rounded to float.
    const double slack = 1e-6 * (std::abs(double(ray.tnear)) + (end < kInfinity ? std::abs(double(end)) : 0.0));
    find_crossings(tree, Vec3d{ray.org_x, ray.org_y, ray.org_z}, Vec3d{ray.dir_x, ray.dir_y, ray.dir_z},
                   double(ray.tnear) - slack, double(end) + slack, crossings);
    for (const PrimitiveCrossing& crossing : crossings) {
        const auto t = float(crossing.t);
        if (!(t > ray.tnear)) continue;
        if (!(t <= end)) break;
        hit = hit_of(tree, ray, crossing, geometry, context->instID[0]);
        ray.tfar = t;
        int valid = -1;
        if (filter) {
            const RTCFilterFunctionNArguments args{
                &valid, data.filter_data, context, reinterpret_cast<RTCRayN*>(&ray), reinterpret_cast<RTCHitN*>(&hit),
                1};
            filter(&args);
        }
        if (valid) return true;
    }
    ray.tfar = end;
    return false;
}

void intersect_primitives(const RTCIntersectFunctionNArguments* args) {
    const PrimitiveGeometry& data = data_of(args->geometryUserPtr);
    RTCRayN* rays = RTCRayHitN_RayN(args->rayhit, args->N);
    for (unsigned i = 0; i < args->N; ++i) {
        if (!args->valid[i]) continue;
        RTCRay ray = rtcGetRayFromRayN(rays, args->N, i);
        RTCHit hit;
        if (!find_hit(data, data.intersect_filter, args->context, args->geomID, ray, hit)) continue;
        RTCRayN_tfar(rays, args->N, i) = ray.tfar;
        rtcCopyHitToHitN(RTCRayHitN_HitN(args->rayhit, args->N), &hit, args->N, i);
    }
}

void occlude_primitives(const RTCOccludedFunctionNArguments* args) {
    const PrimitiveGeometry& data = data_of(args->geometryUserPtr);
    for (unsigned i = 0; i < args->N; ++i) {
        if (!args->valid[i]) continue;
        RTCRay ray = rtcGetRayFromRayN(args->ray, args->N, i);
        RTCHit hit;
        if (find_hit(data, data.occluded_filter, args->context, args->geomID, ray, hit))
            RTCRayN_tfar(args->ray, args->N, i) = -kInfinity;
    }
}

} // namespace

void set_primitives(RTCGeometry geometry, const PrimitiveGeometry& data) {
    rtcSetGeometryUserPrimitiveCount(geometry, 1);
    // Embree hands it back as it is; nothing writes to it.
    rtcSetGeometryUserData(geometry, const_cast<PrimitiveGeometry*>(&data));
    rtcSetGeometryBoundsFunction(geometry, bounds_of, nullptr);
    rtcSetGeometryIntersectFunction(geometry, intersect_primitives);
    rtcSetGeometryOccludedFunction(geometry, occlude_primitives);
}

} // namespace porthole
