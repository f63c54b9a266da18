#include "porthole/check_dense.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <mutex>

namespace porthole {

namespace {

constexpr std::int64_t kThinPixels = 16;

struct Surface {
    float depth = 0;
    PartId part = kNoPart;
};
using Surfaces = std::vector<Surface>; ///< along one ray, nearest first

/// Everything that rays through some points of the picture cross.
struct Look {
    std::array<Surfaces, kLanes> surfaces;

    template <typename Position> void through(const Bvh& bvh, const View& view, int count, Position&& position) {
        RayHit16 rays;
        std::array<float, kLanes> depth_per_t{};
        for (int i = 0; i < kLanes; ++i) {
            surfaces[std::size_t(i)].clear();
            if (i >= count) {
                rays.clear(i);
                continue;
            }
            const Vec2f p = position(i);
            const Ray ray = view.ray(p.x, p.y);
            rays.set(i, ray.origin, ray.direction, 0, kInfinity);
            depth_per_t[std::size_t(i)] = ray.depth_per_t;
        }
        for_each_crossing(bvh, rays, [&](const Crossing& c) {
            surfaces[std::size_t(c.lane)].push_back({c.t * depth_per_t[std::size_t(c.lane)], c.part});
        });
        for (Surfaces& s : surfaces)
            std::sort(s.begin(), s.end(), [](const Surface& a, const Surface& b) {
                return a.depth < b.depth || (a.depth == b.depth && a.part < b.part);
            });
    }
    [[nodiscard]] std::int64_t crossings() const {
        std::int64_t n = 0;
        for (const Surfaces& s : surfaces) n += std::int64_t(s.size());
        return n;
    }
};

/// The pixels that the part's vertices project to and two around; `all` if it reaches behind the eye.
Rect projected_box(const Scene& scene, PartId id, const View& view, Rect all) {
    const Part& part = scene.parts[index(id)];
    const Mesh& mesh = scene.meshes[part.mesh];
    if (mesh.positions.empty()) return all; // a primitive
    double x0 = 1e9, y0 = 1e9, x1 = -1e9, y1 = -1e9;
    for (const Vec3f& p : mesh.positions) {
        const PixelPoint q = view.project(Vec3f(part.world_from_mesh.point(Vec3d(p))));
        if (!(q.depth > 1e-6f) && !view.orthographic) return all;
        x0 = std::min(x0, double(q.x)), x1 = std::max(x1, double(q.x));
        y0 = std::min(y0, double(q.y)), y1 = std::max(y1, double(q.y));
    }
    const auto clamped = [](double v) { return std::int32_t(std::floor(std::clamp(v, -1e6, 1e6))); };
    return Rect{clamped(x0) - 2, clamped(y0) - 2, clamped(x1) + 3, clamped(y1) + 3}.intersected(all);
}

class DensePass {
public:
    DensePass(const Subject& subject, const ViewPlan& plan, const Control& control)
        : subject_(subject), plan_(plan), view_(plan.view), control_(control),
          target_index_(subject.scene().parts.size(), -1), opened_(subject.scene().parts.size(), 0) {
        for (std::size_t i = 0; i < subject.targets.size(); ++i)
            target_index_[index(subject.targets[i])] = std::int32_t(i);
        for (const PartId id : plan.opened) opened_[index(id)] = 1;
    }

