#include "porthole/crumbs.h"

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <limits>
#include <map>

#include "porthole/render/primary.h"

namespace porthole {

namespace {

constexpr float kSidePx = 5, kSide = 0.011f; ///< the latter of the picture's height
constexpr int kReach = 2;                    ///< pixels closer together belong together
constexpr int kRounds = 2;
constexpr float kThickest = 4; ///< sides

float side_px(const View& view) { return std::max(kSidePx, kSide * float(view.height)); }

/// What the picture shows at pixel centres of the hole.
struct Look {
    Image<PartId> part; ///< kNoPart: nothing, or not in the hole
    Image<float> depth; ///< +infinity likewise
};

struct Tracing {
    const Subject& subject;
    const Bvh& opened;
    const Bvh& targets;
    const Control& control;
};

/// Looks at the pixels of `where` again.
void look_at(const Tracing& t, ViewPlan& plan, const Caps* caps, const Mask& where, Look& look) {
    const Camera camera(t.opened, &t.targets, plan.view, &plan.cut, caps);
    std::atomic<std::int64_t> traced{0};
    parallel_for_tiles(where.window(), 64, t.control, [&](Rect tile) {
        RayCounts rays;
        for (int by = tile.y0 >> 2; 4 * by < tile.y1; ++by)
            for (int bx = tile.x0 >> 2; 4 * bx < tile.x1; ++bx) {
                Samples16 samples;
                samples.at_centres = true;
                bool any = false;
                for (int i = 0; i < kLanes; ++i) {
                    const int x = 4 * bx + i % 4, y = 4 * by + i / 4;
                    samples.x[i] = float(x) + 0.5f, samples.y[i] = float(y) + 0.5f;
                    samples.active[i] = samples.may_open[i] = tile.contains(x, y) && where(x, y);
                    any |= samples.active[i];
                }
                if (!any) continue;
                const Seen16 seen = camera.trace(samples, rays);
                for (int i = 0; i < kLanes; ++i) {
                    if (!samples.active[i]) continue;
                    const int x = 4 * bx + i % 4, y = 4 * by + i / 4;
                    look.part(x, y) = seen.hit[i].part, look.depth(x, y) = seen.depth[i];
                }
            }
        traced += rays.primary;
    });
    plan.rays.caps += traced;
}

/// Pixels of one part, no two groups of them within kReach.
struct Piece {
    PartId part = kNoPart;
    std::vector<Vec2i> pixels;
    std::vector<float> far_side; ///< depth, by pixel
};

/// The small pieces of the cut set that keep away from the rim and the picture's edge, in scan order.
std::vector<Piece> small_pieces(const ViewPlan& plan, const Look& look) {
    const Rect w = look.part.window();
    const float most = crumb_area_px(plan.view);
    Mask done(w, 0);
    std::vector<Piece> pieces;
    std::vector<Vec2i> found;
    for (int y0 = w.y0; y0 < w.y1; ++y0)
        for (int x0 = w.x0; x0 < w.x1; ++x0) {
            const PartId part = look.part(x0, y0);
            if (part == kNoPart || done(x0, y0) || plan.cut.role[index(part)] != CutRole::cut_set) continue;
            bool inside = true;
            found.assign(1, {x0, y0});
            done(x0, y0) = 1;
            for (std::size_t i = 0; i < found.size(); ++i)
                for (int dy = -kReach; dy <= kReach; ++dy)
                    for (int dx = -kReach; dx <= kReach; ++dx) {
                        const int x = found[i].x + dx, y = found[i].y + dy;
                        if (!w.contains(x, y) || plan.cut.distance.at_or(x, y, 1.0f) > 0) {
                            inside = false;
                        } else if (look.part(x, y) == part && !done(x, y)) {
                            done(x, y) = 1;
                            found.push_back({x, y});
                        }
                    }
            if (inside && float(found.size()) < most) pieces.push_back({part, found, {}});
        }
    return pieces;
}

/// Finds how far back the piece reaches behind what is seen of it.
void find_far_side(const Tracing& t, ViewPlan& plan, const Look& look, const Bvh& part, Piece& piece) {
    const View& view = plan.view;
    for (std::size_t begin = 0; begin < piece.pixels.size(); begin += kLanes) {
        RayHit16 packet;
        float depth_per_t[kLanes];
        const std::size_t n = std::min<std::size_t>(kLanes, piece.pixels.size() - begin);
        for (std::size_t i = 0; i < kLanes; ++i) {
            packet.clear(int(i));
            if (i >= n) continue;
            const Vec2i p = piece.pixels[begin + i];
            const Ray ray = view.ray(float(p.x) + 0.5f, float(p.y) + 0.5f);
            depth_per_t[i] = ray.depth_per_t;
            packet.set(int(i), ray.origin, ray.direction, look.depth(p.x, p.y) / ray.depth_per_t, kInfinity);
        }
        std::array<std::vector<float>, kLanes> met;
        for_each_crossing(part, packet,
                          [&](const Crossing& c) { met[std::size_t(c.lane)].push_back(c.t * depth_per_t[c.lane]); });
        for (std::size_t i = 0; i < n; ++i) {
            const Vec2i p = piece.pixels[begin + i];
            const float seen = look.depth(p.x, p.y);
            const float gap = side_px(view) * view.pixel_size(seen);
            float last = seen;
            std::sort(met[i].begin(), met[i].end());
            for (const float depth : met[i]) {
                if (depth - last > gap) break;
                last = depth;
            }
            // What the ray is in, it has to leave.
            const bool solid = plan.cut.cap_of(piece.part) != CapRule::none;
            const bool leaves = !solid || (!met[i].empty() && last > seen + t.subject.tolerance());
            piece.far_side.push_back(leaves && last - seen <= kThickest * gap ? last : kInfinity);
        }
        plan.rays.caps += std::int64_t(n);
    }
}

/// Whether one sees past the piece at over half of the pixels beside it.
bool floats(const View& view, const Look& look, const Piece& piece, Image<std::int32_t>& mark, std::int32_t own) {
    for (const Vec2i p : piece.pixels) mark(p.x, p.y) = own;
    int past = 0, beside = 0;
    for (std::size_t i = 0; i < piece.pixels.size(); ++i) {
        const Vec2i p = piece.pixels[i];
        const float far_side = piece.far_side[i];
        if (far_side == kInfinity) return false;
        for (int dy = -1; dy <= 1; ++dy)
            for (int dx = -1; dx <= 1; ++dx) {
                if (mark(p.x + dx, p.y + dy) == own) continue;
                ++beside;
                past += look.depth(p.x + dx, p.y + dy) > far_side + view.pixel_size(far_side);
            }
    }
    return 2 * past > beside;
}

std::vector<Piece> find_crumbs(const Tracing& t, ViewPlan& plan, const Look& look) {
    std::vector<Piece> crumbs;
    std::map<PartId, Bvh> parts;
    Image<std::int32_t> mark(look.part.window(), -1);
    for (Piece& piece : small_pieces(plan, look)) {
        auto bvh = parts.find(piece.part);
        if (bvh == parts.end())
            bvh = parts.emplace(piece.part, build_bvh(*t.subject.meshes, std::array{piece.part})).first;
        find_far_side(t, plan, look, bvh->second, piece);
        if (floats(plan.view, look, piece, mark, std::int32_t(crumbs.size()))) crumbs.push_back(std::move(piece));
    }
    return crumbs;
}

/// Whether a target beside the piece is nearer than its far side.
bool reaches_behind_target(const ViewPlan& plan, const Piece& piece) {
    for (std::size_t i = 0; i < piece.pixels.size(); ++i)
        for (int dy = -kReach; dy <= kReach; ++dy)
            for (int dx = -kReach; dx <= kReach; ++dx) {
                const int x = piece.pixels[i].x + dx, y = piece.pixels[i].y + dy;
                if (plan.target_ids.id.at_or(x, y, kNoPart) == kNoPart) continue;
                if (plan.target_ids.depth(x, y) <= piece.far_side[i]) return true;
            }
    return false;
}

/// `profile` with a depth of at least `depth` at a point `inside` the rim.
CutProfile deepened(CutProfile profile, float inside, float depth) {
    profile.start = std::min(profile.start, inside);
    const float r = inside - profile.start;
    profile.floor = std::max(profile.floor, depth);
    // The chamfer keeps its slope, so that between pixels the depth runs from one to the other.
    if (r < profile.width) profile.front = std::max(profile.front, depth - profile.slope * r);
    return profile;
}

/// Cuts behind the piece, and as deep around it where that takes nothing that is seen there, for
/// samples beside the pixels' centres.
/// @return the pixels that changed and their profiles before.
struct Change {
    Vec2i pixel;
    CutProfile profile;
    float loose_depth;
};
std::vector<Change> cut_behind(const Tracing& t, ViewPlan& plan, const Look& look, const Piece& piece) {
    std::vector<Change> changes;
    CutLevel& level = plan.cut.levels[plan.cut.level_of(piece.part)];
    const auto deepen = [&](int x, int y, float far_side) {
        const float slack =
            std::max(t.subject.tolerance(), 16 * std::numeric_limits<float>::epsilon() * std::abs(far_side));
        CutProfile& profile = level(x, y);
        changes.push_back({{x, y}, profile, plan.cut.loose_depth(x, y)});
        profile = deepened(profile, -plan.cut.distance(x, y), far_side + 2 * slack);
        plan.cut.loose_depth(x, y) = std::max(plan.cut.loose_depth(x, y), far_side);
    };
    for (std::size_t i = 0; i < piece.pixels.size(); ++i) {
        const Vec2i p = piece.pixels[i];
        const float far_side = piece.far_side[i], past = far_side + plan.view.pixel_size(far_side);
        deepen(p.x, p.y, far_side);
        for (int dy = -1; dy <= 1; ++dy)
            for (int dx = -1; dx <= 1; ++dx) {
                const int x = p.x + dx, y = p.y + dy;
                const bool free = look.part(x, y) != piece.part && look.depth(x, y) > past &&
                                  look.depth(x, y) < kInfinity && plan.target_ids.id.at_or(x, y, kNoPart) == kNoPart;
                if (free) deepen(x, y, far_side);
            }
    }
    return changes;
}

void undo(ViewPlan& plan, const Piece& piece, const std::vector<Change>& changes) {
    CutLevel& level = plan.cut.levels[plan.cut.level_of(piece.part)];
    for (auto c = changes.rbegin(); c != changes.rend(); ++c) {
        level(c->pixel.x, c->pixel.y) = c->profile;
        plan.cut.loose_depth(c->pixel.x, c->pixel.y) = c->loose_depth;
    }
}

/// Takes away the crumbs that may go.
/// @return the pixels whose cut changed.
Mask take_away(const Tracing& t, ViewPlan& plan, const Look& look, const std::vector<Piece>& crumbs) {
    Mask changed(look.part.window(), 0);
    for (const Piece& piece : crumbs) {
        if (reaches_behind_target(plan, piece)) continue;
        const std::vector<Change> changes = cut_behind(t, plan, look, piece);
        Rect box{changes[0].pixel.x, changes[0].pixel.y, changes[0].pixel.x + 1, changes[0].pixel.y + 1};
        for (const Change& c : changes)
            box = {std::min(box.x0, c.pixel.x), std::min(box.y0, c.pixel.y), std::max(box.x1, c.pixel.x + 1),
                   std::max(box.y1, c.pixel.y + 1)};
        Mask where(box, 0);
        for (const Change& c : changes) where(c.pixel.x, c.pixel.y) = 1;
        Look behind{Image<PartId>(box, kNoPart), Image<float>(box, kInfinity)};
        look_at(t, plan, nullptr, where, behind);
        const bool closed = std::all_of(changes.begin(), changes.end(),
                                        [&](const Change& c) { return behind.part(c.pixel.x, c.pixel.y) != kNoPart; });
        if (!closed) {
            undo(plan, piece, changes);
            continue;
        }
        for (const Change& c : changes) changed(c.pixel.x, c.pixel.y) = 1;
        ++plan.crumbs.removed;
        plan.crumbs.removed_px += std::int64_t(piece.pixels.size());
    }
    return changed;
}

} // namespace

float crumb_area_px(const View& view) { return side_px(view) * side_px(view); }

Caps remove_crumbs(const Subject& subject, ViewPlan& plan, const Bvh& opened, const Bvh& targets,
                   const Control& control) {
    plan.crumbs = {};
    if (plan.cut.empty()) return {};
    const Tracing t{subject, opened, targets, control};
    const auto traced_caps = [&] {
        return trace_caps(opened, plan.cut, plan.solids, plan.target_ids.id, control, &plan.rays.caps);
    };
    Caps caps = traced_caps();
    const Rect box = plan.hole.bounds.intersected(plan.view.window());
    if (box.empty()) return caps;
    Look look{Image<PartId>(box, kNoPart), Image<float>(box, kInfinity)};
    Mask where(box, 0);
    for (int y = box.y0; y < box.y1; ++y)
        for (int x = box.x0; x < box.x1; ++x) where(x, y) = plan.cut.distance(x, y) <= 0;
    for (int round = 0;; ++round) {
        look_at(t, plan, &caps, where, look);
        const std::vector<Piece> crumbs = find_crumbs(t, plan, look);
        const std::int64_t before = plan.crumbs.removed;
        const Mask changed = round < kRounds - 1 ? take_away(t, plan, look, crumbs) : Mask{};
        if (plan.crumbs.removed == before) {
            plan.crumbs.kept = std::int64_t(crumbs.size());
            for (const Piece& piece : crumbs) plan.crumbs.kept_px += std::int64_t(piece.pixels.size());
            break;
        }
        where = changed;
        caps = traced_caps();
    }
    if (plan.crumbs.removed) index_ranges(plan.cut);
    return caps;
}

} // namespace porthole
