#include "porthole/render/paths.h"

#include "porthole/render/bxdf.h"
#include "porthole/render/cap.h"

namespace porthole {

namespace {

/// Rays that carry less are dropped: what they would add is hard to see.
constexpr float kLeastWeight = 0.02f;

float largest(Vec3f v) { return std::max({v.x, v.y, v.z}); }

Vec3f root(Vec3f v) { return {std::sqrt(v.x), std::sqrt(v.y), std::sqrt(v.z)}; }

/// Beer's law over `distance` metres inside a material.
Vec3f absorption(const Material& m, float distance) {
    if (!(m.attenuation_distance < kInfinity) || !(m.attenuation_distance > 0)) return {1, 1, 1};
    const float k = std::min(distance, 1e30f) / m.attenuation_distance;
    const auto keep = [&](float c) { return std::pow(std::clamp(c, 1e-6f, 1.0f), k); };
    return {keep(m.attenuation_color.x), keep(m.attenuation_color.y), keep(m.attenuation_color.z)};
}

/// Whether light bends in the surface: in a body with thickness. Without one glTF means a thin
/// sheet, and an insect in amber is better seen than its refractions.
bool bends(const Material& m) { return m.transmission > 0 && m.thickness > 0; }

/// The colour that light takes on where it passes the surface. Of a blended body alpha says
/// how strong it is: such bodies are drawn as two blended sheets elsewhere.
Vec3f surface_tint(const Substance& s, bool body) {
    const Vec3f color{clamp01(s.color.x), clamp01(s.color.y), clamp01(s.color.z)};
    if (!body) return color;
    return root(lerp(Vec3f{1, 1, 1}, color, std::sqrt(s.coverage))); // once on the way in, once out
}

/// Frosted glass spreads a camera ray into this many; where samples are averaged, into fewer.
constexpr int kSpread = 16, kSpreadAveraged = 4;
constexpr float kFrosted = 0.1f; ///< roughness from which glass is frosted

float least_weight(const PathRay& ray) { return ray.spread ? kLeastWeight / kSpread : kLeastWeight; }

/// Whether glass blurs what is behind it. A roughness of 1 without a texture is what glTF
/// says when the file says nothing: such glass is drawn clear, or nothing would be seen.
bool is_frosted(const Substance& s) {
    const Material& m = *s.material;
    return s.roughness > kFrosted && (m.roughness < 1.0f || m.metallic_roughness_texture.texture >= 0);
}

/// How fast a cone of rays widens past a surface: `turn` times as much more as normals differ across it.
/// Plain: as if it bent one way only, outward.
float widened(const PathRay& ray, const Hit& hit, const Placement& placement, float turn) {
    return hit.cap ? ray.widening : ray.widening + turn * ray.width * bending(placement, hit);
}

/// Facet normal `i` of `n` of a GGX surface.
Vec3f facet_normal(Vec3f normal, float alpha, int i, int n) {
    const Vec2f d = disc_point(i, n); // evenly spread in area: radius squared is uniform
    const float u = std::min(dot(d, d), 0.98f);
    const float tan2 = alpha * alpha * u / (1.0f - u);
    const float r = std::sqrt(tan2 / std::max(u, 1e-6f));
    return normalize(Frame3(normal).world_from_local({d.x * r, d.y * r, 1.0f}), normal);
}

} // namespace

namespace {

/// What a secondary ray hit; of a cap mesh the part whose material it shows.
Hit hit_of(const Bvh& bvh, const RayHit16& rays, int lane) {
    if (rays.part(lane) != kCapPart) return {rays.part(lane), rays.triangle[lane], rays.u[lane], rays.v[lane]};
    const SurfaceRef& face = bvh.caps()->face[rays.triangle[lane]];
    return {face.part, face.triangle, face.u, face.v, true};
}

SurfacePoint cap_mesh_point(const RayHit16& rays, int lane) {
    const Vec3f direction = rays.direction(lane);
    SurfacePoint p;
    p.position = rays.origin(lane) + direction * rays.tfar[lane];
    p.normal = normalize(Vec3f{rays.ng_x[lane], rays.ng_y[lane], rays.ng_z[lane]}, -direction);
    if (dot(p.normal, direction) > 0) p.normal = -p.normal;
    p.flat_normal = p.normal;
    const float off = 1e-4f * rays.tfar[lane];
    p.start = p.position + p.normal * off;
    p.beyond = p.position - p.normal * off;
    return p;
}

} // namespace

void Media::leave(std::int32_t m) {
    for (int i = count; i-- > 0;) {
        if (material[std::size_t(i)] != m) continue;
        for (int k = i + 1; k < count; ++k) material[std::size_t(k - 1)] = material[std::size_t(k)];
        --count;
        return;
    }
}

Vec4f display_color(const Radiance& r, Vec3f background) {
    const Vec3f shown = shoulder(r.light) + r.shown;
    const float open = clamp01(std::min({r.background.x, r.background.y, r.background.z}));
    const Vec3f extra = (r.background - Vec3f{open, open, open}) * background;
    return {shown.x + extra.x, shown.y + extra.y, shown.z + extra.z, 1.0f - open};
}

void Shader::push(const PathRay& ray) {
    if (largest(ray.weight) < least_weight(ray)) return;
    if (ray.bounce <= stage_->params.max_bounces)
        queue_.push_back(ray);
    else
        end_in_surroundings(ray); // where it would have gone on: bright rather than black
}

void Shader::end_in_surroundings(const PathRay& ray) {
    Radiance& sum = radiance_[ray.slot];
    const float strength = stage_->lighting.ambient + stage_->lighting.fill.y;
    if (ray.through)
        sum.background += ray.weight;
    else
        sum.light += ray.weight * sky_radiance(ray.direction, ray.roughness) * strength;
}

void Shader::add(const PathRay& ray, const Hit& hit, const SurfacePoint& point, const Reach& reach, bool on_target) {
    const Stage& stage = *stage_;
    const Placement& placement = stage.placements[index(hit.part)];
    const Tint tint = on_target && !stage.tints.empty() ? stage.tints[index(hit.part)] : Tint{};
    const auto cap = [&] {
        const PixelPoint p = stage.cut->view.project(point.position);
        return cap_substance(stage.scene, placement, hit, stage.params, {p.x, p.y}, stage.cut->view.height);
    };
    Footprint seen;
    if (!hit.cap && !stage.scene.textures.empty())
        seen = footprint(placement, hit, point.flat_normal, ray.direction, ray.width);
    Substance s = hit.cap ? cap() : substance(stage.scene, placement, hit, tint, seen);
    const Vec3f to_eye = -ray.direction;
    const Vec3f normal = !hit.cap && s.material->normal_texture.texture >= 0
                             ? mapped_normal(stage.scene, placement, hit, point, *s.material, ray.direction, seen)
                             : point.normal;
    Radiance& sum = radiance_[ray.slot];
    if (stage.params.shading == Shading::flat) {
        sum.shown += ray.weight * shade_flat(s, normal, to_eye);
        return;
    }

    const bool body = bends(*s.material);
    // A blended body is seen through by refraction alone; a straight view would be a second image.
    const float coverage = body ? 1.0f : s.coverage;
    const Vec3f weight = ray.weight * coverage;
    const bool inside = body && !point.front;
    if (inside) s.f0 = {0, 0, 0}; // what it mirrors is the path's own business
    const Shaded shaded = shade(stage.lighting, point, normal, to_eye, s, reach, !inside);
    sum.light += weight * shaded.light;
    sum.shown += weight * shaded.shown;

    PathRay next = ray;
    ++next.bounce;
    if (largest(shaded.mirror) > 0) {
        next.origin = point.start;
        next.direction = reflect(ray.direction, normal);
        // A bent normal can send the ray into the surface: keep it grazing.
        const float above = dot(next.direction, point.flat_normal);
        if (above < 0.01f) next.direction = normalize(next.direction + point.flat_normal * (0.01f - above));
        next.weight = weight * shaded.mirror;
        next.roughness = s.roughness;
        next.widening = widened(ray, hit, placement, 2);
        next.through = false;
        if (largest(next.weight) < least_weight(next))
            end_in_surroundings(next);
        else
            push(next);
        next = ray;
        ++next.bounce;
    }
    if (coverage < 1.0f) {
        next.origin = point.beyond;
        next.weight = ray.weight * (1.0f - coverage);
        push(next);
    }
    if (s.transmission > 0) pass_through(ray, hit, s, point, normal, weight * s.transmission, body);
}

void Shader::pass_through(const PathRay& ray, const Hit& hit, const Substance& s, const SurfacePoint& point,
                          Vec3f normal, Vec3f weight, bool body) {
    const Scene& scene = stage_->scene;
    const float cosine = dot(normal, -ray.direction);
    PathRay next = ray;
    ++next.bounce;
    next.origin = point.beyond;
    if (body) next.widening = widened(ray, hit, stage_->placements[index(hit.part)], 1);
    // Only the first surface spreads the ray: one blur stands for both sides.
    const int spread = !ray.spread && ray.through && is_frosted(s) ? (averaged_ ? kSpreadAveraged : kSpread) : 1;
    next.spread |= spread > 1;
    const auto facet = [&](int i) {
        if (spread == 1) return normal;
        const int n = spread * kCellPixels;
        return facet_normal(normal, s.roughness * s.roughness, i * kCellPixels + ray.pattern % kCellPixels, n);
    };
    if (!body) {
        const float mirrored = fresnel_dielectric(cosine, std::max(1.0f, s.material->ior));
        next.weight = weight * surface_tint(s, false) * ((1.0f - mirrored) / float(spread));
        for (int i = 0; i < spread; ++i) {
            next.pattern = ray.pattern + i;
            // A sheet sends on what its facets would mirror, to the other side.
            if (spread > 1) {
                const Vec3f r = reflect(ray.direction, facet(i));
                next.direction = r - normal * (2.0f * std::max(0.0f, dot(r, normal)));
            }
            push(next);
        }
        return;
    }
    const auto material = std::int32_t(s.material - scene.materials.data());
    if (point.front)
        next.media.enter(material);
    else
        next.media.leave(material);
    const auto ior = [&](const Media& media) {
        const std::int32_t m = media.innermost();
        return m == kNone ? 1.0f : std::max(1.0f, scene.materials[std::size_t(m)].ior);
    };
    const float eta = ior(next.media) / ior(ray.media);
    const float mirrored = fresnel_dielectric(cosine, eta);
    const auto direction = refract(ray.direction, normal, eta);
    next.weight = weight * surface_tint(s, true) * ((1.0f - mirrored) / float(spread));
    for (int i = 0; i < spread && direction; ++i) {
        next.pattern = ray.pattern + i;
        next.direction = refract(ray.direction, facet(i), eta).value_or(*direction);
        push(next);
    }
    if (point.front) return; // the outside's mirror image is in shade()
    next = ray;
    ++next.bounce;
    next.origin = point.start;
    next.widening = widened(ray, hit, stage_->placements[index(hit.part)], 2);
    next.direction = reflect(ray.direction, normal);
    next.weight = direction ? weight * mirrored : weight;
    push(next);
}

void Shader::finish() {
    // The oldest first: what one sample gathers is added in the order of its own bounces, whichever
    // samples are in the batch beside it, so that its sum has the same bits.
    constexpr std::size_t kSpent = 4096;
    while (oldest_ < queue_.size()) {
        trace_oldest();
        if (oldest_ < kSpent || 2 * oldest_ < queue_.size()) continue;
        queue_.erase(queue_.begin(), queue_.begin() + std::ptrdiff_t(oldest_));
        oldest_ = 0;
    }
    queue_.clear();
    oldest_ = 0;
}

void Shader::trace_oldest() {
    const Stage& stage = *stage_;
    const std::size_t n = std::min<std::size_t>(queue_.size() - oldest_, kLanes);
    std::array<PathRay, kLanes> rays;
    std::copy_n(queue_.begin() + std::ptrdiff_t(oldest_), n, rays.begin());
    oldest_ += n;

    const bool cuts = stage.cut && !stage.cut->empty();
    RayHit16 packet, open;
    bool any_plain = false;
    for (int i = 0; i < kLanes; ++i) {
        const PathRay& ray = rays[std::size_t(i)];
        packet.clear(i);
        if (std::size_t(i) >= n) continue;
        ++(ray.through ? rays_->refraction : rays_->reflection);
        if (cuts && ray.in_hole) {
            open.set(i, ray.origin, ray.direction, 0, kInfinity, kMaskEverything);
            intersect_cut(stage.bvh, open, i, stage.cut);
        } else {
            packet.set(i, ray.origin, ray.direction, 0, kInfinity);
            any_plain = true;
        }
    }
    if (any_plain) intersect(stage.bvh, packet, Coherence::incoherent);

    std::array<Hit, kLanes> hit;
    std::array<SurfacePoint, kLanes> surface;
    std::array<Asker, kLanes> askers[2]; ///< of samples that stand alone, and of those that are averaged
    std::size_t asking[2] = {0, 0};
    constexpr int kLit = 2 * kLanes;
    std::array<int, kLanes> asker_of; ///< -1: nothing to shade
    for (int i = 0; i < int(n); ++i) {
        PathRay& ray = rays[std::size_t(i)];
        asker_of[std::size_t(i)] = -1;
        const RayHit16& from = cuts && ray.in_hole ? open : packet;
        if (!from.hit(i)) {
            end_in_surroundings(ray);
            continue;
        }
        ray.width += ray.widening * from.tfar[i];
        const std::int32_t medium = ray.media.innermost();
        if (medium != kNone)
            ray.weight = ray.weight * absorption(stage.scene.materials[std::size_t(medium)], from.tfar[i]);
        if (largest(ray.weight) < least_weight(ray)) continue;
        Hit& h = hit[std::size_t(i)];
        h = hit_of(stage.bvh, from, i);
        const Placement& placement = stage.placements[index(h.part)];
        SurfacePoint& p = surface[std::size_t(i)];
        p = h.cap ? cap_mesh_point(from, i) : surface_point(placement, h, ray.direction);
        const Material& m = stage.scene.materials[placement.mesh->material_of(h.triangle)];
        // Clear glass has no matte layer that shadows could fall on.
        const bool clear = m.transmission > 0.99f && m.transmission_texture.texture < 0;
        asker_of[std::size_t(i)] = kLit; // shaded as fully lit
        if (m.unlit || clear) continue;
        // Sixteen of the spread ones make one sample.
        const int averaged = averaged_ || ray.spread ? 1 : 0;
        asker_of[std::size_t(i)] = averaged * kLanes + int(asking[averaged]);
        askers[averaged][asking[averaged]++] = {p.position, p.start, p.flat_normal, p.normal, ray.in_hole, ray.pattern};
    }
    std::array<Reach, kLit + 1> reach;
    for (const int averaged : {0, 1})
        reach_of(std::span(askers[averaged].data(), asking[averaged]), averaged != 0, reach.data() + averaged * kLanes);
    reach[kLit] = {};
    for (std::size_t i = 0; i < n; ++i)
        if (asker_of[i] >= 0) add(rays[i], hit[i], surface[i], reach[std::size_t(asker_of[i])], false);
}

void Shader::reach_of(std::span<const Asker> points, bool averaged, Reach* reach) {
    const Occlusion& occlusion = stage_->occlusion;
    if (!averaged) {
        for (std::size_t i = 0; i < points.size(); ++i) reach[i] = occlusion.reach(points[i], *rays_);
        return;
    }
    if (points.empty()) return;
    std::array<Vec3f, kLanes> lamps;
    std::array<Occlusion::Ambient, kLanes> ambient;
    occlusion.lamps(points, 1, lamps.data(), *rays_);
    occlusion.ambient(points, ambient.data(), *rays_);
    for (std::size_t i = 0; i < points.size(); ++i) reach[i] = {lamps[i], ambient[i].share()};
}

} // namespace porthole
