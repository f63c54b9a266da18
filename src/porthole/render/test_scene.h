// Scenes that tests build by hand: boxes, planes and spheres.
#pragma once

#include "porthole/scene/scene.h"
#include "porthole/trace/bvh.h"

namespace porthole::test {

inline Material matte(Vec3f color) {
    Material m;
    m.base_color = {color.x, color.y, color.z, 1};
    m.metallic = 0;
    return m;
}

/// Axis-aligned box, outside faces counter-clockwise, flat.
inline Mesh box_mesh(Vec3f lower, Vec3f upper, std::uint32_t material = 0) {
    Mesh mesh;
    for (int i = 0; i < 8; ++i)
        mesh.positions.push_back({i & 1 ? upper.x : lower.x, i & 2 ? upper.y : lower.y, i & 4 ? upper.z : lower.z});
    const std::uint32_t quads[6][4] = {{0, 2, 3, 1}, {4, 5, 7, 6}, {0, 1, 5, 4},
                                       {2, 6, 7, 3}, {0, 4, 6, 2}, {1, 3, 7, 5}};
    for (const auto& q : quads) {
        mesh.triangles.push_back({q[0], q[1], q[2]});
        mesh.triangles.push_back({q[0], q[2], q[3]});
    }
    mesh.submeshes = {{0, std::uint32_t(mesh.triangles.size()), material}};
    return mesh;
}

/// Rectangle p, p + a, p + a + b, p + b; the front is on the side of a x b.
inline Mesh quad_mesh(Vec3f p, Vec3f a, Vec3f b, std::uint32_t material = 0) {
    Mesh mesh;
    mesh.positions = {p, p + a, p + a + b, p + b};
    mesh.triangles = {{0, 1, 2}, {0, 2, 3}};
    mesh.uv[0] = {{0, 0}, {1, 0}, {1, 1}, {0, 1}};
    mesh.submeshes = {{0, 2, material}};
    return mesh;
}

/// Sphere with smooth normals.
inline Mesh sphere_mesh(Vec3f center, float radius, int rows, std::uint32_t material = 0) {
    Mesh mesh;
    const int columns = 2 * rows;
    const auto add = [&](Vec3f n) {
        mesh.positions.push_back(center + n * radius);
        mesh.normals.push_back(n);
        return std::uint32_t(mesh.positions.size() - 1);
    };
    const std::uint32_t top = add({0, 1, 0});
    for (int i = 1; i < rows; ++i)
        for (int j = 0; j < columns; ++j) {
            const float theta = kPi * float(i) / float(rows), phi = 2 * kPi * float(j) / float(columns);
            add({std::sin(theta) * std::cos(phi), std::cos(theta), -std::sin(theta) * std::sin(phi)});
        }
    const std::uint32_t bottom = add({0, -1, 0});
    const auto at = [&](int i, int j) { return std::uint32_t(1 + (i - 1) * columns + j % columns); };
    for (int j = 0; j < columns; ++j) {
        mesh.triangles.push_back({top, at(1, j), at(1, j + 1)});
        for (int i = 1; i + 1 < rows; ++i) {
            mesh.triangles.push_back({at(i, j), at(i + 1, j), at(i + 1, j + 1)});
            mesh.triangles.push_back({at(i, j), at(i + 1, j + 1), at(i, j + 1)});
        }
        mesh.triangles.push_back({at(rows - 1, j), bottom, at(rows - 1, j + 1)});
    }
    mesh.submeshes = {{0, std::uint32_t(mesh.triangles.size()), material}};
    return mesh;
}

/// Adds a mesh as a part of its own.
inline PartId add_part(Scene& scene, Mesh mesh, const char* name = "part") {
    finish_mesh(mesh);
    scene.meshes.push_back(std::move(mesh));
    Part part;
    part.name = part.path = name + std::to_string(scene.parts.size());
    part.mesh = std::uint32_t(scene.meshes.size() - 1);
    scene.parts.push_back(part);
    return PartId(std::uint32_t(scene.parts.size() - 1));
}

/// From `eye` at `target`, y up.
inline View look_at(Vec3f eye, Vec3f target, int width, int height, float half_height = 0.4f) {
    View view;
    const Vec3f z = normalize(eye - target), x = normalize(cross(Vec3f{0, 1, 0}, z), Vec3f{1, 0, 0});
    view.world_from_camera = {x, cross(z, x), z, eye};
    view.half_height = half_height;
    view.width = width, view.height = height;
    return view;
}

} // namespace porthole::test
