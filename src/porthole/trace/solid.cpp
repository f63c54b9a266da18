#include "porthole/trace/solid.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace porthole {

namespace {

/// Directions without symmetry, so that no two of them run along the faces of one model.
constexpr int kDirections = 5;
const std::array<Vec3f, kDirections> kDirection = {
    normalize(Vec3f{0.5714f, 0.7363f, 0.3625f}), normalize(Vec3f{-0.8127f, 0.2906f, 0.5051f}),
    normalize(Vec3f{0.1873f, -0.6229f, 0.7596f}), normalize(Vec3f{-0.3391f, -0.5477f, -0.7649f}),
    normalize(Vec3f{0.6841f, 0.1987f, -0.7018f})};

struct Crossed {
    float t;
    int sign;
    friend auto operator<=>(const Crossed&, const Crossed&) = default;
};

/// One part alone, for rays from points.
struct Probe {
    Bvh bvh;
    const MeshSolid& solid;
    Bounds3d box; ///< world; around the part, not always tight

    Probe(const MeshBvhs& meshes, std::span<const MeshSolid> solids, PartId id)
        : bvh(build_bvh(meshes, std::array{id})), solid(solids[meshes.scene().parts[index(id)].mesh]) {
        const Part& part = meshes.scene().parts[index(id)];
        const Bounds3f& mesh_box = meshes.scene().meshes[part.mesh].bounds;
        for (int i = 0; i < 8 && !mesh_box.empty(); ++i)
            box.extend(part.world_from_mesh.point(Vec3d(mesh_box.corner(i))));
    }

    [[nodiscard]] bool may_hold(Vec3f p) const {
        return p.x >= box.lower.x && p.y >= box.lower.y && p.z >= box.lower.z && p.x <= box.upper.x &&
               p.y <= box.upper.y && p.z <= box.upper.z;
    }
};

/// What a ray says of the point it starts at.
struct Answer {
    bool inside = false;
    float nearest = kInfinity; ///< distance to the first surface
};

/// Of one direction from up to kLanes points.
std::array<Answer, kLanes> ask(const Probe& probe, std::span<const Vec3f> points, Vec3f direction) {
    std::array<std::vector<Crossed>, kLanes> crossed;
    RayHit16 rays;
    for (int i = 0; i < kLanes; ++i) {
        if (std::size_t(i) < points.size())
            rays.set(i, points[std::size_t(i)], direction, 0, kInfinity);
        else
            rays.clear(i);
    }
    for_each_crossing(probe.bvh, rays, [&](const Crossing& c) {
        const int sign = crossing_sign(probe.solid, c.triangle, c.entering);
        if (sign != 0) crossed[std::size_t(c.lane)].push_back({c.t, sign});
    });
    const auto same_place = float(2e-6 * probe.box.diagonal());
    std::array<Answer, kLanes> out;
    for (std::size_t i = 0; i < points.size(); ++i) {
        std::vector<Crossed>& list = crossed[i];
        std::sort(list.begin(), list.end());
        int left = 0;
        for (std::size_t k = 0; k < list.size();) {
            // A ray through an edge may meet the triangles on both sides of it.
            bool enters = false, leaves = false;
            const float place = list[k].t;
            for (; k < list.size() && list[k].t - place <= same_place; ++k) (list[k].sign < 0 ? enters : leaves) = true;
            left += int(leaves) - int(enters);
        }
        out[i].inside = left > 0;
        if (!list.empty()) out[i].nearest = list.front().t;
    }
    return out;
}

/// Whether each point lies inside, and how deep at most.
std::vector<Answer> find_inside(const Probe& probe, std::span<const Vec3f> points) {
    std::vector<Answer> out(points.size());
    if (!probe.solid.has_material()) return out;
    std::vector<std::uint32_t> chosen; // points still worth a ray
    for (std::uint32_t i = 0; i < points.size(); ++i)
        if (probe.may_hold(points[i])) chosen.push_back(i);

    std::vector<int> votes(points.size(), 0);
    for (int d = 0; d < kDirections; ++d) {
        for (std::size_t first = 0; first < chosen.size(); first += kLanes) {
            const std::size_t n = std::min<std::size_t>(kLanes, chosen.size() - first);
            std::array<Vec3f, kLanes> from;
            for (std::size_t i = 0; i < n; ++i) from[i] = points[chosen[first + i]];
            const std::array<Answer, kLanes> answers = ask(probe, std::span(from).first(n), kDirection[std::size_t(d)]);
            for (std::size_t i = 0; i < n; ++i) {
                Answer& a = out[chosen[first + i]];
                a.nearest = std::min(a.nearest, answers[i].nearest);
                votes[chosen[first + i]] += answers[i].inside;
            }
        }
        // A point that the first ray finds outside is taken to be.
        if (d == 0) std::erase_if(chosen, [&](std::uint32_t i) { return votes[i] == 0; });
    }
    for (std::size_t i = 0; i < points.size(); ++i) out[i].inside = 2 * votes[i] > kDirections;
    return out;
}

/// Points spread evenly over a part's surface, world coordinates.
std::vector<Vec3f> surface_points(const Scene& scene, PartId id, int count) {
    const Part& part = scene.parts[index(id)];
    const Mesh& mesh = scene.meshes[part.mesh];
    const auto corner = [&](std::uint32_t v) { return Vec3d(mesh.positions[v]); };
    const auto area = [&](const Vec3u& t) {
        return length(cross(corner(t.y) - corner(t.x), corner(t.z) - corner(t.x)));
    };
    std::vector<Vec3f> out;
    for (const Vec3d& p : surface_samples(mesh.primitives, count)) out.push_back(Vec3f(part.world_from_mesh.point(p)));
    double all = 0;
    for (const Vec3u& t : mesh.triangles) all += area(t);
    double below = 0;
    for (const Vec3u& t : mesh.triangles) {
        below += area(t);
        while (int(out.size()) < count && (double(out.size()) + 0.5) / count * all < below) {
            // Barycentric coordinates by the plastic number's sequence.
            double u = 0.5 + 0.7548776662466927 * double(out.size()), v = 0.5 + 0.5698402909980532 * double(out.size());
            u -= std::floor(u), v -= std::floor(v);
            if (u + v > 1) u = 1 - u, v = 1 - v;
            const Vec3d p = corner(t.x) * (1 - u - v) + corner(t.y) * u + corner(t.z) * v;
            out.push_back(Vec3f(part.world_from_mesh.point(p)));
        }
    }
    return out;
}

constexpr int kMostPoints = 32, kLeastPoints = 4, kAllPoints = 512;
/// Share of a target's size that it may reach into a solid.
constexpr double kPressFit = 0.02;

} // namespace