    DenseView run() {
        for (const PartId id : subject_.targets) dense_.targets.push_back(look_at_target(id));
        find_nearest_targets();
        look_at_picture();
        for (DenseTarget& target : dense_.targets)
            if (target.thin) look_at_thin(target);
        return std::move(dense_);
    }

private:
    DenseTarget look_at_target(PartId id) {
        DenseTarget target;
        target.part = id;
        const std::array<PartId, 1> one{id};
        const Bvh bvh = build_bvh(*subject_.meshes, one);
        const Rect box = projected_box(subject_.scene(), id, view_, plan_.whole);
        target.depth = Image<float>(box, kInfinity);
        const auto trace = [&](bool fine) {
            parallel_for(box.empty() ? 0 : std::size_t(box.height()), control_, [&](std::size_t row) {
                const int y = box.y0 + int(row), step = fine ? 1 : kLanes;
                Look look;
                std::int64_t samples = 0, crossings = 0;
                for (int x = box.x0; x < box.x1; x += step) {
                    const int count = fine ? kLanes : std::min(kLanes, box.x1 - x);
                    look.through(bvh, view_, count, [&](int i) {
                        return fine ? fine_position(x, y, i) : Vec2f{float(x + i) + 0.5f, float(y) + 0.5f};
                    });
                    crossings += look.crossings();
                    for (int i = 0; i < count; ++i) {
                        const Surfaces& s = look.surfaces[std::size_t(i)];
                        if (s.empty()) continue;
                        float& depth = target.depth(fine ? x : x + i, y);
                        depth = std::min(depth, s[0].depth);
                        samples += view_.window().contains(fine ? x : x + i, y);
                    }
                }
                const std::lock_guard lock(mutex_);
                target.samples += samples;
                dense_.rays += std::int64_t(box.width()) * (fine ? kLanes : 1);
                dense_.crossings += crossings;
            });
        };
        trace(false);
        const auto hits = std::count_if(target.depth.pixels().begin(), target.depth.pixels().end(),
                                        [](float depth) { return depth < kInfinity; });
        if (hits < kThinPixels) {
            target.thin = true;
            target.samples = 0;
            // Pixel centres stay in `depth`: the group is traced there as well.
            Image<float> centres = target.depth;
            std::fill(target.depth.pixels().begin(), target.depth.pixels().end(), kInfinity);
            trace(true);
            centres_.emplace_back(id, std::move(centres));
        }
        for (int y = box.y0; y < box.y1; ++y)
            for (int x = box.x0; x < box.x1; ++x)
                target.pixels_alone += view_.window().contains(x, y) && target.depth(x, y) < kInfinity;
        return target;
    }

    void find_nearest_targets() {
        dense_.nearest = IdBuffer(plan_.whole);
        dense_.tied = Mask(plan_.whole, 0);
        const auto add = [&](PartId part, const Image<float>& depths) {
            const Rect box = depths.window();
            for (int y = box.y0; y < box.y1; ++y)
                for (int x = box.x0; x < box.x1; ++x) {
                    const float depth = depths(x, y);
                    PartId& id = dense_.nearest.id(x, y);
                    float& least = dense_.nearest.depth(x, y);
                    if (depth < least)
                        id = part, least = depth, dense_.tied(x, y) = 0;
                    else if (depth == least && depth < kInfinity && id != part)
                        dense_.tied(x, y) = 1;
                }
        };
        for (const DenseTarget& target : dense_.targets)
            if (opened_[index(target.part)]) add(target.part, target.depth);
        for (const auto& [part, centres] : centres_)
            if (opened_[index(part)]) add(part, centres);
        for (DenseTarget& target : dense_.targets) {
            const Rect box = target.depth.window().intersected(view_.window());
            for (int y = box.y0; y < box.y1; ++y)
                for (int x = box.x0; x < box.x1; ++x) {
                    target.among += dense_.nearest.id(x, y) == target.part;
                    target.among_tied |= dense_.tied(x, y) && target.depth(x, y) == dense_.nearest.depth(x, y);
                }
        }
    }

    /// Whether the surface is gone at the centre of a pixel, by the definition of the cut.
    [[nodiscard]] bool gone(int x, int y, const Surface& s) const {
        const Cut& cut = plan_.cut;
        const CutRole role = cut.role[index(s.part)];
        if (role == CutRole::fixed || cut.distance.at_or(x, y, 1.0f) > 0) return false;
        const float px = float(x) + 0.5f, py = float(y) + 0.5f;
        const float depth =
            role == CutRole::loose ? cut.loose_depth_at(px, py) : cut.depth_at(px, py, cut.level_of(s.part)).depth;
        return s.depth < depth;
    }

