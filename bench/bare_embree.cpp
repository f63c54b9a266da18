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

struct FlatEmbree::State {
    RTCDevice device = nullptr;
    RTCScene scene = nullptr;
};

FlatEmbree::FlatEmbree(const Scene& scene, std::span<const PartId> chosen) : state_(std::make_unique<State>()) {
    state_->device = rtcNewDevice("isa=avx2");
    state_->scene = rtcNewScene(state_->device);
    rtcSetSceneFlags(state_->scene, RTC_SCENE_FLAG_ROBUST);
    for (const PartId id : all_parts(scene)) {
        const Mesh& mesh = scene.mesh_of(id);
        const Affine3f place(scene.parts[index(id)].world_from_mesh);
        const RTCGeometry g = rtcNewGeometry(state_->device, RTC_GEOMETRY_TYPE_TRIANGLE);
        auto* positions = static_cast<Vec3f*>(rtcSetNewGeometryBuffer(g, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3,
                                                                      sizeof(Vec3f), mesh.positions.size()));
        std::transform(mesh.positions.begin(), mesh.positions.end(), positions,
                       [&](Vec3f p) { return place.point(p); });
        rtcSetSharedGeometryBuffer(g, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3, mesh.triangles.data(), 0,
                                   sizeof(Vec3u), mesh.triangles.size());
        rtcSetGeometryMask(g, std::find(chosen.begin(), chosen.end(), id) != chosen.end() ? kMaskFixed : kMaskCutSet);
        rtcCommitGeometry(g);
        rtcAttachGeometryByID(state_->scene, g, index(id));
        rtcReleaseGeometry(g);
    }
    rtcCommitScene(state_->scene);
}

FlatEmbree::~FlatEmbree() {
    rtcReleaseScene(state_->scene);
    rtcReleaseDevice(state_->device);
}

std::vector<PartId> FlatEmbree::ids_at(const View& view, std::span<const Vec2i> pixels) const {
    const FlushDenormals flush;
    std::vector<PartId> ids(pixels.size(), kNoPart);
    RayHit16 packet;
    float x[kLanes] = {}, y[kLanes] = {}, depth_per_t[kLanes];
    alignas(64) int valid[kLanes];
    for (std::size_t first = 0; first < pixels.size(); first += kLanes) {
        const int n = int(std::min<std::size_t>(kLanes, pixels.size() - first));
        for (int i = 0; i < kLanes; ++i) {
            valid[i] = i < n ? -1 : 0;
            if (i >= n) continue;
            x[i] = float(pixels[first + std::size_t(i)].x) + 0.5f;
            y[i] = float(pixels[first + std::size_t(i)].y) + 0.5f;
        }
        set_rays(packet, depth_per_t, view, x, y, kMaskFixed);
        RTCIntersectContext context;
        rtcInitIntersectContext(&context);
        rtcIntersect16(valid, state_->scene, &context, reinterpret_cast<RTCRayHit16*>(&packet));
        for (int i = 0; i < n; ++i)
            if (packet.geometry[i] != RTC_INVALID_GEOMETRY_ID) ids[first + std::size_t(i)] = PartId{packet.geometry[i]};
    }
    return ids;
}

} // namespace porthole::bench
