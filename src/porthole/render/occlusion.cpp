#include "porthole/render/occlusion.h"

#include "porthole/scene/texture.h"

namespace porthole {

namespace {

constexpr int kDiscPoints = kCellPixels * kLampRays;
constexpr int kLoneLampRays = 4; // of the 16 rays of a lone point
constexpr int kLoneAmbientRays = kLanes - kLoneLampRays;
constexpr float kGrazing = 0.01f;

/// Caps are there for rays that start in the hole.
constexpr std::uint32_t ray_mask(bool in_hole) { return in_hole ? kMaskEverything : kMaskAll; }

} // namespace

Occlusion::Occlusion(const Bvh& bvh, const Cut* cut, const Lighting& lighting, const RenderParams& params)
    : bvh_(&bvh), cut_(cut && !cut->empty() ? cut : nullptr), lighting_(&lighting), shadows_(params.shadows),
      ambient_rays_(std::max(0, params.ao_samples)), tinted_(false), pattern_(ambient_pattern(ambient_rays_)) {
    for (const Material& m : bvh.scene().materials) tinted_ |= passes_light(m);
    for (int i = 0; i < kDiscPoints; ++i) disc_.push_back(disc_point(i, kDiscPoints));
    for (const Lamp& lamp : lighting.lamps) lamp_frames_.emplace_back(lamp.direction);
    // Every fourth of the 64 directions that neighbours would share, stretched to twelve.
    const std::vector<AmbientRay> many = ambient_pattern(3);
    for (int i = 0; i < kLoneAmbientRays; ++i) lone_.push_back(many[std::size_t(i * 4 + 2)]);
}

bool Occlusion::lamp_ray(const Lamp& lamp, std::size_t index, const Asker& p, int pattern, Vec3f& direction,
                         float& tfar, float& weight) const {
    const Incident in = incident(lamp, p.position);
    weight = lamp_weight(in, p.normal);
    if (!(weight > 0)) return false;
    const Vec2f d = disc_[std::size_t(pattern % kDiscPoints)] * lamp.size;
    if (lamp.kind == Light::Kind::directional) {
        const Frame3& f = lamp_frames_[index];
        direction = normalize(in.direction + f.x * d.x + f.y * d.y);
        tfar = kInfinity;
    } else {
        const Frame3 f(in.direction);
        const Vec3f to = lamp.position + f.x * d.x + f.y * d.y - p.start;
        const float distance = length(to);
        direction = normalize(to, in.direction);
        tfar = distance * 0.9999f;
    }
    return true;
}

void Occlusion::lamps(std::span<const Asker> points, int each, Vec3f* shares, RayCounts& rays) const {
    for (std::size_t i = 0; i < points.size(); ++i) shares[i] = {1, 1, 1};
    if (!shadows_) return;
    Vec3f reached[kLanes];
    float all[kLanes] = {};
    for (std::size_t l = 0; l < lighting_->lamps.size() * std::size_t(each); ++l) {
        const std::size_t lamp = l / std::size_t(each);
        // The spiral's inner half, then its outer one.
        const int shift = int(l % std::size_t(each)) * kCellPixels;
        float weight[kLanes] = {};
        Vec3f direction[kLanes];
        float tfar[kLanes] = {};
        bool asks[kLanes] = {};
        bool asks_in[2] = {false, false};
        for (std::size_t i = 0; i < points.size(); ++i) {
            asks[i] = lamp_ray(lighting_->lamps[lamp], lamp, points[i], points[i].pattern + shift, direction[i],
                               tfar[i], weight[i]);
            if (asks[i]) asks_in[points[i].in_hole ? 1 : 0] = true;
        }
        for (const bool in_hole : {false, true}) {
            if (!asks_in[in_hole ? 1 : 0]) continue;
            RayHit16 packet;
            Vec3f tint[kLanes];
            for (int i = 0; i < kLanes; ++i) {
                tint[i] = {1, 1, 1};
                const std::size_t k = std::size_t(i);
                if (k < points.size() && asks[i] && points[k].in_hole == in_hole) {
                    packet.set(i, points[k].start, direction[i], 0, tfar[i], ray_mask(in_hole));
                    ++rays.shadow;
                } else {
                    packet.clear(i);
                }
            }
            float before[kLanes];
            std::copy(packet.tfar, packet.tfar + kLanes, before);
            occluded(*bvh_, packet, in_hole ? cut_ : nullptr, tinted_ ? tint : nullptr);
            for (std::size_t i = 0; i < points.size(); ++i) {
                if (!asks[i] || points[i].in_hole != in_hole) continue;
                if (packet.tfar[i] == before[i]) reached[i] += tint[i] * weight[i];
                all[i] += weight[i];
            }
        }
    }
    for (std::size_t i = 0; i < points.size(); ++i)
        if (all[i] > 0) shares[i] = reached[i] / all[i];
}

void Occlusion::ambient(std::span<const Asker> points, Ambient* sums, RayCounts& rays) const {
    for (std::size_t i = 0; i < points.size(); ++i) sums[i] = {};
    if (ambient_rays_ == 0) return;
    bool any[2] = {false, false};
    for (const Asker& p : points) any[p.in_hole ? 1 : 0] = true;
    for (const bool in_hole : {false, true})
        if (any[in_hole ? 1 : 0]) ambient_group(points, sums, in_hole, rays);
}

void Occlusion::ambient_group(std::span<const Asker> points, Ambient* sums, bool in_hole, RayCounts& rays) const {
    const float radius = in_hole ? lighting_->hole_radius : lighting_->plain_radius;
    RayHit16 packet;
    float weight[kLanes];
    std::size_t asker[kLanes];
    int lanes = 0;
    const auto flush = [&] {
        if (lanes == 0) return;
        for (int i = lanes; i < kLanes; ++i) packet.clear(i);
        occluded(*bvh_, packet, in_hole ? cut_ : nullptr, nullptr);
        for (int i = 0; i < lanes; ++i)
            if (packet.tfar[i] > 0) sums[asker[i]].open += weight[i];
        rays.ambient += lanes;
        lanes = 0;
    };
    // Runs of the same pattern, ray by ray: what is traced together has the same direction.
    for (std::size_t begin = 0; begin < points.size();) {
        std::size_t end = begin + 1;
        while (end < points.size() && points[end].pattern == points[begin].pattern) ++end;
        for (int j = 0; j < ambient_rays_; ++j) {
            const AmbientRay& ray = pattern_[std::size_t(j * kCellPixels + points[begin].pattern % kCellPixels)];
            for (std::size_t k = begin; k < end; ++k) {
                const Asker& p = points[k];
                if (p.in_hole != in_hole) continue;
                const float c = dot(p.normal, ray.axis);
                const Vec3f d = c < 0 ? -ray.axis : ray.axis;
                const float w = std::abs(c);
                if (w < kGrazing || dot(p.flat_normal, d) <= 0) continue;
                sums[k].all += w;
                packet.set(lanes, p.start, d, 0, radius * ray.reach, ray_mask(in_hole));
                weight[lanes] = w;
                asker[lanes] = k;
                if (++lanes == kLanes) flush();
            }
        }
        begin = end;
    }
    flush();
}

Reach Occlusion::reach(const Asker& p, RayCounts& rays) const {
    RayHit16 packet;
    float weight[kLanes];
    Vec3f tint[kLanes];
    int lanes = 0;
    float all_ambient = 0, all_lamps = 0;
    if (ambient_rays_ > 0) {
        const float radius = p.in_hole ? lighting_->hole_radius : lighting_->plain_radius;
        for (const AmbientRay& ray : lone_) {
            const float c = dot(p.normal, ray.axis);
            const Vec3f d = c < 0 ? -ray.axis : ray.axis;
            if (std::abs(c) < kGrazing || dot(p.flat_normal, d) <= 0) continue;
            packet.set(lanes, p.start, d, 0, radius * ray.reach, ray_mask(p.in_hole));
            weight[lanes++] = std::abs(c);
            all_ambient += std::abs(c);
        }
    }
    const int ambient_lanes = lanes;
    if (shadows_) {
        const std::size_t n = lighting_->lamps.size();
        const int each = n == 1 ? kLoneLampRays : 1;
        for (std::size_t l = 0; l < n && l < std::size_t(kLoneLampRays); ++l)
            for (int k = 0; k < each; ++k) {
                Vec3f direction;
                float tfar = 0;
                if (!lamp_ray(lighting_->lamps[l], l, p, k * (kDiscPoints / kLoneLampRays) + 1, direction, tfar,
                              weight[lanes]))
                    continue;
                packet.set(lanes, p.start, direction, 0, tfar, ray_mask(p.in_hole));
                all_lamps += weight[lanes++];
            }
    }
    Reach reach;
    if (lanes == 0) return reach;
    for (int i = 0; i < kLanes; ++i) {
        tint[i] = {1, 1, 1};
        if (i >= lanes) packet.clear(i);
    }
    occluded(*bvh_, packet, p.in_hole ? cut_ : nullptr, tinted_ ? tint : nullptr);
    rays.ambient += ambient_lanes;
    rays.shadow += lanes - ambient_lanes;
    float open = 0;
    Vec3f lit{0, 0, 0};
    for (int i = 0; i < lanes; ++i) {
        if (!(packet.tfar[i] > 0)) continue;
        if (i < ambient_lanes)
            open += weight[i];
        else
            lit += tint[i] * weight[i];
    }
    if (all_ambient > 0) reach.ambient = open / all_ambient;
    if (all_lamps > 0) reach.lamps = lit / all_lamps;
    return reach;
}

} // namespace porthole
