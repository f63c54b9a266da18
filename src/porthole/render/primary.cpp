#include "porthole/render/primary.h"

#include "porthole/render/cap.h"
#include "porthole/trace/packet.h"

namespace porthole {

Camera::Camera(const Bvh& bvh, const Bvh* targets, const View& view, const Cut* cut, const Caps* caps)
    : bvh_(&bvh), targets_(targets), view_(&view), cut_(cut), caps_(caps && !caps->empty() ? caps : nullptr) {
    if (!cut) return;
    tolerance_ = float(1e-6 * scene_bounds(bvh.scene()).diagonal());
    for (std::size_t i = 0; i < cut->role.size(); ++i) {
        const CutRole role = cut->role[i];
        has_cut_set_ |= role == CutRole::cut_set;
        has_loose_ |= role == CutRole::loose;
        has_kept_ |= role == CutRole::fixed && !(targets && targets->holds(PartId(i)));
    }
}

namespace {

void store_hit(const RayHit16& rays, int lane, float depth, Seen16& seen) {
    seen.hit[lane] = {rays.part(lane), rays.triangle[lane], rays.u[lane], rays.v[lane]};
    seen.depth[lane] = depth;
}

/// How far two computed depths of one surface may lie apart.
float rounding(float depth) { return 8 * std::numeric_limits<float>::epsilon() * depth; }

} // namespace

Seen16 Camera::trace(const Samples16& samples, RayCounts& rays) const {
    Seen16 seen;
    bool plain[kLanes];
    bool any_open = false;
    for (int i = 0; i < kLanes; ++i) {
        seen.hit[i] = {};
        seen.depth[i] = kInfinity;
        seen.in_hole[i] = seen.on_target[i] = false;
        plain[i] = samples.active[i];
        any_open |= samples.active[i] && samples.may_open[i];
    }
    RayHit16 packet;
    float depth_per_t[kLanes];
    set_rays(packet, depth_per_t, *view_, samples.x, samples.y);
    for (int i = 0; i < kLanes; ++i) {
        if (!samples.active[i]) {
            packet.clear(i);
            continue;
        }
        seen.origin[i] = packet.origin(i);
        seen.direction[i] = packet.direction(i);
    }
    if (any_open && cut_ && !cut_->empty()) {
        trace_open(samples, depth_per_t, seen, plain, rays);
        bool left = false;
        for (int i = 0; i < kLanes; ++i) {
            if (samples.active[i] && !plain[i]) packet.clear(i);
            left |= plain[i];
        }
        if (!left) return seen;
    }
    intersect(*bvh_, packet, Coherence::coherent);
    for (int i = 0; i < kLanes; ++i) {
        if (!plain[i]) continue;
        ++rays.primary;
        if (!packet.hit(i)) continue;
        store_hit(packet, i, packet.tfar[i] * depth_per_t[i], seen);
        seen.on_target[i] = !cut_ && targets_ && targets_->holds(packet.part(i));
    }
    return seen;
}

void Camera::trace_open(const Samples16& samples, const float (&depth_per_t)[kLanes], Seen16& seen,
                        bool (&plain)[kLanes], RayCounts& rays) const {
    float target_depth[kLanes];
    for (float& d : target_depth) d = kInfinity;
    if (targets_ && !targets_->empty()) {
        RayHit16 packet;
        for (int i = 0; i < kLanes; ++i) {
            if (samples.active[i] && samples.may_open[i])
                packet.set(i, seen.origin[i], seen.direction[i], 0, kInfinity);
            else
                packet.clear(i);
        }
        intersect(*targets_, packet, Coherence::coherent);
        for (int i = 0; i < kLanes; ++i) {
            if (!samples.active[i] || !samples.may_open[i]) continue;
            ++rays.primary;
            if (!packet.hit(i)) continue;
            target_depth[i] = packet.tfar[i] * depth_per_t[i];
            store_hit(packet, i, target_depth[i], seen);
            seen.on_target[i] = true;
        }
    }

    float kept[kLanes], loose[kLanes]; // where rays start; +infinity: not at all
    for (int i = 0; i < kLanes; ++i) {
        kept[i] = loose[i] = kInfinity;
        if (!samples.active[i] || !samples.may_open[i]) continue;
        const float x = samples.x[i], y = samples.y[i];
        seen.in_hole[i] = seen.on_target[i] || cut_->distance_at(x, y) <= 0;
        if (!seen.in_hole[i]) continue;
        plain[i] = false;
        kept[i] = 0;
        if (has_loose_) loose[i] = std::max(0.0f, cut_->loose_depth_at(x, y)) / depth_per_t[i];
        // Behind a target the cut set cannot be seen, in front of it nothing is left of it.
        // What lies on the target counts as behind it.
        if (seen.on_target[i]) seen.depth[i] = target_depth[i] - std::max(tolerance_, rounding(target_depth[i]));
    }
    // Where the underside of a cut wall lies on the floor it stood on, the floor is seen.
    if (has_kept_) trace_role(kMaskFixed, kept, depth_per_t, 0, seen, rays);
    LevelLanes levels;
    if (has_cut_set_) find_levels(samples, depth_per_t, seen, levels);
    if (has_loose_) {
        // What lies clearly behind a cap is not seen.
        float end[kLanes];
        for (int i = 0; i < kLanes; ++i) {
            end[i] = kInfinity;
            for (std::size_t k = 0; has_cut_set_ && k < cut_->levels.size(); ++k)
                if (levels.is_capped(k, i))
                    end[i] =
                        std::min(end[i], levels.depth[k][i] + 4 * std::max(tolerance_, rounding(levels.depth[k][i])));
        }
        trace_role(kMaskLoose, loose, depth_per_t, 0, seen, rays, end);
    }
    for (std::size_t k = 0; has_cut_set_ && k < cut_->levels.size(); ++k)
        trace_level(k, levels, depth_per_t, seen, rays);
    for (int i = 0; i < kLanes; ++i)
        if (seen.on_target[i]) seen.depth[i] = target_depth[i];
}

void Camera::find_levels(const Samples16& samples, const float (&depth_per_t)[kLanes], const Seen16& seen,
                         LevelLanes& found) const {
    const std::size_t levels = cut_->levels.size();
    CutLanes& lanes = found.cut;
    RayHit16 packet;
    for (int i = 0; i < kLanes; ++i) {
        for (std::size_t k = 0; k < levels; ++k) lanes.t[k][i] = kInfinity;
        // Behind a target the cut set cannot be seen, in front of it nothing is left of it.
        const bool asks = seen.in_hole[i] && !seen.on_target[i];
        packet.clear(i);
        if (!asks) continue;
        packet.set(i, seen.origin[i], seen.direction[i], 0, kInfinity);
        for (std::size_t k = 0; k < levels; ++k) {
            const CutDepth cut = cut_->depth_at(samples.x[i], samples.y[i], k);
            found.depth[k][i] = cut.depth;
            lanes.t[k][i] = std::max(0.0f, cut.depth) / depth_per_t[i];
            lanes.chamfer[k][i] = cut.chamfer;
        }
    }
    if (!caps_) return;
    // Between pixels whose caps differ every sample has to find its own.
    bool asks[kLanes], any = false;
    for (int i = 0; i < kLanes; ++i) {
        const int x = int(std::floor(samples.x[i])), y = int(std::floor(samples.y[i]));
        asks[i] = false;
        for (std::size_t k = 0; k < levels; ++k) {
            if (!(lanes.t[k][i] < kInfinity)) continue;
            asks[i] |= !samples.at_centres && !caps_->is_even(k, x, y);
            found.caps.cap[k][i] = caps_->at(k, x, y);
        }
        any |= asks[i];
        if (!asks[i]) packet.clear(i);
    }
    if (!any) return;
    const CapLanes own = find_caps(*bvh_, *cut_, *caps_, packet, lanes);
    for (int i = 0; i < kLanes; ++i)
        for (std::size_t k = 0; k < levels && asks[i]; ++k) found.caps.cap[k][i] = own.cap[k][i];
}

void Camera::trace_level(std::size_t k, LevelLanes& levels, const float (&depth_per_t)[kLanes], Seen16& seen,
                         RayCounts& rays) const {
    for (int i = 0; i < kLanes; ++i) {
        if (!levels.is_capped(k, i)) continue;
        const SurfaceRef& cap = levels.caps.cap[k][i];
        // Nothing of the level can be nearer than its own cut.
        levels.cut.t[k][i] = kInfinity;
        const float depth = levels.depth[k][i];
        if (!(depth < seen.depth[i] - std::max(tolerance_, rounding(depth)))) continue;
        seen.hit[i] = {cap.part, cap.triangle, cap.u, cap.v, true};
        seen.depth[i] = depth;
    }
    trace_role(level_mask(k), levels.cut.t[k], depth_per_t, tolerance_, seen, rays);
}

SurfacePoint Camera::surface(const std::vector<Placement>& placements, const Hit& hit, float x, float y, float depth,
                             Vec3f direction) const {
    if (hit.cap) return cap_point(*cut_, cut_->level_of(hit.part), x, y, depth);
    return surface_point(placements[index(hit.part)], hit, direction);
}

void Camera::trace_role(std::uint32_t mask, const float (&tnear)[kLanes], const float (&depth_per_t)[kLanes],
                        float tolerance, Seen16& seen, RayCounts& rays, const float* end) const {
    RayHit16 packet;
    bool any = false;
    for (int i = 0; i < kLanes; ++i) {
        if (tnear[i] < kInfinity) {
            // Beyond what is seen already nothing matters.
            const float until = end ? std::min(end[i], seen.depth[i]) : seen.depth[i];
            packet.set(i, seen.origin[i], seen.direction[i], tnear[i], until / depth_per_t[i], mask);
            any |= packet.active(i);
        } else {
            packet.clear(i);
        }
    }
    if (!any) return;
    intersect(*bvh_, packet, Coherence::coherent);
    for (int i = 0; i < kLanes; ++i) {
        if (!(tnear[i] < kInfinity)) continue;
        ++rays.primary;
        if (!packet.hit(i)) continue;
        const float depth = packet.tfar[i] * depth_per_t[i];
        // Strictly nearer: on a tie the role that was asked earlier stays.
        const float margin = tolerance > 0 ? std::max(tolerance, rounding(depth)) : 0.0f;
        if (!(depth < seen.depth[i] - margin)) continue;
        store_hit(packet, i, depth, seen);
        seen.on_target[i] = false;
    }
}

} // namespace porthole