    /// What is left of `surfaces` at the centre of a pixel.
    [[nodiscard]] Surfaces left(int x, int y, const Surfaces& surfaces) const {
        if (plan_.cut.empty()) return surfaces;
        const auto first = std::find_if(surfaces.begin(), surfaces.end(),
                                        [&](const Surface& s) { return opened_[index(s.part)] != 0; });
        const float target = first == surfaces.end() ? kInfinity : first->depth;
        // What touches a target counts as behind it.
        const float rounding = 8 * std::numeric_limits<float>::epsilon() * target;
        const float limit = target - std::max(subject_.tolerance(), rounding);
        Surfaces result;
        for (const Surface& s : surfaces) {
            if (gone(x, y, s)) continue;
            if (target < kInfinity && !opened_[index(s.part)] && !(s.depth < limit)) continue;
            result.push_back(s);
        }
        return result;
    }

    struct Tally {
        std::vector<DenseCount> before, after, among;
        std::int64_t rays = 0, crossings = 0, tied = 0;
    };

    /// Counts the target that the nearest of `surfaces` shows. @return whether it was in doubt.
    bool count(const Surfaces& surfaces, std::vector<DenseCount>& counts, PartId only = kNoPart) const {
        if (surfaces.empty()) return false;
        const bool sure = std::all_of(surfaces.begin(), surfaces.end(), [&](const Surface& s) {
            return s.depth > surfaces[0].depth || s.part == surfaces[0].part;
        });
        bool doubt = false;
        PartId last = kNoPart;
        for (const Surface& s : surfaces) {
            if (s.depth > surfaces[0].depth) break;
            const std::int32_t target = target_index_[index(s.part)];
            if (target < 0 || s.part == last || (only != kNoPart && s.part != only)) continue;
            last = s.part;
            ++counts[std::size_t(target)].most;
            counts[std::size_t(target)].least += sure;
            doubt |= !sure;
        }
        return doubt;
    }

    void look_at_picture() {
        const Rect picture = view_.window();
        const std::size_t n = dense_.targets.size();
        dense_.before = dense_.after = Mask(picture, 0);
        parallel_for(std::size_t(picture.height()), control_, [&](std::size_t row) {
            const int y = int(row);
            Tally tally{std::vector<DenseCount>(n), std::vector<DenseCount>(n), std::vector<DenseCount>(n)};
            Look look;
            for (int x0 = 0; x0 < picture.x1; x0 += kLanes) {
                const int count_x = std::min(kLanes, picture.x1 - x0);
                look.through(subject_.whole, view_, count_x, [&](int i) {
                    return Vec2f{float(x0 + i) + 0.5f, float(y) + 0.5f};
                });
                tally.rays += count_x;
                tally.crossings += look.crossings();
                for (int i = 0; i < count_x; ++i) {
                    const int x = x0 + i;
                    const Surfaces& all = look.surfaces[std::size_t(i)];
                    const Surfaces open = left(x, y, all);
                    dense_.before(x, y) = !all.empty();
                    dense_.after(x, y) = !open.empty();
                    bool doubt = count(all, tally.before);
                    doubt |= count(open, tally.after);
                    const PartId nearest = dense_.nearest.id(x, y);
                    if (nearest != kNoPart) (void)count(open, tally.among, nearest);
                    tally.tied += doubt;
                }
            }
            add(tally);
        });
    }

