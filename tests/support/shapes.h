// Constructed scenes for tests: closed, outward-facing solids, named parts, plain views.
#pragma once

#include <cmath>
#include <string>

#include "porthole/base/view.h"
#include "porthole/scene/scene.h"

namespace porthole::test {

inline Mesh finished(Mesh mesh) {
    mesh.submeshes = {{0, std::uint32_t(mesh.triangles.size()), 0}};
    finish_mesh(mesh);
    return mesh;
}

/// Unit sphere, 4 * rings^2 triangles.
inline Mesh sphere(int rings = 24) {
    Mesh mesh;
    const auto columns = std::uint32_t(2 * rings);
    for (int i = 0; i <= rings; ++i)
        for (std::uint32_t j = 0; j < columns; ++j) {
            const float a = kPi * float(i) / float(rings), b = 2 * kPi * float(j) / float(columns);
            mesh.positions.push_back({std::sin(a) * std::sin(b), std::cos(a), std::sin(a) * std::cos(b)});
        }
    const auto at = [&](int i, std::uint32_t j) { return std::uint32_t(i) * columns + j % columns; };
    for (int i = 0; i < rings; ++i)
        for (std::uint32_t j = 0; j < columns; ++j) {
            mesh.triangles.push_back({at(i, j), at(i + 1, j), at(i + 1, j + 1)});
            mesh.triangles.push_back({at(i, j), at(i + 1, j + 1), at(i, j + 1)});
        }
    return finished(std::move(mesh));
}

/// Cube from -1 to 1.
inline Mesh cube() {
    Mesh mesh;
    for (int i = 0; i < 8; ++i) mesh.positions.push_back({i & 1 ? 1.f : -1.f, i & 2 ? 1.f : -1.f, i & 4 ? 1.f : -1.f});
    const std::uint32_t quads[6][4] = {{0, 2, 3, 1}, {4, 5, 7, 6}, {0, 1, 5, 4},
                                       {2, 6, 7, 3}, {0, 4, 6, 2}, {1, 3, 7, 5}};
    for (const auto& q : quads) {
        mesh.triangles.push_back({q[0], q[1], q[2]});
        mesh.triangles.push_back({q[0], q[2], q[3]});
    }
    return finished(std::move(mesh));
}

/// A scene with one default material to which solids are added by name.
struct Builder {
    Scene scene;
    std::uint32_t sphere_mesh, cube_mesh;

    explicit Builder(int sphere_rings = 24) {
        scene.materials.emplace_back().base_color = {0.7f, 0.7f, 0.7f, 1};
        scene.materials.back().metallic = 0;
        scene.meshes = {sphere(sphere_rings), cube()};
        for (Mesh& mesh : scene.meshes) mesh.positions.reserve(mesh.positions.size() + 1); // copies lose it
        sphere_mesh = 0, cube_mesh = 1;
    }
    PartId add(const std::string& name, std::uint32_t mesh, Vec3d center, Vec3d scale) {
        Affine3d a;
        a.x.x = scale.x, a.y.y = scale.y, a.z.z = scale.z;
        a.p = center;
        scene.parts.push_back({name, name, mesh, a});
        return PartId{std::uint32_t(scene.parts.size() - 1)};
    }
    PartId add_sphere(const std::string& name, Vec3d center, double radius) {
        return add(name, sphere_mesh, center, {radius, radius, radius});
    }
    /// @param half  half extents
    PartId add_box(const std::string& name, Vec3d center, Vec3d half) { return add(name, cube_mesh, center, half); }
};

/// A view from `eye` to `center`, y up. Orthographic pictures are 2 * half_height metres high.
inline View look(Vec3f eye, Vec3f center, int width, int height, float half_height, bool orthographic = false) {
    View view;
    const Vec3f z = normalize(eye - center);
    const Vec3f up = std::abs(z.y) > 0.999f ? Vec3f{0, 0, -1} : Vec3f{0, 1, 0};
    const Vec3f x = normalize(cross(up, z));
    view.world_from_camera = {x, cross(z, x), z, eye};
    view.orthographic = orthographic;
    view.half_height = half_height;
    view.width = width, view.height = height;
    return view;
}

inline Control with_threads(int n) { return {{}, {}, n}; }

} // namespace porthole::test
