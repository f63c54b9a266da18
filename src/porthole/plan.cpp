#include "porthole/plan.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <unordered_map>

#include "porthole/plan_steps.h"
#include "porthole/trace/coverage.h"

namespace porthole {

namespace {

constexpr int kBeyondBand = 24; ///< pixels around the band that its distances and their smoothing read
constexpr int kThinPixels = 16; ///< fewer pixel centres than this: sub-pixel samples decide

/// Where `part` alone is seen; thin parts by sub-pixel samples.
TargetView view_target(const Subject& subject, const View& view, Rect window, PartId part, const Control& control,
                       std::int64_t& rays) {
    TargetView target;
    target.part = part;
    const std::array<PartId, 1> one{part};
    const Bvh bvh = build_bvh(*subject.meshes, one);
    const BlockMask blocks = mark_blocks(subject.scene(), one, subject.boxes, view, window);
    const Rect box = pixel_rect(blocks, window);
    target.alone = Mask(box, 0);
    if (box.empty()) {
        target.absent = true;
        return target;
    }
    const Coverage seen = cover(bvh, one, subject.boxes, view, window, Doubt::trace, control, &rays);
    const auto count = [&] {
        target.pixels_alone = target.pixels_outside = 0;
        for (int y = box.y0; y < box.y1; ++y)
            for (int x = box.x0; x < box.x1; ++x)
                if (target.alone(x, y)) ++(view.window().contains(x, y) ? target.pixels_alone : target.pixels_outside);
    };
    const Rect in = seen.window.intersected(box);
    for (int y = in.y0; y < in.y1; ++y)
        for (int x = in.x0; x < in.x1; ++x) target.alone(x, y) = seen.hit(x, y);
    count();
    if (target.pixels_alone + target.pixels_outside >= kThinPixels) {
        target.absent = target.pixels_alone == 0;
        return target;
    }
    const FineCoverage fine = trace_fine(bvh, view, box, control, &rays);
    target.thin = true;
    for (int y = box.y0; y < box.y1; ++y)
        for (int x = box.x0; x < box.x1; ++x) {
            target.alone(x, y) = fine.hits(x, y) != 0;
            if (view.window().contains(x, y)) target.fine_samples += std::popcount(fine.hits(x, y));
        }
    count();
    target.absent = target.pixels_alone == 0;
    return target;
}

/// Adds the sub-pixel samples of thin targets to the group's id buffer.
void add_thin_targets(const Subject& subject, const View& view, std::span<const TargetView> targets,
                      std::span<const PartId> opened, IdBuffer& ids, const Control& control, std::int64_t& rays) {
    for (const TargetView& target : targets) {
        if (!target.thin || !std::binary_search(opened.begin(), opened.end(), target.part)) continue;
        const std::array<PartId, 1> one{target.part};
        const Rect box = target.alone.window().intersected(ids.window());
        const FineCoverage fine = trace_fine(build_bvh(*subject.meshes, one), view, box, control, &rays);
        for (int y = box.y0; y < box.y1; ++y)
            for (int x = box.x0; x < box.x1; ++x)
                if (fine.hits(x, y) && fine.depth(x, y) < ids.depth(x, y)) {
                    ids.id(x, y) = target.part;
                    ids.depth(x, y) = fine.depth(x, y);
                }
    }
}

/// Each target alone, in the picture and its margin.
std::vector<TargetView> view_each_target(const Subject& subject, const View& view, Rect whole, const Control& control,
                                         std::int64_t& rays) {
    std::vector<TargetView> targets;
    for (const PartId id : subject.targets) targets.push_back(view_target(subject, view, whole, id, control, rays));
    return targets;
}

/// For each target whether another one covers most of it.
void find_hiding_targets(std::vector<TargetView>& targets, const IdBuffer& ids) {
    for (TargetView& target : targets) {
        std::vector<std::pair<PartId, std::int64_t>> hiders;
        const Rect box = target.alone.window().intersected(ids.window());
        for (int y = box.y0; y < box.y1; ++y)
            for (int x = box.x0; x < box.x1; ++x) {
                const PartId id = ids.id(x, y);
                if (!target.alone(x, y) || id == target.part || id == kNoPart) continue;
                const auto it =
                    std::find_if(hiders.begin(), hiders.end(), [&](const auto& h) { return h.first == id; });
                if (it == hiders.end())
                    hiders.emplace_back(id, 1);
                else
                    ++it->second;
            }
        for (const auto& [id, n] : hiders)
            if (2 * n > target.pixels_alone + target.pixels_outside) target.hidden_by = id;
    }
}

/// The hole as it acts on rays.
Cut make_cut(const Subject& subject, const View& view, const Hole& hole, const IdBuffer& targets,
             std::span<const PartId> cut_set, const Bvh& cut_bvh, HoleStyle style, const Control& control,
             std::int64_t& rays) {
    Cut cut;
    cut.view = view;
    cut.role = subject.roles;
    for (CutRole& role : cut.role)
        if (role == CutRole::cut_set) role = CutRole::loose;
    for (const PartId id : cut_set) cut.role[index(id)] = CutRole::cut_set;

    cut.distance = hole.distance;
    Image<float> cut_depth = hole.floor_depth;
    cut.loose_depth = Image<float>(hole.window, -kInfinity);
    const auto straight = [&] {
        CutLevel& level = cut.levels.emplace_back(hole.window);
        for (std::size_t i = 0; i < level.pixels().size(); ++i)
            if (hole.mask.pixels()[i]) level.pixels()[i].floor = cut_depth.pixels()[i];
    };
    if (style == HoleStyle::paper) { // occluders go along the whole ray, nothing else does
        straight();
        return cut;
    }

    for (std::size_t i = 0; i < targets.id.pixels().size(); ++i)
        if (targets.id.pixels()[i] != kNoPart) cut_depth.pixels()[i] = targets.depth.pixels()[i];
    for (std::size_t i = 0; i < hole.mask.pixels().size(); ++i)
        if (!hole.mask.pixels()[i]) cut_depth.pixels()[i] = -kInfinity;
    cut.loose_depth = trace_farthest(cut_bvh, view, hole.mask, cut_depth, control, &rays);

    // Where nothing would be left to see, the last surface that was to go stays: no hole shows
    // the background through the object, so the object keeps its outline.
    const Mask left = trace_beyond(subject.whole, view, hole.mask, cut_depth, control, &rays);
    for (std::size_t i = 0; i < left.pixels().size(); ++i) {
        if (left.pixels()[i] || !hole.mask.pixels()[i] || targets.id.pixels()[i] != kNoPart) continue;
        const float last = cut.loose_depth.pixels()[i] * (1 - 1e-6f);
        cut_depth.pixels()[i] = cut.loose_depth.pixels()[i] = last;
    }
    straight();
    return cut;
}

/// The targets the paper's follower found; those that step 1 misses are missing.
PaperContours follow_contours(const Bvh& targets, ViewPlan& plan) {
    PaperContours paper = find_contours_paper(
        [&](std::span<const Vec2i> pixels) { return trace_ids_at(targets, plan.view, pixels); }, plan.view.window());
    plan.rays.paper_step1 += paper.step1_rays;
    plan.rays.paper_step2 += paper.step2_rays;
    return paper;
}

void keep_only(IdBuffer& ids, std::span<const PartId> kept) {
    for (std::size_t i = 0; i < ids.id.pixels().size(); ++i) {
        PartId& id = ids.id.pixels()[i];
        if (id == kNoPart || std::find(kept.begin(), kept.end(), id) != kept.end()) continue;
        id = kNoPart;
        ids.depth.pixels()[i] = kInfinity;
    }
}

/// Parts of the plane that a plan traces.
struct Windows {
    Rect whole;       ///< the picture and the margin that the hole needs
    Rect all_targets; ///< the picture and the margin in which targets shape the hole
    Rect targets;     ///< where in it targets can be, and plan.window
    Rect enclosing;   ///< where the enclosing object can matter to the hole
};

/// The widest band that the hole may have.
HoleParams band_of(const Subject& subject, const View& view, const PlanParams& params) {
    return {.depth_px = band_depth_px(subject, view, params), .blur_px = 0.025f * float(view.height)};
}

CutawayMargins margins_of(const View& view, const PlanParams& params, const HoleParams& band) {
    if (params.style == HoleStyle::cutaway) return cutaway_margins(view, params, band);
    return {hole_margin_px(band), hole_margin_px(band)};
}

/// Ids of the opened targets in windows.targets.
IdBuffer target_ids(const Subject& subject, const Bvh& bvh, ContourMethod method, const Windows& windows,
                    ViewPlan& plan, const Control& control) {
    const View& view = plan.view;
    std::int64_t& rays = plan.rays.targets;
    if (method == ContourMethod::full)
        return cropped(trace_ids(bvh, view, windows.all_targets, control, &rays), windows.targets);
    // Rays where there is something to hit.
    const Doubt doubt = method == ContourMethod::fast ? Doubt::guess : Doubt::trace;
    const Coverage seen = cover(bvh, plan.opened, subject.boxes, view, windows.all_targets, doubt, control, &rays);
    return trace_ids_in_blocks(bvh, view, windows.targets, blocks_of(seen, windows.targets), control, &rays);
}

/// Everything of the plan that depends on which targets are opened.
void plan_opened_group(const Subject& subject, const PlanParams& params, const HoleParams& band, const Windows& windows,
                       const IdBuffer* plain, ViewPlan& plan, const Control& control) {
    const View& view = plan.view;
    const bool all = plan.opened.size() == subject.targets.size();
    std::optional<Bvh> some;
    if (!all) some.emplace(build_bvh(*subject.meshes, plan.opened));
    const Bvh& bvh = all ? subject.target_bvh : *some;

    IdBuffer ids = target_ids(subject, bvh, params.contours, windows, plan, control);
    add_thin_targets(subject, view, plan.targets, plan.opened, ids, control, plan.rays.targets);

    PaperContours paper;
    if (params.contours == ContourMethod::paper || params.style == HoleStyle::paper) paper = follow_contours(bvh, plan);
    if (params.contours == ContourMethod::paper) keep_only(ids, paper.ids);
    plan.target_ids = cropped(ids, plan.window);
    if (params.contours == ContourMethod::paper)
        plan.contours = paper.contours;
    else
        plan.contours = find_contours(plan.target_ids.id);
    find_hiding_targets(plan.targets, plan.target_ids);
    if (params.style == HoleStyle::cutaway)
        return plan_cutaway(subject, params, band, windows.enclosing, ids, plain, plan, control);

    // What lies in front of the targets is cut; the rest is loose.
    plan.spans =
        trace_spans(subject.whole, kMaskCutSet, view, plan.target_ids, subject.tolerance(), control, &plan.rays.spans);
    for (const PartSpan& span : plan.spans.parts) plan.cut_set.push_back(span.part);
    if (plan.cut_set.empty()) return;
    const Bvh cut_bvh = build_bvh(*subject.meshes, plan.cut_set);
    plan.enclosing = enclosing_object(subject.scene(), plan.cut_set, cut_bvh, view, windows.enclosing, windows.whole,
                                      control, plan.rays.enclosing, plain);

    Mask covered(plan.window, 0);
    for (std::size_t i = 0; i < covered.pixels().size(); ++i)
        covered.pixels()[i] = plan.spans.nearest.pixels()[i] < kInfinity;
    if (params.style == HoleStyle::paper) {
        PaperHole grown = grow_hole_paper(paper, plan.target_ids, plan.enclosing, plan.depth_px, covered);
        plan.hole = std::move(grown.hole);
        plan.paper_depth_px.assign(plan.opened.size(), 0);
        for (const PaperHole::PerTarget& t : grown.targets) {
            const auto it = std::find(plan.opened.begin(), plan.opened.end(), t.target);
            if (it != plan.opened.end()) plan.paper_depth_px[std::size_t(it - plan.opened.begin())] = t.depth_px;
        }
    } else {
        plan.hole = grow_hole(plan.contours, plan.target_ids, covered, plan.enclosing, band);
    }
    plan.cut = make_cut(subject, view, plan.hole, plan.target_ids, plan.cut_set, cut_bvh, params.style, control,
                        plan.rays.loose);
}

/// Targets of the opened group that the hole has no room for.
std::vector<PartId> no_room(const ViewPlan& plan, const PlanParams& params) {
    if (params.style != HoleStyle::paper) return targets_without_room(plan.hole);
    std::vector<PartId> refused;
    for (std::size_t i = 0; i < plan.opened.size(); ++i)
        if (plan.paper_depth_px[i] == 0) refused.push_back(plan.opened[i]);
    return refused;
}

/// Calls body(block, its pixels) for the marked 4x4 blocks in `window` of which every pixel shows one of the parts.
template <typename Body> void for_each_known_block(const BlockMask& blocks, Rect window, const Image<PartId>& ids,
                                                   const std::vector<std::uint8_t>& is_part, Body&& body) {
    const Rect inside{(window.x0 + 3) >> 2, (window.y0 + 3) >> 2, window.x1 >> 2, window.y1 >> 2};
    const Rect b = inside.intersected(blocks.blocks);
    for (int by = b.y0; by < b.y1; ++by)
        for (int bx = b.x0; bx < b.x1; ++bx) {
            bool known = blocks.marked(bx, by) != 0;
            for (int i = 0; i < 16 && known; ++i) {
                const PartId id = ids(4 * bx + i % 4, 4 * by + i / 4);
                known = id != kNoPart && is_part[index(id)];
            }
            if (known) body(Vec2i{bx, by}, Rect{4 * bx, 4 * by, 4 * bx + 4, 4 * by + 4});
        }
}

} // namespace

Mask enclosing_object(const Scene& scene, std::span<const PartId> parts, const Bvh& cut_set, const View& view,
                      Rect window, Rect whole, const Control& control, std::int64_t& rays, const IdBuffer* plain) {
    // One box a part: what none of them touches is background without a ray.
    ClusterBoxes boxes;
    boxes.by_mesh.resize(scene.meshes.size());
    for (const PartId id : parts) {
        const std::uint32_t mesh = scene.parts[index(id)].mesh;
        boxes.by_mesh[mesh] = {scene.meshes[mesh].bounds};
    }
    const BlockMask blocks = mark_blocks(scene, parts, boxes, view, whole);
    // Where one of the parts is what one sees, it needs no ray either.
    BlockMask unknown = blocks;
    std::vector<Rect> known;
    if (plain) {
        std::vector<std::uint8_t> is_part(scene.parts.size(), 0);
        for (const PartId id : parts) is_part[index(id)] = 1;
        for_each_known_block(blocks, window.intersected(plain->window()), plain->id, is_part,
                             [&](Vec2i block, Rect pixels) {
                                 unknown.marked(block.x, block.y) = 0;
                                 known.push_back(pixels);
                             });
    }
    Mask hit = trace_coverage(cut_set, view, window, &unknown, control, &rays);
    for (const Rect& pixels : known)
        for (int y = pixels.y0; y < pixels.y1; ++y) std::fill_n(&hit(pixels.x0, y), pixels.width(), std::uint8_t{1});

    std::unordered_map<std::uint64_t, Mask> traced; // by block
    const auto hit_beyond = [&](Vec2i p) {
        const Vec2i b{p.x >> 2, p.y >> 2};
        if (!blocks.marked(b.x, b.y)) return false;
        Mask& block = traced[std::uint64_t(std::uint32_t(b.y)) << 32 | std::uint32_t(b.x)];
        if (block.empty()) {
            const Rect pixels = Rect{4 * b.x, 4 * b.y, 4 * b.x + 4, 4 * b.y + 4}.intersected(whole);
            block = trace_coverage(cut_set, view, pixels, nullptr, control, &rays);
        }
        return block(p.x, p.y) != 0;
    };
    return fill_enclosed(hit, whole, hit_beyond);
}

Subject make_subject(const MeshBvhs& meshes, std::span<const PartId> targets, std::span<const PartId> keep,
                     std::span<const PartId> cut_only, const Control& control) {
    const Scene& scene = meshes.scene();
    std::vector<CutRole> roles(scene.parts.size(), cut_only.empty() ? CutRole::cut_set : CutRole::fixed);
    for (const PartId id : cut_only) roles[index(id)] = CutRole::cut_set;
    for (const PartId id : keep) roles[index(id)] = CutRole::fixed;
    for (const PartId id : targets) roles[index(id)] = CutRole::fixed;
    std::vector<PartId> sorted(targets.begin(), targets.end());
    std::sort(sorted.begin(), sorted.end());
    sorted.erase(std::unique(sorted.begin(), sorted.end()), sorted.end());

    Bvh whole = build_bvh(meshes, all_parts(scene), roles);
    Bvh target_bvh = build_bvh(meshes, sorted);
    ClusterBoxes boxes = cluster_boxes(scene, sorted, control);
    return {&meshes,          std::move(sorted),  std::move(roles), std::move(whole), std::move(target_bvh),
            std::move(boxes), scene_bounds(scene)};
}

double length_px(const Subject& subject, const View& view, Length length) {
    if (length.unit == Length::Unit::percent) return length.value / 100 * view.height;
    if (length.unit == Length::Unit::pixel) return length.value;
    Bounds3d box;
    for (const PartId id : subject.targets) box.extend(part_bounds(subject.scene(), id));
    const float z = box.empty() ? 1.0f : view.project(Vec3f(box.center())).depth;
    return length.value / 1000 / double(view.pixel_size(std::max(z, 1e-30f)));
}

int band_depth_px(const Subject& subject, const View& view, const PlanParams& params) {
    const double px =
        length_px(subject, view,
                  params.depth.value_or(params.style == HoleStyle::paper ? Length{Length::Unit::pixel, 4} : Length{}));
    if (!(px > 0) || !(px <= 4096))
        throw Error(ErrorKind::usage, "E0120", "--depth",
                    "the band would be " + std::to_string(px) + " px wide; it must be above 0 and at most 4096 px");
    return std::max(1, int(std::lround(px)));
}

std::vector<TargetView> view_targets(const Subject& subject, const View& view, const PlanParams& params,
                                     const Control& control) {
    const Rect whole = view.window().grown(margins_of(view, params, band_of(subject, view, params)).hole);
    std::int64_t ignored = 0;
    return view_each_target(subject, view, whole, control, ignored);
}

ViewPlan plan_view(const Subject& subject, const View& view, const PlanParams& params, const Control& control,
                   const IdBuffer* plain) {
    const Scene& scene = subject.scene();
    ViewPlan plan;
    plan.view = view;
    plan.ghost = params.style == HoleStyle::ghost;
    const HoleParams band = band_of(subject, view, params);
    plan.depth_px = band.depth_px;
    const CutawayMargins margins = margins_of(view, params, band);
    Windows windows;
    windows.whole = plan.whole = view.window().grown(margins.hole);
    windows.all_targets = view.window().grown(margins.targets);

    // Each target alone, then all of them together.
    const BlockMask blocks = mark_blocks(scene, subject.targets, subject.boxes, view, windows.all_targets);
    plan.targets = view_each_target(subject, view, windows.whole, control, plan.rays.alone);
    for (const TargetView& target : plan.targets)
        if (!target.absent) plan.opened.push_back(target.part);
    const Rect touched = pixel_rect(blocks, windows.all_targets);
    if (!touched.empty()) {
        // The band is all that the hole adds to what the targets' pixels span, whatever their shape.
        windows.enclosing = touched.grown(margins.hole).intersected(windows.whole);
        plan.window = touched.grown(std::min(plan.depth_px + kBeyondBand, margins.hole)).intersected(windows.whole);
    }
    if (plan.opened.empty()) return plan;
    windows.targets = {std::min(touched.x0, plan.window.x0), std::min(touched.y0, plan.window.y0),
                       std::max(touched.x1, plan.window.x1), std::max(touched.y1, plan.window.y1)};

    // A target that has no room is taken out of the group, and the rest is planned again:
    // what it covered may have become visible, what only it needed stays whole.
    for (;;) {
        plan_opened_group(subject, params, band, windows, plain, plan, control);
        if (params.tight == Tight::open || plan.ghost || plan.cut_set.empty()) return plan;
        std::vector<PartId> refused = no_room(plan, params);
        if (refused.empty()) return plan;
        if (params.tight == Tight::ghost) {
            PlanParams ghost = params;
            ghost.style = HoleStyle::ghost;
            return plan_view(subject, view, ghost, control, plain);
        }
        for (TargetView& target : plan.targets)
            if (std::find(refused.begin(), refused.end(), target.part) != refused.end()) {
                target.refused = true;
                std::erase(plan.opened, target.part);
            }
        plan.contours.clear();
        plan.cut_set.clear();
        plan.spans = {};
        plan.core = {};
        plan.walls.clear();
        plan.hole = {};
        plan.cut = {};
        if (plan.opened.empty()) return plan;
    }
}

} // namespace porthole
