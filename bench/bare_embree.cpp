#include "bare_embree.h"

#include <embree3/rtcore.h>

#include <limits>

#include "porthole/base/parallel.h"

namespace porthole::bench {

struct BareEmbree::State {
    RTCDevice device = nullptr;
    RTCScene top = nullptr;
    std::vector<RTCScene> meshes;
};

BareEmbree::BareEmbree(const Scene& scene) : state_(std::make_unique<State>()) {
    state_->device = rtcNewDevice("isa=avx2");
    for (const Mesh& mesh : scene.meshes) {
        const RTCGeometry g = rtcNewGeometry(state_->device, RTC_GEOMETRY_TYPE_TRIANGLE);
        rtcSetSharedGeometryBuffer(g, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3, mesh.positions.data(), 0,
                                   sizeof(Vec3f), mesh.positions.size());
        rtcSetSharedGeometryBuffer(g, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3, mesh.triangles.data(), 0,
                                   sizeof(Vec3u), mesh.triangles.size());
        rtcCommitGeometry(g);
        const RTCScene s = rtcNewScene(state_->device);
        rtcSetSceneFlags(s, RTC_SCENE_FLAG_ROBUST);
        rtcAttachGeometry(s, g);
        rtcReleaseGeometry(g);
        rtcCommitScene(s);
        state_->meshes.push_back(s);
    }
    state_->top = rtcNewScene(state_->device);
    rtcSetSceneFlags(state_->top, RTC_SCENE_FLAG_ROBUST);
    for (const Part& part : scene.parts) {
        const RTCGeometry g = rtcNewGeometry(state_->device, RTC_GEOMETRY_TYPE_INSTANCE);
        rtcSetGeometryInstancedScene(g, state_->meshes[part.mesh]);
        const Affine3f a(part.world_from_mesh);
        const float columns[12] = {a.x.x, a.x.y, a.x.z, a.y.x, a.y.y, a.y.z, a.z.x, a.z.y, a.z.z, a.p.x, a.p.y, a.p.z};
        rtcSetGeometryTransform(g, 0, RTC_FORMAT_FLOAT3X4_COLUMN_MAJOR, columns);
        rtcCommitGeometry(g);
        rtcAttachGeometry(state_->top, g);
        rtcReleaseGeometry(g);
    }
    rtcCommitScene(state_->top);
}

BareEmbree::~BareEmbree() {
    rtcReleaseScene(state_->top);
    for (const RTCScene s : state_->meshes) rtcReleaseScene(s);
    rtcReleaseDevice(state_->device);
}

std::int64_t BareEmbree::trace(const View& view) const {
    const FlushDenormals flush;
    std::int64_t hits = 0;
    alignas(64) int valid[16];
    std::fill(valid, valid + 16, -1);
    RTCRayHit16 packet;
    for (int y0 = 0; y0 + 4 <= view.height; y0 += 4)
        for (int x0 = 0; x0 + 4 <= view.width; x0 += 4) {
            for (int i = 0; i < 16; ++i) {
                const Ray r = view.ray(float(x0 + i % 4) + 0.5f, float(y0 + i / 4) + 0.5f);
                packet.ray.org_x[i] = r.origin.x, packet.ray.org_y[i] = r.origin.y, packet.ray.org_z[i] = r.origin.z;
                packet.ray.dir_x[i] = r.direction.x, packet.ray.dir_y[i] = r.direction.y;
                packet.ray.dir_z[i] = r.direction.z;
                packet.ray.tnear[i] = 0, packet.ray.tfar[i] = std::numeric_limits<float>::infinity();
                packet.ray.time[i] = 0, packet.ray.mask[i] = 0xFFFFFFFFu, packet.ray.id[i] = 0, packet.ray.flags[i] = 0;
                packet.hit.geomID[i] = packet.hit.instID[0][i] = RTC_INVALID_GEOMETRY_ID;
            }
            RTCIntersectContext context;
            rtcInitIntersectContext(&context);
            context.flags = RTC_INTERSECT_CONTEXT_FLAG_COHERENT;
            rtcIntersect16(valid, state_->top, &context, &packet);
            for (int i = 0; i < 16; ++i) hits += packet.hit.geomID[i] != RTC_INVALID_GEOMETRY_ID;
        }
    return hits;
}

} // namespace porthole::bench
