// Bounding volume hierarchies and ray queries. The only folder that knows Embree.
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <type_traits>
#include <vector>

#include "porthole/base/cut.h"
#include "porthole/base/parallel.h"
#include "porthole/scene/scene.h"

namespace porthole {

inline constexpr int kLanes = 16; ///< rays of a packet: 4x4 pixels

/// Ray masks by which a query chooses what it can hit. Cap meshes are asked for by name: only
/// rays that obey the cut see them.
inline constexpr std::uint32_t kMaskFixed = 1, kMaskCutSet = 2, kMaskLoose = 4, kMaskCaps = 128;
inline constexpr std::uint32_t kMaskEverything = 0xFFFFFFFFu, kMaskAll = kMaskEverything & ~kMaskCaps;
inline constexpr std::size_t kMostLevels = 8;
/// Parts of the cut set that belong to one level of the cut.
constexpr std::uint32_t level_mask(std::size_t level) { return 256u << level; }

/// What a ray that meets a cap mesh hits; no part of the scene.
inline constexpr PartId kCapPart{0xFFFFFFFEu};

/// Sixteen rays and their hits, structure of arrays (the layout of RTCRayHit16).
/// Lanes with tfar < tnear are inactive.
struct alignas(64) RayHit16 {
    float org_x[kLanes], org_y[kLanes], org_z[kLanes], tnear[kLanes];
    float dir_x[kLanes], dir_y[kLanes], dir_z[kLanes], time[kLanes];
    float tfar[kLanes]; ///< in: farthest t; out: t of the hit, or -infinity if occluded()
    std::uint32_t mask[kLanes], id[kLanes], flags[kLanes];
    float ng_x[kLanes], ng_y[kLanes], ng_z[kLanes]; ///< unnormalised, mesh coordinates
    float u[kLanes], v[kLanes];
    std::uint32_t triangle[kLanes], geometry[kLanes];
    std::uint32_t instance[kLanes]; ///< after intersect(): part id, or kNoPart's value

