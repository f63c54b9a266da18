#include "porthole/render/surface.h"

#include "porthole/render/bxdf.h"
#include "porthole/scene/texture.h"

namespace porthole {

namespace {

constexpr float kAccentShare = 0.85f;
constexpr float kSaturation = 1.35f;
constexpr float kSmoothest = 0.03f;

float largest(Vec3f v) { return std::max({std::abs(v.x), std::abs(v.y), std::abs(v.z)}); }

Vec3f rgb(Vec4f c) { return {c.x, c.y, c.z}; }

Vec3f clamped(Vec3f c, float low, float high) {
    return {std::clamp(c.x, low, high), std::clamp(c.y, low, high), std::clamp(c.z, low, high)};
}

// Turned towards the viewer until the cosine is at least `least`.
Vec3f bent_to_viewer(Vec3f n, Vec3f to_viewer, float least) {
    const float c = dot(n, to_viewer);
    return c >= least ? n : normalize(n + to_viewer * (least - c), to_viewer);
}

// Lifts a point of a triangle to the curved surface that its vertex normals describe, as far
// as that bulges towards the viewer. Hanika, "Hacking the Shadow Terminator" (2021). Mesh space.
Vec3f bulge(const Vec3f (&corner)[3], const Vec3f (&normal)[3], const float (&weight)[3], Vec3f p, float side) {
    Vec3f lift{0, 0, 0};
    for (int i = 0; i < 3; ++i) {
        const float below = std::min(0.0f, side * dot(p - corner[i], normal[i]));
        lift += normal[i] * (-side * below * weight[i]);
    }
    return lift;
}

// On a surface given by a formula: the true normal everywhere, so there is nothing to smooth.
SurfacePoint primitive_point(const Placement& placement, const Hit& hit, Vec3f direction) {
    const PrimitivePoint p = surface_point(placement.mesh->primitives, hit.triangle, Vec2f{hit.u, hit.v});
    const Vec3f n(p.normal);
    SurfacePoint s;
    s.position = placement.world_from_mesh.point(Vec3f(p.position));
    Vec3f flat = normalize(placement.nx * n.x + placement.ny * n.y + placement.nz * n.z, -direction);
    s.front = dot(flat, direction) <= 0;
    if (!s.front) flat = -flat;
    s.flat_normal = flat;
    s.normal = bent_to_viewer(flat, -direction, 0.02f);
    s.start = s.position + flat * placement.offset;
    s.beyond = s.position - flat * placement.offset;
    return s;
}

} // namespace

Vec3f saturated(Vec3f color, float factor) {
    const float grey = 0.2126f * color.x + 0.7152f * color.y + 0.0722f * color.z;
    return max(Vec3f{grey, grey, grey} + (color - Vec3f{grey, grey, grey}) * factor, Vec3f{0, 0, 0});
}

Vec3f tinted(Vec3f color, Tint tint) {
    switch (tint.kind) {
    case Tint::Kind::saturate: return saturated(color, kSaturation);
    case Tint::Kind::accent: return lerp(color, tint.accent, kAccentShare);
    case Tint::Kind::none: break;
    }
    return color;
}

std::vector<Placement> make_placements(const Scene& scene) {
    std::vector<Placement> placements(scene.parts.size());
    for (std::size_t i = 0; i < placements.size(); ++i) {
        const Part& part = scene.parts[i];
        const Mesh& mesh = scene.meshes[part.mesh];
        Placement& p = placements[i];
        p.mesh = &mesh;
        p.world_from_mesh = Affine3f(part.world_from_mesh);
        // Cofactors keep normals perpendicular; a mirrored map turns them inside out.
        const Affine3d& a = part.world_from_mesh;
        const double sign = a.determinant() < 0 ? -1.0 : 1.0;
        p.nx = Vec3f(cross(a.y, a.z) * sign), p.ny = Vec3f(cross(a.z, a.x) * sign),
        p.nz = Vec3f(cross(a.x, a.y) * sign);
        // Rays lose precision with the size of coordinates, in the world and in the mesh.
        const Affine3f& m = p.world_from_mesh;
        const float stretch = std::max({length(m.x), length(m.y), length(m.z)});
        const float mesh_size =
            mesh.bounds.empty() ? 0 : std::max(largest(mesh.bounds.lower), largest(mesh.bounds.upper));
        p.offset = 4e-6f * (largest(m.p) + stretch * mesh_size);
    }
    return placements;
}

SurfacePoint surface_point(const Placement& placement, const Hit& hit, Vec3f direction) {
    const Mesh& mesh = *placement.mesh;
    if (!mesh.primitives.empty()) return primitive_point(placement, hit, direction);
    const Vec3u t = mesh.triangles[hit.triangle];
    const float weight[3] = {1.0f - hit.u - hit.v, hit.u, hit.v};
    const Vec3f corner[3] = {mesh.positions[t.x], mesh.positions[t.y], mesh.positions[t.z]};
    const Vec3f p = corner[0] * weight[0] + corner[1] * weight[1] + corner[2] * weight[2];
    const auto outward = [&](Vec3f n) { return placement.nx * n.x + placement.ny * n.y + placement.nz * n.z; };

    SurfacePoint s;
    s.position = placement.world_from_mesh.point(p);
    const Vec3f face = cross(corner[1] - corner[0], corner[2] - corner[0]);
    Vec3f flat = normalize(outward(face), -direction);
    s.front = dot(flat, direction) <= 0;
    if (!s.front) flat = -flat;
    s.flat_normal = flat;
    s.normal = flat;
    Vec3f lift{0, 0, 0};
    if (!mesh.normals.empty()) {
        const Vec3f normal[3] = {mesh.normals[t.x], mesh.normals[t.y], mesh.normals[t.z]};
        const Vec3f mixed = normal[0] * weight[0] + normal[1] * weight[1] + normal[2] * weight[2];
        Vec3f smooth = normalize(outward(mixed), flat);
        // Files disagree on the sign of normals; the winding of the triangle, seen from here, decides.
        if (dot(smooth, flat) < 0) smooth = -smooth;
        s.normal = bent_to_viewer(smooth, -direction, 0.02f);
        // Only where all three normals go with the face: elsewhere there is no curved surface.
        const float limit = 0.5f * length(face);
        const float a = dot(normal[0], face), b = dot(normal[1], face), c = dot(normal[2], face);
        const bool out = a > limit && b > limit && c > limit, in = a < -limit && b < -limit && c < -limit;
        if (out || in)
            lift = placement.world_from_mesh.vector(bulge(corner, normal, weight, p, out == s.front ? 1.0f : -1.0f));
    }
    const float offset = placement.offset;
    s.start = s.position + lift + flat * offset;
    s.beyond = s.position - flat * offset;
    return s;
}

Footprint footprint(const Placement& placement, const Hit& hit, Vec3f n, Vec3f direction, float width) {
    const Mesh& mesh = *placement.mesh;
    if (!mesh.primitives.empty() || !(width > 0)) return {};
    constexpr float kLeastCosine = 1.0f / 32;
    const Vec3u t = mesh.triangles[hit.triangle];
    const Affine3f& m = placement.world_from_mesh;
    const Vec3f e1 = m.vector(mesh.positions[t.y] - mesh.positions[t.x]);
    const Vec3f e2 = m.vector(mesh.positions[t.z] - mesh.positions[t.x]);
    const Vec3f area = cross(e1, e2);
    const float squared = dot(area, area);
    if (!(squared > 0)) return {};
    const float cosine = dot(n, direction);
    const Vec3f leaning = direction - n * cosine;
    const Vec3f a = normalize(leaning, Frame3(n).x);
    const auto barycentric = [&](Vec3f d) {
        return Vec2f{dot(cross(d, e2), area), dot(cross(e1, d), area)} * (1.0f / squared);
    };
    return {barycentric(a * (width / std::max(std::abs(cosine), kLeastCosine))), barycentric(cross(n, a) * width)};
}

float bending(const Placement& placement, const Hit& hit) {
    const Mesh& mesh = *placement.mesh;
    if (!mesh.primitives.empty() || mesh.normals.empty()) return 0;
    const Vec3u t = mesh.triangles[hit.triangle];
    const std::uint32_t corner[3] = {t.x, t.y, t.z};
    float most = 0;
    for (int i = 0; i < 3; ++i) {
        const std::uint32_t a = corner[i], b = corner[(i + 1) % 3];
        const float far = length(placement.world_from_mesh.vector(mesh.positions[b] - mesh.positions[a]));
        if (far > 0) most = std::max(most, length(mesh.normals[b] - mesh.normals[a]) / far);
    }
    return most;
}

Substance substance(const Scene& scene, const Placement& placement, const Hit& hit, Tint tint,
                    const Footprint& footprint) {
    const Mesh& mesh = *placement.mesh;
    const Material& m = scene.materials[mesh.material_of(hit.triangle)];
    const auto look_up = [&](const TextureRef& ref, Encoding encoding) {
        return sample_texture(scene, ref, mesh, hit.triangle, hit.u, hit.v, encoding, footprint);
    };
    const Vec4f base = base_color(scene, mesh, hit.triangle, hit.u, hit.v, footprint);

    Substance s;
    s.material = &m;
    s.color = tinted(rgb(base), tint);
    s.coverage = m.alpha_mode == AlphaMode::blend ? clamp01(base.w) : 1.0f;
    s.emission = m.emissive;
    if (m.emissive_texture.texture >= 0) s.emission = s.emission * rgb(look_up(m.emissive_texture, Encoding::srgb));
    if (m.occlusion_texture.texture >= 0)
        s.occlusion = 1.0f + m.occlusion_strength * (look_up(m.occlusion_texture, Encoding::linear).x - 1.0f);
    s.transmission = clamp01(m.transmission);
    if (s.transmission > 0 && m.transmission_texture.texture >= 0)
        s.transmission *= look_up(m.transmission_texture, Encoding::linear).x;

    const Vec3f matte = clamped(s.color, kDarkest, kLightest);
    if (m.specular_workflow) {
        Vec3f specular = m.specular_color;
        float gloss = 1.0f - m.roughness;
        if (m.metallic_roughness_texture.texture >= 0) {
            const Vec4f t = look_up(m.metallic_roughness_texture, Encoding::srgb);
            specular = specular * rgb(t);
            gloss *= t.w;
        }
        s.f0 = clamped(specular, 0.0f, 1.0f);
        s.roughness = 1.0f - gloss;
        s.diffuse = matte * (1.0f - std::max({s.f0.x, s.f0.y, s.f0.z}));
    } else {
        float metallic = m.metallic;
        s.roughness = m.roughness;
        if (m.metallic_roughness_texture.texture >= 0) {
            const Vec4f t = look_up(m.metallic_roughness_texture, Encoding::linear);
            metallic *= t.z;
            s.roughness *= t.y;
        }
        // An accent is paint: a mirror would show its surroundings' colours instead.
        if (tint.kind == Tint::Kind::accent) metallic *= 0.25f;
        metallic = clamp01(metallic);
        const float dielectric = f0_from_ior(m.ior);
        s.f0 = lerp(Vec3f{dielectric, dielectric, dielectric}, clamped(s.color, kDarkest, 1.0f), metallic);
        s.diffuse = matte * (1.0f - metallic);
        s.transmission *= 1.0f - metallic;
    }
    s.diffuse = s.diffuse * (1.0f - s.transmission);
    s.roughness = std::clamp(s.roughness, kSmoothest, 1.0f);
    return s;
}

Vec3f mapped_normal(const Scene& scene, const Placement& placement, const Hit& hit, const SurfacePoint& point,
                    const Material& material, Vec3f direction, const Footprint& footprint) {
    const Mesh& mesh = *placement.mesh;
    const TextureRef& ref = material.normal_texture;
    if (!has_texture(scene, ref) || ref.uv_set > 1 || mesh.uv[ref.uv_set].empty()) return point.normal;
    const Vec4f t = sample_texture(scene, ref, mesh, hit.triangle, hit.u, hit.v, Encoding::linear, footprint);
    const Vec3f local{(2 * t.x - 1) * material.normal_scale, (2 * t.y - 1) * material.normal_scale, 2 * t.z - 1};

    const Affine3f& m = placement.world_from_mesh;
    const Vec3u tri = mesh.triangles[hit.triangle];
    // The map is meant for the outside; the viewer's normal may be the inside's.
    const Vec3f n = point.front ? point.normal : -point.normal;
    Vec3f x, y;
    if (!mesh.tangents.empty()) {
        const float w0 = 1.0f - hit.u - hit.v;
        const Vec4f tangent = mesh.tangents[tri.x] * w0 + mesh.tangents[tri.y] * hit.u + mesh.tangents[tri.z] * hit.v;
        x = m.vector({tangent.x, tangent.y, tangent.z});
        x = normalize(x - n * dot(n, x), Frame3(n).x);
        // A mirrored placement mirrors the frame as well.
        const float handed = (tangent.w < 0 ? -1.0f : 1.0f) * (m.determinant() < 0 ? -1.0f : 1.0f);
        y = cross(n, x) * handed;
    } else {
        // From how the texture lies on the triangle.
        const auto& uv = mesh.uv[ref.uv_set];
        const Vec2f a = transform_uv(ref, uv[tri.x]), b = transform_uv(ref, uv[tri.y]) - a,
                    c = transform_uv(ref, uv[tri.z]) - a;
        const Vec3f e1 = m.vector(mesh.positions[tri.y] - mesh.positions[tri.x]);
        const Vec3f e2 = m.vector(mesh.positions[tri.z] - mesh.positions[tri.x]);
        const float det = b.x * c.y - c.x * b.y;
        if (!(std::abs(det) > 0)) return point.normal;
        const float sign = det < 0 ? -1.0f : 1.0f;
        x = (e1 * c.y - e2 * b.y) * sign;
        x = normalize(x - n * dot(n, x), Frame3(n).x);
        // Texture v runs down, the map's green is up.
        y = (e1 * c.x - e2 * b.x) * sign;
        y = y - n * dot(n, y) - x * dot(x, y);
        y = normalize(y, cross(n, x));
    }
    Vec3f mapped = normalize(x * local.x + y * local.y + n * local.z, n);
    if (!point.front) mapped = -mapped;
    return bent_to_viewer(mapped, -direction, 0.02f);
}

} // namespace porthole
