#include "porthole/trace/bvh.h"

#include <embree3/rtcore.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cstddef>
#include <cstring>
#include <numeric>
#include <string>
#include <tuple>
#include <utility>

#include "porthole/scene/texture.h"
#include "porthole/trace/primitive_geometry.h"

namespace porthole {

static_assert(sizeof(RayHit16) == sizeof(RTCRayHit16));
static_assert(offsetof(RayHit16, tfar) == offsetof(RTCRayHit16, ray.tfar));
static_assert(offsetof(RayHit16, ng_x) == offsetof(RTCRayHit16, hit.Ng_x));
static_assert(offsetof(RayHit16, triangle) == offsetof(RTCRayHit16, hit.primID));
static_assert(offsetof(RayHit16, instance) == offsetof(RTCRayHit16, hit.instID));

namespace {

/// What a mesh's surface does to a ray that meets it.
enum class SurfaceKind : std::uint8_t { opaque, holed, tinted };

SurfaceKind surface_kind(const Scene& scene, const Mesh& mesh) {
    SurfaceKind kind = SurfaceKind::opaque;
    for (const Submesh& s : mesh.submeshes) {
        const Material& m = scene.materials[s.material];
        if (m.alpha_mode == AlphaMode::blend || m.transmission > 0)
            kind = SurfaceKind::tinted;
        else if (m.alpha_mode == AlphaMode::mask && kind == SurfaceKind::opaque)
            kind = SurfaceKind::holed;
    }
    return kind;
}

std::uint64_t mixed(std::uint64_t h, std::uint64_t v) {
    h ^= v;
    h *= 0x9E3779B97F4A7C15ull;
    return h ^ (h >> 29);
}

std::uint64_t hash_bytes(std::uint64_t h, const void* data, std::size_t n) {
    const auto* bytes = static_cast<const std::byte*>(data);
    const auto word = [&](std::size_t at) {
        std::uint64_t v;
        std::memcpy(&v, bytes + at, 8);
        return v;
    };
    std::size_t i = 0;
    // Four chains side by side: one alone waits for its multiplications.
    std::uint64_t lane[4] = {h, h + 1, h + 2, h + 3};
    for (; i + 32 <= n; i += 32)
        for (std::size_t k = 0; k < 4; ++k) lane[k] = mixed(lane[k], word(i + 8 * k));
    for (const std::uint64_t l : lane) h = mixed(h, l);
    for (; i + 8 <= n; i += 8) h = mixed(h, word(i));
    std::uint64_t tail = 0;
    if (i < n) std::memcpy(&tail, bytes + i, n - i); // an empty mesh has no bytes to point at
    return mixed(h, tail ^ (std::uint64_t(n) << 32));
}

/// Geometry alone: two meshes with the same shape are the same here.
std::uint64_t shape_hash(const Mesh& mesh) {
    std::uint64_t h = hash_bytes(1, mesh.positions.data(), mesh.positions.size() * sizeof(Vec3f));
    for (const PrimitiveNode& node : mesh.primitives.nodes)
        h = mixed(h, std::uint64_t(node.operation) << 32 | node.end);
    for (const PrimitiveLeaf& leaf : mesh.primitives.leaves) {
        h = mixed(mixed(h, std::uint64_t(leaf.kind)), std::bit_cast<std::uint64_t>(leaf.ratio));
        h = hash_bytes(h, &leaf.mesh_from_leaf, sizeof leaf.mesh_from_leaf);
    }
    return hash_bytes(h, mesh.triangles.data(), mesh.triangles.size() * sizeof(Vec3u));
}

template <typename T, void (*release)(T)> struct Handle {
    T value = nullptr;
    Handle() = default;
    explicit Handle(T v) : value(v) {}
    Handle(Handle&& o) noexcept : value(std::exchange(o.value, nullptr)) {}
    Handle& operator=(Handle&& o) noexcept {
        std::swap(value, o.value);
        return *this;
    }
    ~Handle() {
        if (value) release(value);
    }
};
using DeviceHandle = Handle<RTCDevice, rtcReleaseDevice>;
using SceneHandle = Handle<RTCScene, rtcReleaseScene>;
using GeometryHandle = Handle<RTCGeometry, rtcReleaseGeometry>;

void check_device(RTCDevice device) {
    const RTCError e = rtcGetDeviceError(device);
    if (e == RTC_ERROR_NONE) return;
    if (e == RTC_ERROR_OUT_OF_MEMORY)
        throw Error(ErrorKind::limit, "E0902", "build", "memory ran out while the ray tracing hierarchy was built");
    throw Error(ErrorKind::bug, "E0002", "build", "Embree reports error " + std::to_string(int(e)));
}

} // namespace

struct MeshBvhs::State {
    const Scene* scene = nullptr;
    DeviceHandle device;
    std::vector<SceneHandle> meshes;
    std::vector<SurfaceKind> kinds;
    std::vector<PrimitiveGeometry> primitives; ///< by mesh
    std::vector<std::uint64_t> hashes;
};

struct Bvh::State {
    const MeshBvhs::State* meshes = nullptr;
    SceneHandle top;
    std::vector<PartId> part_of_instance;
    std::vector<std::uint8_t> held; ///< by part id
    SceneHandle cap_scene;
    const CapMesh* caps = nullptr;
};

namespace {

/// What a surface leaves of the light along one ray.
struct Tinted {
    int lane;
    Vec3f tint;
    friend bool operator<(const Tinted& a, const Tinted& b) {
        return std::tie(a.lane, a.tint.x, a.tint.y, a.tint.z) < std::tie(b.lane, b.tint.x, b.tint.y, b.tint.z);
    }
};

/// An Embree context that carries what the filters need.
struct QueryContext {
    RTCIntersectContext rtc;
    const Bvh::State* bvh = nullptr;
    const Cut* cut = nullptr;
    std::vector<Tinted>* tints = nullptr;
    bool tinted_blocks = false; ///< blended and transmissive surfaces stop rays, as they do for ids
    detail::VisitCrossing visit_call = nullptr;
    void* visit = nullptr;
    float org_x[kLanes], org_y[kLanes], org_z[kLanes]; ///< world rays: Embree transforms its own in place
    float dir_x[kLanes], dir_y[kLanes], dir_z[kLanes];