    /// Sets lane `i`: ready for intersect() or occluded().
    void set(int i, Vec3f org, Vec3f dir, float t0, float t1, std::uint32_t ray_mask = kMaskAll) {
        org_x[i] = org.x, org_y[i] = org.y, org_z[i] = org.z;
        dir_x[i] = dir.x, dir_y[i] = dir.y, dir_z[i] = dir.z;
        tnear[i] = t0, tfar[i] = t1, time[i] = 0;
        mask[i] = ray_mask, id[i] = std::uint32_t(i), flags[i] = 0;
        geometry[i] = 0xFFFFFFFFu, instance[i] = 0xFFFFFFFFu;
    }
    /// Makes lane `i` inactive: it hits nothing.
    void clear(int i) { set(i, {}, {0, 0, 1}, kInfinity, -kInfinity); }
    [[nodiscard]] bool active(int i) const { return tnear[i] <= tfar[i]; }
    [[nodiscard]] bool hit(int i) const { return instance[i] != 0xFFFFFFFFu; }
    [[nodiscard]] PartId part(int i) const { return PartId{instance[i]}; }
    [[nodiscard]] Vec3f origin(int i) const { return {org_x[i], org_y[i], org_z[i]}; }
    [[nodiscard]] Vec3f direction(int i) const { return {dir_x[i], dir_y[i], dir_z[i]}; }
};

enum class Coherence : std::uint8_t { coherent, incoherent };

/// How hierarchies trade memory for speed. Hits are the same, bit for bit.
enum class BvhLayout : std::uint8_t {
    automatic, ///< `compact` from two million triangles in the scene's meshes on, else `fast`
    fast,      ///< 64 bytes a triangle, as much again for a while as one mesh is built
    compact    ///< 33 bytes a triangle, built in two thirds of the time, traced in 1.05 to 1.2 times the time
};

struct BvhParams {
    std::string isa = "avx2"; ///< "avx2": the same bits on every processor that has it; "native"
    BvhLayout layout = BvhLayout::automatic;
};

/// One hierarchy per mesh, shared by every Bvh over the same scene. Keeps a pointer to the
/// scene, which must outlive it and not move. Move-only; const use is thread-safe.
class MeshBvhs {
public:
    struct State;
    explicit MeshBvhs(std::unique_ptr<State> state);
    MeshBvhs(MeshBvhs&&) noexcept;
    MeshBvhs& operator=(MeshBvhs&&) noexcept;
    ~MeshBvhs();
    [[nodiscard]] const State& state() const { return *state_; }
    [[nodiscard]] const Scene& scene() const;

private:
    std::unique_ptr<State> state_;
};

/// Builds the hierarchy of every mesh of the scene. What rays hit, triangles that coincide
/// included, depends neither on the layout nor on the number of threads.
/// @throws Error limit E0902 when memory runs out; Cancelled.
/// Cost: 2 to 4 million triangles a second and thread.
[[nodiscard]] MeshBvhs build_mesh_bvhs(const Scene& scene, const BvhParams& params = {}, const Control& control = {});

/// A point of a part's surface.
struct SurfaceRef {
    PartId part = kNoPart;
    std::uint32_t triangle = 0;
    float u = 0, v = 0;
    friend bool operator==(const SurfaceRef&, const SurfaceRef&) = default;
};

/// The cut surface where it runs through solid material, as triangles in world coordinates:
/// what shadow, ambient, reflected and refracted rays see of the caps.
struct CapMesh {
    std::vector<Vec3f> positions;
    std::vector<Vec3u> triangles;
    std::vector<SurfaceRef> face; ///< by triangle: whose material shows
    [[nodiscard]] bool empty() const { return triangles.empty(); }
};

/// A top-level hierarchy over instances of some parts. Move-only; const use is thread-safe.
/// Needs its MeshBvhs alive.
class Bvh {
public:
    struct State;
    explicit Bvh(std::unique_ptr<State> state);
    Bvh(Bvh&&) noexcept;
    Bvh& operator=(Bvh&&) noexcept;
    ~Bvh();
    [[nodiscard]] const State& state() const { return *state_; }
    [[nodiscard]] State& state() { return *state_; }
    [[nodiscard]] const Scene& scene() const;
    [[nodiscard]] const CapMesh* caps() const;   ///< null without
    [[nodiscard]] bool empty() const;            ///< no parts
    [[nodiscard]] bool holds(PartId part) const; ///< among the parts it was built from
    /// Of these the ones that can be hit: not empty, of coinciding ones a single one. In an order
    /// that does not depend on that of the parts.
    [[nodiscard]] std::span<const PartId> hittable() const;

private:
    std::unique_ptr<State> state_;
};

/// @param parts  the parts it holds, each at most once. Of parts that coincide exactly (same
///               mesh data and transform) only one can be hit, a fixed one before others, then
///               the first by path: a part duplicated in place changes nothing.
/// @param roles  by part id: sets each instance's ray mask (kMaskFixed, kMaskLoose, or
///               kMaskCutSet with the bit of its level); empty: every mask hits.
/// @param levels by part id, below kMostLevels; empty: all 0.
/// Hits do not depend on the order of `parts` nor on the number of threads.
/// Cost: about a microsecond per part.
[[nodiscard]] Bvh build_bvh(const MeshBvhs& meshes, std::span<const PartId> parts, std::span<const CutRole> roles = {},
                            std::span<const std::uint8_t> levels = {});

/// Adds the caps to what rays with kMaskCaps hit; such hits are of kCapPart. `caps` must
/// outlive `bvh` and not change. Cost: as build_mesh_bvhs for its triangles.
void add_caps(Bvh& bvh, const CapMesh& caps);

/// Nearest hits of the active lanes. Alpha-masked texels are passed through. After the call
/// `tfar` is the hit's t and `instance` its part id.
void intersect(const Bvh& bvh, RayHit16& rays, Coherence coherence);

/// Shadow query: lanes that meet an opaque surface get tfar = -infinity. Surfaces of blended
/// and transmissive materials do not stop a ray: they tint `transmittance[lane]`, if given.
/// With a cut, what it removes does not stop a ray either.
/// Incoherent always: coherent occlusion packets on instances did not return (docs/decisions).
void occluded(const Bvh& bvh, RayHit16& rays, const Cut* cut, Vec3f* transmittance);

/// Coverage query: lanes that meet any surface, of whatever material, get tfar = -infinity.
void occluded_by_any(const Bvh& bvh, RayHit16& rays);

/// One surface that a ray passes through.
struct Crossing {
    int lane = 0;
    PartId part = kNoPart;
    float t = 0;
    std::uint32_t triangle = 0;
    float u = 0, v = 0;    ///< on the triangle
    bool entering = false; ///< the ray runs against the triangle's normal, by its winding
};

/// Calls visit(Crossing) for every surface that the active lanes cross between tnear and tfar,
/// in no particular order but the same every time. Alpha-masked texels are no surface.
/// `rays` keeps its tfar.
template <typename Visit> void for_each_crossing(const Bvh& bvh, RayHit16& rays, Visit&& visit);

/// Nearest hit that `cut` leaves (all of them without a cut) of one lane of `rays`, the result
/// in that lane; for reflected and refracted rays.
void intersect_cut(const Bvh& bvh, RayHit16& rays, int lane, const Cut* cut);

namespace detail {
using VisitCrossing = void (*)(void* visit, const Crossing& crossing);
void for_each_crossing(const Bvh& bvh, RayHit16& rays, VisitCrossing call, void* visit);
} // namespace detail

template <typename Visit> void for_each_crossing(const Bvh& bvh, RayHit16& rays, Visit&& visit) {
    using V = std::remove_reference_t<Visit>;
    detail::for_each_crossing(
        bvh, rays, [](void* v, const Crossing& crossing) { (*static_cast<V*>(v))(crossing); }, &visit);
}

} // namespace porthole
