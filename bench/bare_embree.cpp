#include "bare_embree.h"

#include <embree3/rtcore.h>

#include <algorithm>

#include "porthole/base/parallel.h"
#include "porthole/trace/packet.h"

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
    alignas(64) int valid[kLanes];
    std::fill(valid, valid + kLanes, -1);
    RayHit16 packet;
    float depth_per_t[kLanes];
    for (int y0 = 0; y0 + 4 <= view.height; y0 += 4)
        for (int x0 = 0; x0 + 4 <= view.width; x0 += 4) {
            // The library's own rays: a slower way to make them would flatter it.
            set_block_rays(packet, depth_per_t, view, x0, y0, view.window(), 0xFFFFFFFFu);
            RTCIntersectContext context;
            rtcInitIntersectContext(&context);
            context.flags = RTC_INTERSECT_CONTEXT_FLAG_COHERENT;
            rtcIntersect16(valid, state_->top, &context, reinterpret_cast<RTCRayHit16*>(&packet));
            for (int i = 0; i < kLanes; ++i) hits += packet.geometry[i] != RTC_INVALID_GEOMETRY_ID;
        }
    return hits;
}

} // namespace porthole::bench