    void keep_world_rays(const RayHit16& rays) {
        std::memcpy(org_x, rays.org_x, sizeof org_x);
        std::memcpy(org_y, rays.org_y, sizeof org_y);
        std::memcpy(org_z, rays.org_z, sizeof org_z);
        std::memcpy(dir_x, rays.dir_x, sizeof dir_x);
        std::memcpy(dir_y, rays.dir_y, sizeof dir_y);
        std::memcpy(dir_z, rays.dir_z, sizeof dir_z);
    }
    [[nodiscard]] Vec3f world(int lane, float t) const {
        return Vec3f{org_x[lane], org_y[lane], org_z[lane]} + Vec3f{dir_x[lane], dir_y[lane], dir_z[lane]} * t;
    }
};

/// One candidate hit inside a filter callback.
struct Candidate {
    PartId part;
    int lane;
    float t, u, v;
    std::uint32_t triangle;
};

Candidate candidate(const RTCFilterFunctionNArguments* args, const QueryContext& query, unsigned i) {
    return {query.bvh->part_of_instance[args->context->instID[0]],
            int(RTCRayN_id(args->ray, args->N, i)),
            RTCRayN_tfar(args->ray, args->N, i),
            RTCHitN_u(args->hit, args->N, i),
            RTCHitN_v(args->hit, args->N, i),
            RTCHitN_primID(args->hit, args->N, i)};
}

bool is_texel_hole(const Scene& scene, const Candidate& c) {
    const Mesh& mesh = scene.mesh_of(c.part);
    const Material& material = scene.materials[mesh.material_of(c.triangle)];
    return material.alpha_mode == AlphaMode::mask &&
           base_alpha(scene, mesh, c.triangle, c.u, c.v) < material.alpha_cutoff;
}

/// For nearest hits of meshes with alpha-masked materials.
void pass_texel_holes(const RTCFilterFunctionNArguments* args) {
    const auto& query = *reinterpret_cast<const QueryContext*>(args->context);
    const Scene& scene = *query.bvh->meshes->scene;
    for (unsigned i = 0; i < args->N; ++i)
        if (args->valid[i] && is_texel_hole(scene, candidate(args, query, i))) args->valid[i] = 0;
}

/// For occlusion and crossings; on every mesh.
void occlusion_filter(const RTCFilterFunctionNArguments* args) {
    const auto& query = *reinterpret_cast<const QueryContext*>(args->context);
    const auto kind = static_cast<SurfaceKind>(reinterpret_cast<std::uintptr_t>(args->geometryUserPtr));
    if (kind == SurfaceKind::opaque && !query.cut && !query.visit_call) return;
    const Scene& scene = *query.bvh->meshes->scene;
    for (unsigned i = 0; i < args->N; ++i) {
        if (!args->valid[i]) continue;
        const Candidate c = candidate(args, query, i);
        if (kind != SurfaceKind::opaque && is_texel_hole(scene, c)) {
            args->valid[i] = 0;
            continue;
        }
        if (query.visit_call) {
            // Both in mesh coordinates: a mirrored placement does not matter.
            const float facing = RTCHitN_Ng_x(args->hit, args->N, i) * RTCRayN_dir_x(args->ray, args->N, i) +
                                 RTCHitN_Ng_y(args->hit, args->N, i) * RTCRayN_dir_y(args->ray, args->N, i) +
                                 RTCHitN_Ng_z(args->hit, args->N, i) * RTCRayN_dir_z(args->ray, args->N, i);
            query.visit_call(query.visit, {c.lane, c.part, c.t, c.triangle, c.u, c.v, facing < 0});
            args->valid[i] = 0;
            continue;
        }
        if (query.cut && query.cut->removes(query.world(c.lane, c.t), c.part)) {
            args->valid[i] = 0;
            continue;
        }
        if (kind == SurfaceKind::tinted && !query.tinted_blocks) {
            const Mesh& mesh = scene.mesh_of(c.part);
            const Material& material = scene.materials[mesh.material_of(c.triangle)];
            if (material.alpha_mode != AlphaMode::blend && !(material.transmission > 0)) continue;
            if (query.tints) query.tints->push_back({c.lane, transmission_tint(scene, mesh, c.triangle, c.u, c.v)});
            args->valid[i] = 0;
        }
    }
}

QueryContext make_context(const Bvh& bvh, Coherence coherence) {
    QueryContext query;
    rtcInitIntersectContext(&query.rtc);
    query.rtc.flags =
        coherence == Coherence::coherent ? RTC_INTERSECT_CONTEXT_FLAG_COHERENT : RTC_INTERSECT_CONTEXT_FLAG_INCOHERENT;
    query.bvh = &bvh.state();
    return query;
}

/// Lanes to trace, as Embree wants them. False when there is none.
bool active_lanes(const RayHit16& rays, int (&valid)[kLanes]) {
    int any = 0;
    for (int i = 0; i < kLanes; ++i) any |= valid[i] = rays.active(i) ? -1 : 0;
    return any != 0;
}

} // namespace

MeshBvhs::MeshBvhs(std::unique_ptr<State> state) : state_(std::move(state)) {}
MeshBvhs::MeshBvhs(MeshBvhs&&) noexcept = default;
MeshBvhs& MeshBvhs::operator=(MeshBvhs&&) noexcept = default;
MeshBvhs::~MeshBvhs() = default;
const Scene& MeshBvhs::scene() const { return *state_->scene; }

MeshBvhs build_mesh_bvhs(const Scene& scene, const BvhParams& params, const Control& control) {
    auto state = std::make_unique<MeshBvhs::State>();
    state->scene = &scene;
    const int threads = thread_count(control);
    std::string config = "threads=" + std::to_string(threads);
    if (params.isa != "native") config += ",isa=" + params.isa;
    state->device = DeviceHandle(rtcNewDevice(config.c_str()));
    if (!state->device.value) {
        if (rtcGetDeviceError(nullptr) == RTC_ERROR_UNSUPPORTED_CPU)
            throw Error(ErrorKind::usage, "E0105", "--isa",
                        "this processor cannot run '" + params.isa + "'; try --isa native");
        throw Error(ErrorKind::limit, "E0902", "build", "the ray tracer could not start: too little memory or threads");
    }
    state->meshes.resize(scene.meshes.size());
    state->kinds.resize(scene.meshes.size());
    state->primitives.resize(scene.meshes.size());
    state->hashes.resize(scene.meshes.size());

    // From here on memory decides: a large model is to stay within 100 bytes a triangle in all.
    constexpr std::size_t kCompactFrom = 2'000'000;
    std::size_t triangles = 0;
    for (const Mesh& mesh : scene.meshes) triangles += mesh.triangles.size();
    const bool compact =
        params.layout == BvhLayout::automatic ? triangles >= kCompactFrom : params.layout == BvhLayout::compact;
    const auto scene_of = [&](RTCGeometry geometry) {
        const RTCDevice device = state->device.value;
        rtcCommitGeometry(geometry);
        SceneHandle built(rtcNewScene(device));
        rtcSetSceneFlags(built.value, compact ? RTC_SCENE_FLAG_ROBUST | RTC_SCENE_FLAG_COMPACT : RTC_SCENE_FLAG_ROBUST);
        rtcAttachGeometryByID(built.value, geometry, 0);
        rtcCommitScene(built.value);
        check_device(device);
        return built;
    };
    const auto build = [&](std::size_t i) {
        const Mesh& mesh = scene.meshes[i];
        const RTCDevice device = state->device.value;
        state->kinds[i] = surface_kind(scene, mesh);
        state->hashes[i] = shape_hash(mesh);

        void* const kind = reinterpret_cast<void*>(std::uintptr_t(state->kinds[i]));
        const RTCFilterFunctionN nearest_filter = state->kinds[i] != SurfaceKind::opaque ? pass_texel_holes : nullptr;
        if (mesh.triangles.empty() && !mesh.empty()) {
            const GeometryHandle geometry(rtcNewGeometry(device, RTC_GEOMETRY_TYPE_USER));
            state->primitives[i] = {&mesh, kind, nearest_filter, occlusion_filter};
            set_primitives(geometry.value, state->primitives[i]);
            state->meshes[i] = scene_of(geometry.value);
            return;
        }

        const GeometryHandle geometry(rtcNewGeometry(device, RTC_GEOMETRY_TYPE_TRIANGLE));
        // Embree reads 16 bytes at the last vertex. A copied Scene has lost the room for that.
        if (const std::size_t n = mesh.positions.size(); mesh.positions.capacity() > n) {
            rtcSetSharedGeometryBuffer(geometry.value, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3,
                                       mesh.positions.data(), 0, sizeof(Vec3f), n);
        } else if (void* copy = rtcSetNewGeometryBuffer(geometry.value, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3,
                                                        sizeof(Vec3f), n)) {
            if (n > 0) std::memcpy(copy, mesh.positions.data(), n * sizeof(Vec3f));
        }
        rtcSetSharedGeometryBuffer(geometry.value, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3, mesh.triangles.data(), 0,
                                   sizeof(Vec3u), mesh.triangles.size());
        rtcSetGeometryUserData(geometry.value, kind);
        rtcSetGeometryOccludedFilterFunction(geometry.value, occlusion_filter);
        rtcSetGeometryIntersectFilterFunction(geometry.value, nearest_filter);
        state->meshes[i] = scene_of(geometry.value);
    };

    // Large meshes one after the other, Embree's threads inside each; small ones side by side.
    constexpr std::size_t kLarge = 100'000;
    std::vector<std::size_t> small;
    for (std::size_t i = 0; i < scene.meshes.size(); ++i) {
        if (control.stop.stop_requested()) throw Cancelled{};
        if (scene.meshes[i].triangles.size() >= kLarge)
            build(i);
        else
            small.push_back(i);
    }
    parallel_for(small.size(), control, [&](std::size_t k) { build(small[k]); });
    return MeshBvhs(std::move(state));
}

Bvh::Bvh(std::unique_ptr<State> state) : state_(std::move(state)) {}
Bvh::Bvh(Bvh&&) noexcept = default;
Bvh& Bvh::operator=(Bvh&&) noexcept = default;
Bvh::~Bvh() = default;
const Scene& Bvh::scene() const { return *state_->meshes->scene; }
const CapMesh* Bvh::caps() const { return state_->caps; }
bool Bvh::empty() const { return state_->part_of_instance.empty(); }
std::span<const PartId> Bvh::hittable() const {
    return std::span(state_->part_of_instance).first(state_->part_of_instance.size() - (state_->caps ? 1 : 0));
}
bool Bvh::holds(PartId part) const {
    return porthole::index(part) < state_->held.size() && state_->held[porthole::index(part)];
}

Bvh build_bvh(const MeshBvhs& meshes, std::span<const PartId> parts, std::span<const CutRole> roles,
              std::span<const std::uint8_t> levels) {
    const MeshBvhs::State& base = meshes.state();
    const Scene& scene = *base.scene;
    auto state = std::make_unique<Bvh::State>();
    state->meshes = &base;
    state->held.assign(scene.parts.size(), 0);

    const auto role = [&](PartId id) { return roles.empty() ? CutRole::fixed : roles[index(id)]; };
    const auto shape_key = [&](PartId id) {
        const Part& part = scene.parts[index(id)];
        const Affine3d& a = part.world_from_mesh;
        return std::array<double, 12>{a.x.x, a.x.y, a.x.z, a.y.x, a.y.y, a.y.z,
                                      a.z.x, a.z.y, a.z.z, a.p.x, a.p.y, a.p.z};
    };
    const auto hash = [&](PartId id) { return base.hashes[scene.parts[index(id)].mesh]; };

    // An order that does not know the file's: coinciding parts end up side by side, and
    // Embree's tree, which decides exact ties, is the same whatever the order of the parts.
    std::vector<PartId> order;
    for (const PartId id : parts) {
        state->held[index(id)] = 1;
        if (!scene.mesh_of(id).empty()) order.push_back(id);
    }
    std::sort(order.begin(), order.end(), [&](PartId a, PartId b) {
        if (hash(a) != hash(b)) return hash(a) < hash(b);
        const auto ka = shape_key(a), kb = shape_key(b);
        if (ka != kb) return ka < kb;
        if ((role(a) == CutRole::fixed) != (role(b) == CutRole::fixed)) return role(a) == CutRole::fixed;
        const Part &pa = scene.parts[index(a)], &pb = scene.parts[index(b)];
        return pa.path != pb.path ? pa.path < pb.path : index(a) < index(b);
    });
    order.erase(std::unique(order.begin(), order.end(),
                            [&](PartId a, PartId b) { return hash(a) == hash(b) && shape_key(a) == shape_key(b); }),
                order.end());

    const RTCDevice device = base.device.value;
    state->top = SceneHandle(rtcNewScene(device));
    rtcSetSceneFlags(state->top.value, RTC_SCENE_FLAG_ROBUST);
    state->part_of_instance = order;
    for (std::uint32_t i = 0; i < order.size(); ++i) {
        const Part& part = scene.parts[index(order[i])];
        const GeometryHandle instance(rtcNewGeometry(device, RTC_GEOMETRY_TYPE_INSTANCE));
        rtcSetGeometryInstancedScene(instance.value, base.meshes[part.mesh].value);
        const Affine3f a(part.world_from_mesh);
        const float columns[12] = {a.x.x, a.x.y, a.x.z, a.y.x, a.y.y, a.y.z, a.z.x, a.z.y, a.z.z, a.p.x, a.p.y, a.p.z};
        rtcSetGeometryTransform(instance.value, 0, RTC_FORMAT_FLOAT3X4_COLUMN_MAJOR, columns);
        std::uint32_t mask = kMaskEverything;
        if (!roles.empty()) {
            const CutRole r = roles[index(order[i])];
            const std::size_t level = levels.empty() ? 0 : levels[index(order[i])];
            mask = r == CutRole::fixed     ? kMaskFixed
                   : r == CutRole::cut_set ? kMaskCutSet | level_mask(level)
                                           : kMaskLoose;
        }
        rtcSetGeometryMask(instance.value, mask);
        rtcCommitGeometry(instance.value);
        rtcAttachGeometryByID(state->top.value, instance.value, i);
    }
    rtcCommitScene(state->top.value);
    check_device(device);
    return Bvh(std::move(state));
}

void add_caps(Bvh& bvh, const CapMesh& caps) {
    Bvh::State& state = bvh.state();
    if (caps.empty()) return;
    const RTCDevice device = state.meshes->device.value;
    const GeometryHandle geometry(rtcNewGeometry(device, RTC_GEOMETRY_TYPE_TRIANGLE));
    // Embree reads 16 bytes at the last vertex: a buffer of its own has the room.
    const std::size_t n = caps.positions.size();
    if (void* copy =
            rtcSetNewGeometryBuffer(geometry.value, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3, sizeof(Vec3f), n))
        std::memcpy(copy, caps.positions.data(), n * sizeof(Vec3f));
    rtcSetSharedGeometryBuffer(geometry.value, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3, caps.triangles.data(), 0,
                               sizeof(Vec3u), caps.triangles.size());
    rtcCommitGeometry(geometry.value); // without filters: what a cap stops is stopped
    state.cap_scene = SceneHandle(rtcNewScene(device));
    rtcSetSceneFlags(state.cap_scene.value, RTC_SCENE_FLAG_ROBUST);
    // Even squares side by side: what is built fast is as good, and it is built anew for every picture.
    rtcSetSceneBuildQuality(state.cap_scene.value, RTC_BUILD_QUALITY_LOW);
    rtcAttachGeometryByID(state.cap_scene.value, geometry.value, 0);
    rtcCommitScene(state.cap_scene.value);

    const GeometryHandle instance(rtcNewGeometry(device, RTC_GEOMETRY_TYPE_INSTANCE));
    rtcSetGeometryInstancedScene(instance.value, state.cap_scene.value);
    rtcSetGeometryMask(instance.value, kMaskCaps);
    rtcCommitGeometry(instance.value);
    rtcAttachGeometryByID(state.top.value, instance.value, unsigned(state.part_of_instance.size()));
    state.part_of_instance.push_back(kCapPart);
    rtcCommitScene(state.top.value);
    check_device(device);
    state.caps = &caps;
}

void intersect(const Bvh& bvh, RayHit16& rays, Coherence coherence) {
    alignas(64) int valid[kLanes];
    if (!active_lanes(rays, valid)) return;
    QueryContext query = make_context(bvh, coherence);
    rtcIntersect16(valid, bvh.state().top.value, &query.rtc, reinterpret_cast<RTCRayHit16*>(&rays));
    const std::vector<PartId>& part = bvh.state().part_of_instance;
    for (int i = 0; i < kLanes; ++i)
        if (valid[i] && rays.geometry[i] != RTC_INVALID_GEOMETRY_ID) rays.instance[i] = index(part[rays.instance[i]]);
}

void occluded(const Bvh& bvh, RayHit16& rays, const Cut* cut, Vec3f* transmittance) {
    alignas(64) int valid[kLanes];
    if (!active_lanes(rays, valid)) return;
    QueryContext query = make_context(bvh, Coherence::incoherent);
    if (cut && !cut->empty()) {
        query.cut = cut;
        query.keep_world_rays(rays);
    }
    std::vector<Tinted> tints;
    if (transmittance) query.tints = &tints;
    rtcOccluded16(valid, bvh.state().top.value, &query.rtc, reinterpret_cast<RTCRay16*>(&rays));
    // In which order a ray meets surfaces depends on the rays beside it, and so would the last
    // bit of the product.
    std::sort(tints.begin(), tints.end());
    for (const Tinted& t : tints) transmittance[t.lane] *= t.tint;
}

void occluded_by_any(const Bvh& bvh, RayHit16& rays) {
    alignas(64) int valid[kLanes];
    if (!active_lanes(rays, valid)) return;
    QueryContext query = make_context(bvh, Coherence::incoherent);
    query.tinted_blocks = true;
    rtcOccluded16(valid, bvh.state().top.value, &query.rtc, reinterpret_cast<RTCRay16*>(&rays));
}

void detail::for_each_crossing(const Bvh& bvh, RayHit16& rays, VisitCrossing call, void* visit) {
    alignas(64) int valid[kLanes];
    if (!active_lanes(rays, valid)) return;
    QueryContext query = make_context(bvh, Coherence::incoherent);
    query.visit_call = call;
    query.visit = visit;
    rtcOccluded16(valid, bvh.state().top.value, &query.rtc, reinterpret_cast<RTCRay16*>(&rays));
}

void intersect_cut(const Bvh& bvh, RayHit16& rays, int lane, const Cut* cut) {
    RTCRayHit one;
    float tnear = rays.tnear[lane];
    for (;;) {
        one.ray = {rays.org_x[lane], rays.org_y[lane], rays.org_z[lane],    tnear,
                   rays.dir_x[lane], rays.dir_y[lane], rays.dir_z[lane],    0,
                   rays.tfar[lane],  rays.mask[lane],  std::uint32_t(lane), 0};
        one.hit.geomID = one.hit.instID[0] = RTC_INVALID_GEOMETRY_ID;
        QueryContext query = make_context(bvh, Coherence::incoherent);
        rtcIntersect1(bvh.state().top.value, &query.rtc, &one);
        if (one.hit.geomID == RTC_INVALID_GEOMETRY_ID) return;
        const PartId part = bvh.state().part_of_instance[one.hit.instID[0]];
        if (!cut || part == kCapPart || !cut->removes(rays.origin(lane) + rays.direction(lane) * one.ray.tfar, part)) {
            rays.tfar[lane] = one.ray.tfar;
            rays.ng_x[lane] = one.hit.Ng_x, rays.ng_y[lane] = one.hit.Ng_y, rays.ng_z[lane] = one.hit.Ng_z;
            rays.u[lane] = one.hit.u, rays.v[lane] = one.hit.v;
            rays.triangle[lane] = one.hit.primID;
            rays.geometry[lane] = one.hit.geomID;
            rays.instance[lane] = index(part);
            return;
        }
        // Gone: look on behind it. The next representable t ends the loop even on stacked
        // surfaces; a denormal one would be flushed to zero and find the same hit again.
        tnear = std::max(std::nextafter(one.ray.tfar, kInfinity), std::numeric_limits<float>::min());
    }
}

} // namespace porthole
