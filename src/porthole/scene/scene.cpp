#include "porthole/scene/scene.h"

#include <algorithm>
#include <span>
#include <unordered_map>
#include <utility>

namespace porthole {

std::uint32_t Mesh::material_of(std::uint32_t triangle) const {
    if (submeshes.size() == 1) return submeshes[0].material;
    const auto after = std::upper_bound(submeshes.begin(), submeshes.end(), triangle,
                                        [](std::uint32_t t, const Submesh& s) { return t < s.first_triangle; });
    return std::prev(after)->material;
}

Bounds3d part_bounds(const Scene& scene, PartId id) {
    const Part& part = scene.parts[index(id)];
    const Mesh& mesh = scene.meshes[part.mesh];
    if (!mesh.primitives.empty()) return bounds(mesh.primitives, part.world_from_mesh);
    Bounds3d bounds;
    for (const Vec3f& p : mesh.positions) bounds.extend(part.world_from_mesh.point(Vec3d(p)));
    return bounds;
}

namespace {

constexpr std::size_t kRun = 256; ///< vertices

std::vector<Bounds3f> boxes_of_runs(const Mesh& mesh) {
    std::vector<Bounds3f> boxes((mesh.positions.size() + kRun - 1) / kRun);
    for (std::size_t i = 0; i < mesh.positions.size(); ++i) boxes[i / kRun].extend(mesh.positions[i]);
    return boxes;
}

/// The box of a placed box, enlarged by more than what rounding can do to the points in it.
Bounds3d placed_box(const Affine3d& m, const Bounds3f& box) {
    const Vec3d center = Vec3d(box.lower) * 0.5 + Vec3d(box.upper) * 0.5;
    const Vec3d half = Vec3d(box.upper) * 0.5 - Vec3d(box.lower) * 0.5;
    const Vec3d c = m.point(center);
    Bounds3d out;
    for (int axis = 0; axis < 3; ++axis) {
        const double x = std::abs(m.x[axis]), y = std::abs(m.y[axis]), z = std::abs(m.z[axis]);
        const double extent = x * half.x + y * half.y + z * half.z;
        const double size =
            x * std::abs(center.x) + y * std::abs(center.y) + z * std::abs(center.z) + extent + std::abs(m.p[axis]);
        out.lower[axis] = c[axis] - extent - 1e-12 * size;
        out.upper[axis] = c[axis] + extent + 1e-12 * size;
    }
    return out;
}

bool lies_in(const Bounds3d& inner, const Bounds3d& outer) {
    return inner.lower.x >= outer.lower.x && inner.lower.y >= outer.lower.y && inner.lower.z >= outer.lower.z &&
           inner.upper.x <= outer.upper.x && inner.upper.y <= outer.upper.y && inner.upper.z <= outer.upper.z;
}

/// Adds a part of which `runs` are the vertices' boxes. Looks at no vertex that cannot matter.
void extend_by_part(Bounds3d& bounds, const Mesh& mesh, std::span<const Bounds3f> runs, const Affine3d& m) {
    for (std::size_t run = 0; run < runs.size(); ++run) {
        if (lies_in(placed_box(m, runs[run]), bounds)) continue;
        const std::size_t end = std::min(mesh.positions.size(), (run + 1) * kRun);
        for (std::size_t i = run * kRun; i < end; ++i) bounds.extend(m.point(Vec3d(mesh.positions[i])));
    }
}

} // namespace

Bounds3d scene_bounds(const Scene& scene) {
    constexpr std::uint32_t kOften = 4; // placements from which the boxes of runs pay
    std::vector<std::uint32_t> placements(scene.meshes.size(), 0);
    for (const Part& part : scene.parts) ++placements[part.mesh];

    Bounds3d bounds;
    std::vector<std::vector<Bounds3f>> runs(scene.meshes.size());
    std::vector<std::pair<const Part*, Bounds3d>> often; // parts and boxes around them
    for (const PartId id : all_parts(scene)) {
        const Part& part = scene.parts[index(id)];
        const Mesh& mesh = scene.meshes[part.mesh];
        if (placements[part.mesh] < kOften || mesh.positions.size() <= kRun || !mesh.primitives.empty()) {
            bounds.extend(part_bounds(scene, id));
            continue;
        }
        if (runs[part.mesh].empty()) runs[part.mesh] = boxes_of_runs(mesh);
        Bounds3f box;
        for (const Bounds3f& run : runs[part.mesh]) box.extend(run);
        often.emplace_back(&part, placed_box(part.world_from_mesh, box));
    }
    if (often.empty()) return bounds;

    // The outermost first: then most others are seen to lie within.
    const auto add = [&](const std::pair<const Part*, Bounds3d>& placed) {
        const Part& part = *placed.first;
        if (!lies_in(placed.second, bounds))
            extend_by_part(bounds, scene.meshes[part.mesh], runs[part.mesh], part.world_from_mesh);
    };
    for (int axis = 0; axis < 3; ++axis) {
        add(*std::ranges::min_element(often, {}, [axis](const auto& p) { return p.second.lower[axis]; }));
        add(*std::ranges::max_element(often, {}, [axis](const auto& p) { return p.second.upper[axis]; }));
    }
    for (const auto& placed : often) add(placed);
    return bounds;
}

std::vector<PartId> all_parts(const Scene& scene) {
    std::vector<PartId> ids(scene.parts.size());
    for (std::uint32_t i = 0; i < ids.size(); ++i) ids[i] = PartId{i};
    return ids;
}

std::uint64_t triangle_count(const Scene& scene) {
    std::uint64_t n = 0;
    for (const Part& part : scene.parts) n += scene.meshes[part.mesh].triangles.size();
    return n;
}

namespace {

bool usable(Vec3f p) {
    return std::abs(p.x) < kLargestCoordinate && std::abs(p.y) < kLargestCoordinate &&
           std::abs(p.z) < kLargestCoordinate;
}

bool has_area(Vec3f a, Vec3f b, Vec3f c) {
    const Vec3d n = cross(Vec3d(b) - Vec3d(a), Vec3d(c) - Vec3d(a));
    return dot(n, n) > 0;
}

void finish_primitives(Mesh& mesh) {
    mesh.submeshes.clear();
    for (const PrimitiveLeaf& leaf : mesh.primitives.leaves) {
        const std::uint32_t surfaces = surface_count(leaf.kind);
        if (!mesh.submeshes.empty() && mesh.submeshes.back().material == leaf.material)
            mesh.submeshes.back().triangle_count += surfaces;
        else
            mesh.submeshes.push_back({leaf.first_surface, surfaces, leaf.material});
    }
    mesh.bounds = {};
    const Bounds3d box = mesh.primitives.bounds();
    if (box.empty()) return;
    // Rounded outward.
    for (int axis = 0; axis < 3; ++axis) {
        mesh.bounds.lower[axis] = std::nextafter(float(box.lower[axis]), -kInfinity);
        mesh.bounds.upper[axis] = std::nextafter(float(box.upper[axis]), kInfinity);
    }
}

} // namespace

MeshRepair finish_mesh(Mesh& mesh) {
    MeshRepair repair;
    if (!mesh.primitives.empty()) {
        finish_primitives(mesh);
        return repair;
    }
    const std::size_t vertices = mesh.positions.size();
    const auto corners_usable = [&](Vec3u t) {
        return t.x < vertices && t.y < vertices && t.z < vertices && usable(mesh.positions[t.x]) &&
               usable(mesh.positions[t.y]) && usable(mesh.positions[t.z]);
    };
    // Needles without area are never hit, but their edges close the surface: they stay, unless
    // there is nothing else.
    const bool any_area = std::any_of(mesh.triangles.begin(), mesh.triangles.end(), [&](Vec3u t) {
        return corners_usable(t) && has_area(mesh.positions[t.x], mesh.positions[t.y], mesh.positions[t.z]);
    });

    std::vector<Submesh> kept;
    std::size_t out = 0;
    for (const Submesh& s : mesh.submeshes) {
        Submesh run{static_cast<std::uint32_t>(out), 0, s.material};
        for (std::uint32_t i = 0; i < s.triangle_count; ++i) {
            const Vec3u t = mesh.triangles[s.first_triangle + i];
            if (!corners_usable(t)) {
                ++repair.non_finite;
                continue;
            }
            const Vec3f a = mesh.positions[t.x], b = mesh.positions[t.y], c = mesh.positions[t.z];
            if (a == b || b == c || c == a || !any_area) {
                ++repair.degenerate;
                continue;
            }
            mesh.triangles[out++] = t;
        }
        run.triangle_count = static_cast<std::uint32_t>(out) - run.first_triangle;
        if (run.triangle_count > 0) kept.push_back(run);
    }
    mesh.triangles.resize(out);
    mesh.submeshes = std::move(kept);

    // Vertices that no triangle uses would spoil boxes: they move onto one that is used.
    std::vector<std::uint8_t> used(vertices, 0);
    for (const Vec3u& t : mesh.triangles) used[t.x] = used[t.y] = used[t.z] = 1;
    mesh.bounds = {};
    for (std::size_t i = 0; i < vertices; ++i)
        if (used[i])
            mesh.bounds.extend(mesh.positions[i]);
        else
            mesh.positions[i] = mesh.triangles.empty() ? Vec3f{} : mesh.positions[mesh.triangles[0].x];
    mesh.positions.reserve(vertices + 1);
    return repair;
}

void recentre(Scene& scene) {
    const Bounds3d bounds = scene_bounds(scene);
    if (bounds.empty()) return;
    const Vec3d center = bounds.center();
    const double diagonal = bounds.diagonal();
    if (!(length(center) > 16 * diagonal)) return;
    scene.origin = scene.origin + center;
    for (Part& part : scene.parts) part.world_from_mesh.p = part.world_from_mesh.p - center;
    for (Light& light : scene.lights) light.position = Vec3f(Vec3d(light.position) - center);
    for (FileCamera& camera : scene.cameras) camera.world_from_camera.p = camera.world_from_camera.p - center;
}

void assign_paths(Scene& scene, const std::vector<std::vector<std::string>>& chains) {
    // Ancestors are told apart by the readers (they number repeated groups themselves); here
    // only whole paths that are still equal get their number.
    std::unordered_map<std::string, std::uint32_t> seen;
    std::vector<std::string> paths(scene.parts.size());
    for (std::size_t i = 0; i < scene.parts.size(); ++i) {
        for (const std::string& segment : chains[i]) {
            if (!paths[i].empty()) paths[i] += '/';
            paths[i] += segment;
        }
        ++seen[paths[i]];
    }
    std::unordered_map<std::string, std::uint32_t> next;
    std::unordered_map<std::string, bool> taken;
    for (const std::string& p : paths)
        if (seen[p] == 1 && !p.empty()) taken[p] = true;
    for (std::size_t i = 0; i < scene.parts.size(); ++i) {
        if (seen[paths[i]] == 1 && !paths[i].empty()) {
            scene.parts[i].path = paths[i];
            continue;
        }
        std::string unique;
        do unique = paths[i] + '[' + std::to_string(next[paths[i]]++) + ']';
        while (!taken.emplace(unique, true).second);
        scene.parts[i].path = std::move(unique);
    }
}

} // namespace porthole