    /// A thin target's sub-pixel samples: in front of one all that may be cut is gone.
    void look_at_thin(DenseTarget& target) {
        const Rect box = target.depth.window().intersected(view_.window());
        const auto own = std::size_t(target_index_[index(target.part)]);
        std::vector<DenseCount> before(dense_.targets.size()), after = before;
        Look alone, all;
        const std::array<PartId, 1> one{target.part};
        const Bvh bvh = build_bvh(*subject_.meshes, one);
        for (int y = box.y0; y < box.y1; ++y)
            for (int x = box.x0; x < box.x1; ++x) {
                if (!(target.depth(x, y) < kInfinity)) continue;
                const auto position = [&](int i) { return fine_position(x, y, i); };
                alone.through(bvh, view_, kLanes, position);
                all.through(subject_.whole, view_, kLanes, position);
                dense_.rays += 2 * kLanes;
                dense_.crossings += alone.crossings() + all.crossings();
                for (std::size_t i = 0; i < kLanes; ++i) {
                    if (alone.surfaces[i].empty()) continue;
                    Surfaces& s = all.surfaces[i];
                    (void)count(s, before, target.part);
                    std::erase_if(s, [&](const Surface& a) { return subject_.roles[index(a.part)] != CutRole::fixed; });
                    (void)count(s, after, target.part);
                }
            }
        target.before = before[own];
        target.after = opened_[index(target.part)] ? after[own] : before[own];
    }

    void add(const Tally& tally) {
        const std::lock_guard lock(mutex_);
        const auto plus = [](DenseCount& a, const DenseCount& b) { a.least += b.least, a.most += b.most; };
        for (std::size_t i = 0; i < dense_.targets.size(); ++i) {
            plus(dense_.targets[i].before, tally.before[i]);
            plus(dense_.targets[i].after, tally.after[i]);
            plus(dense_.targets[i].after_among, tally.among[i]);
        }
        dense_.rays += tally.rays;
        dense_.crossings += tally.crossings;
        dense_.tied_pixels += tally.tied;
    }

    const Subject& subject_;
    const ViewPlan& plan_;
    const View& view_;
    const Control& control_;
    std::vector<std::int32_t> target_index_;               ///< by part: place in Subject::targets, or -1
    std::vector<std::uint8_t> opened_;                     ///< by part
    std::vector<std::pair<PartId, Image<float>>> centres_; ///< of thin targets: depths at pixel centres
    DenseView dense_;
    std::mutex mutex_;
};

/// `mask` and the background that it encloses.
Mask filled(const Mask& mask) {
    const Rect w = mask.window();
    Mask outside(w, 0);
    std::vector<Vec2i> open;
    const auto visit = [&](int x, int y) {
        if (!w.contains(x, y) || mask(x, y) || outside(x, y)) return;
        outside(x, y) = 1;
        open.push_back({x, y});
    };
    for (int x = w.x0; x < w.x1; ++x) visit(x, w.y0), visit(x, w.y1 - 1);
    for (int y = w.y0; y < w.y1; ++y) visit(w.x0, y), visit(w.x1 - 1, y);
    while (!open.empty()) {
        const Vec2i p = open.back();
        open.pop_back();
        visit(p.x - 1, p.y), visit(p.x + 1, p.y), visit(p.x, p.y - 1), visit(p.x, p.y + 1);
    }
    for (std::uint8_t& v : outside.pixels()) v = !v;
    return outside;
}

} // namespace

Mask DenseTarget::alone() const {
    Mask mask(depth.window(), 0);
    for (std::size_t i = 0; i < mask.pixels().size(); ++i) mask.pixels()[i] = depth.pixels()[i] < kInfinity;
    return mask;
}

DenseView look_densely(const Subject& subject, const ViewPlan& plan, const Control& control) {
    return DensePass(subject, plan, control).run();
}

double dense_outline_iou(const Mask& before, const Mask& after) {
    const Mask a = filled(before), b = filled(after);
    std::int64_t both = 0, any = 0;
    for (std::size_t i = 0; i < a.pixels().size(); ++i) {
        both += a.pixels()[i] && b.pixels()[i];
        any += a.pixels()[i] || b.pixels()[i];
    }
    return any == 0 ? 1.0 : double(both) / double(any);
}

} // namespace porthole
