#include "porthole/trace/solid.h"

#include <algorithm>
#include <array>
#include <random>

namespace porthole {

namespace {

constexpr int kRays = 300;

/// Never below `sign` times zero, and zero in the end.
bool is_balanced(const std::vector<std::pair<float, bool>>& crossings, bool inverted) {
    int depth = 0;
    for (const auto& [t, entering] : crossings) {
        depth += entering != inverted ? 1 : -1;
        if (depth < 0) return false;
    }
    return depth == 0;
}

SolidTest test_mesh(const Bvh& bvh, const Bounds3f& box, const Affine3d& world_from_mesh, std::uint32_t seed) {
    // Lines through two random points of the box, from well outside it.
    std::mt19937 random(seed);
    const auto unit = [&] { return float(random() >> 8) * 0x1p-24f; };
    const auto point = [&] {
        const Vec3f s = box.size();
        const float x = unit(), y = unit(), z = unit();
        return box.lower + Vec3f{x * s.x, y * s.y, z * s.z};
    };
    SolidTest result;
    int inverted = 0;
    std::array<std::vector<std::pair<float, bool>>, kLanes> crossings;
    for (int first = 0; first < kRays; first += kLanes) {
        RayHit16 rays;
        for (int i = 0; i < kLanes; ++i) {
            crossings[std::size_t(i)].clear();
            const Vec3f a = point(), b = point();
            const Vec3f world_a(world_from_mesh.point(Vec3d(a))), world_b(world_from_mesh.point(Vec3d(b)));
            const Vec3f direction = normalize(world_b - world_a);
            const float size = float(length(world_from_mesh.vector(Vec3d(box.size()))));
            rays.set(i, world_a - direction * (2 * size), direction, 0, kInfinity);
            if (first + i >= kRays) rays.clear(i);
        }
        for_each_crossing(bvh, rays,
                          [&](const Crossing& c) { crossings[std::size_t(c.lane)].emplace_back(c.t, c.entering); });
        for (auto& list : crossings) {
            if (list.empty()) continue;
            // At one t leaving sorts before entering: faces that touch count as two solids.
            std::sort(list.begin(), list.end());
            ++result.rays;
            result.balanced += is_balanced(list, false);
            inverted += is_balanced(list, true);
        }
    }
    if (inverted > result.balanced) result.balanced = inverted, result.inverted = true;
    return result;
}

} // namespace

std::vector<SolidTest> test_solids(const MeshBvhs& meshes, const std::vector<std::uint8_t>& wanted,
                                   const Control& control) {
    const Scene& scene = meshes.scene();
    // One part that shows each wanted mesh.
    std::vector<PartId> shown(scene.meshes.size(), kNoPart);
    for (const PartId id : all_parts(scene)) {
        const std::uint32_t mesh = scene.parts[index(id)].mesh;
        if (wanted[mesh] && shown[mesh] == kNoPart) shown[mesh] = id;
    }
    std::vector<SolidTest> results(scene.meshes.size());
    parallel_for(scene.meshes.size(), control, [&](std::size_t i) {
        if (shown[i] == kNoPart || scene.meshes[i].triangles.empty()) return;
        const std::array<PartId, 1> one{shown[i]};
        results[i] =
            test_mesh(build_bvh(meshes, one), scene.meshes[i].bounds, scene.parts[index(shown[i])].world_from_mesh,
                      std::uint32_t(scene.meshes[i].triangles.size()));
    });
    return results;
}

} // namespace porthole