std::vector<std::uint8_t> lies_inside(const MeshBvhs& meshes, std::span<const MeshSolid> solids, PartId part,
                                      std::span<const Vec3f> points) {
    std::vector<std::uint8_t> out(points.size());
    const std::vector<Answer> answers = find_inside(Probe(meshes, solids, part), points);
    std::ranges::transform(answers, out.begin(), [](const Answer& a) { return std::uint8_t(a.inside); });
    return out;
}

std::vector<std::uint8_t> find_holders(const MeshBvhs& meshes, std::span<const MeshSolid> solids,
                                       std::span<const PartId> parts, std::span<const PartId> targets,
                                       const Control& control) {
    const Scene& scene = meshes.scene();
    std::vector<std::uint8_t> out(scene.parts.size(), 0), is_target(scene.parts.size(), 0);
    for (const PartId t : targets) is_target[index(t)] = 1;
    const int each = targets.empty() ? 0 : std::clamp(kAllPoints / int(targets.size()), kLeastPoints, kMostPoints);
    std::vector<std::vector<Vec3f>> points(targets.size());
    std::vector<double> size(targets.size());
    parallel_for(targets.size(), control, [&](std::size_t i) {
        points[i] = surface_points(scene, targets[i], each);
        size[i] = part_bounds(scene, targets[i]).diagonal();
    });
    parallel_for(parts.size(), control, [&](std::size_t k) {
        const PartId part = parts[k];
        if (is_target[index(part)] || !solids[scene.parts[index(part)].mesh].has_material()) return;
        const Probe probe(meshes, solids, part);
        for (std::size_t i = 0; i < targets.size() && !out[index(part)]; ++i) {
            std::size_t held = 0;
            for (const Answer& a : find_inside(probe, points[i])) held += a.inside && a.nearest > kPressFit * size[i];
            out[index(part)] = held >= std::min<std::size_t>(2, std::max<std::size_t>(1, points[i].size()));
        }
    });
    return out;
}

std::vector<PartId> find_around_eye(const MeshBvhs& meshes, std::span<const MeshSolid> solids,
                                    std::span<const PartId> parts, const View& view) {
    std::vector<Vec3f> origins{view.eye()};
    if (view.orthographic)
        for (int y = 0; y < 3; ++y)
            for (int x = 0; x < 3; ++x)
                if (x != 1 || y != 1)
                    origins.push_back(view.ray(float(view.width * x) * 0.5f, float(view.height * y) * 0.5f).origin);
    std::vector<PartId> out;
    for (const PartId part : parts) {
        if (!solids[meshes.scene().parts[index(part)].mesh].has_material()) continue;
        const Probe probe(meshes, solids, part);
        if (std::ranges::none_of(origins, [&](Vec3f p) { return probe.may_hold(p); })) continue;
        if (std::ranges::any_of(find_inside(probe, origins), &Answer::inside)) out.push_back(part);
    }
    return out;
}

CapRules classify(const MeshBvhs& meshes, std::span<const MeshSolid> solids, std::span<const PartId> parts,
                  std::span<const std::uint8_t> holders, const View& view, const CapOverrides& overrides) {
    const Scene& scene = meshes.scene();
    CapRules out;
    out.rule.assign(scene.parts.size(), CapRule::none);
    for (const PartId part : parts) {
        const MeshSolid& solid = solids[scene.parts[index(part)].mesh];
        if (!solid.has_material()) {
            out.open.push_back(part);
            continue;
        }
        if (!solid.closed) out.partly_open.push_back(part);
        out.rule[index(part)] = holders[index(part)] ? CapRule::shell : CapRule::solid;
    }
    // An override changes what is capped, never what can be.
    const auto override_with = [&](std::span<const PartId> chosen, CapRule rule) {
        for (const PartId part : chosen)
            if (out.rule[index(part)] != CapRule::none) out.rule[index(part)] = rule;
    };
    override_with(overrides.shell, CapRule::shell);
    override_with(overrides.solid, CapRule::solid);
    out.around_eye = find_around_eye(meshes, solids, parts, view);
    for (const PartId part : out.around_eye) out.rule[index(part)] = CapRule::none;
    return out;
}

} // namespace porthole
