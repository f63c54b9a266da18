// From a hit to a point that can be shaded: where it is, which way it faces, what it is made of.
#pragma once

#include <cstdint>
#include <vector>

#include "porthole/base/ids.h"
#include "porthole/scene/texture.h"

namespace porthole {

/// A hit as the ray query reports it.
struct Hit {
    PartId part = kNoPart;
    std::uint32_t triangle = 0;
    float u = 0, v = 0; ///< barycentric weights of corners 1 and 2
    bool cap = false;   ///< the cut through the part; the triangle is where the ray went into it
    [[nodiscard]] bool any() const { return part != kNoPart; }
};

/// A part's placement in float, ready for shading.
struct Placement {
    Affine3f world_from_mesh;
    Vec3f nx, ny, nz; ///< columns that turn an outward mesh normal into an outward world normal
    const Mesh* mesh = nullptr;
    float offset = 0; ///< how far secondary rays start off the surface, metres
};

/// Placements of all parts of a scene; keeps pointers into it.
/// Cost: linear in the parts, and in the triangles of transmissive meshes.
[[nodiscard]] std::vector<Placement> make_placements(const Scene& scene);

/// Geometry of a hit, seen along a ray.
struct SurfacePoint {
    Vec3f position;    ///< on the triangle
    Vec3f start;       ///< where secondary rays start on the viewer's side: off the triangle, on the curved
                       ///< surface that the vertex normals describe, so that facets cast no shadow on it
    Vec3f beyond;      ///< where rays start that go through the surface
    Vec3f flat_normal; ///< unit, of the triangle, on the viewer's side
    Vec3f normal;      ///< unit, smooth, on the viewer's side of surface and triangle
    bool front = true; ///< seen from outside, as the winding says
};
/// @param direction  unit, of the ray that hit.
[[nodiscard]] SurfacePoint surface_point(const Placement& placement, const Hit& hit, Vec3f direction);

/// What the surface is made of at a hit, textures and vertex colours looked up.
struct Substance {
    const Material* material = nullptr;
    Vec3f color;         ///< base colour, linear, as in the file
    Vec3f diffuse;       ///< albedo of the matte part
    Vec3f f0;            ///< reflectance at normal incidence
    float roughness = 1; ///< [0.03, 1]
    float coverage = 1;  ///< alpha of blended materials
    float transmission = 0;
    float occlusion = 1; ///< from the occlusion texture
    Vec3f emission;
};

/// How the colour of an emphasised part is changed.
struct Tint {
    enum class Kind : std::uint8_t { none, saturate, accent } kind = Kind::none;
    Vec3f accent{0.95f, 0.36f, 0.06f}; ///< linear
};

/// Matte albedo is kept within these: what is darker reads as a hole, what is lighter clips.
inline constexpr float kDarkest = 0.03f, kLightest = 0.85f;

/// What of a triangle a cone of rays covers that is `width` metres across where it meets it; a point on
/// primitives. At grazing angles at most 32 times as long as wide.
/// @param direction  unit, of the cone's axis.
[[nodiscard]] Footprint footprint(const Placement& placement, const Hit& hit, Vec3f flat_normal, Vec3f direction,
                                  float width);

/// How much the directions of a surface's normals differ along it, radians a metre: of a mesh, across the
/// triangle; 0 for primitives and flat shading.
[[nodiscard]] float bending(const Placement& placement, const Hit& hit);

/// @param footprint  over which textures are averaged.
[[nodiscard]] Substance substance(const Scene& scene, const Placement& placement, const Hit& hit, Tint tint = {},
                                  const Footprint& footprint = {});

/// The normal with the normal map applied, on the viewer's side, never turned away from the
/// viewer.
[[nodiscard]] Vec3f mapped_normal(const Scene& scene, const Placement& placement, const Hit& hit,
                                  const SurfacePoint& point, const Material& material, Vec3f direction,
                                  const Footprint& footprint = {});

/// `color` with its distance from grey multiplied; not below zero.
[[nodiscard]] Vec3f saturated(Vec3f color, float factor);

/// The base colour that a part of this colour has under `tint`.
[[nodiscard]] Vec3f tinted(Vec3f color, Tint tint);

} // namespace porthole
