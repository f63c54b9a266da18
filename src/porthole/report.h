// What was done and how well, as numbers: the keys and formulas of DESIGN 2.7.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "porthole/plan.h"
#include "porthole/render/render.h"

namespace porthole {

/// Ratios are in [0, 1]; an empty optional is a zero denominator and becomes null.
struct TargetReport {
    PartId part = kNoPart;
    std::string path;
    std::int64_t pixels_alone = 0; ///< inside the picture; thin targets: pixels with a sub-pixel sample
    std::optional<double> visible_before, visible_after, visible_among_targets;
    std::int64_t contour_pixels = 0;
    int components = 0;            ///< outer borders that belong to it
    bool closed = true;            ///< all of its borders are
    std::optional<double> covered; ///< share of its contour pixels that an occluder hides
    std::optional<double> clearance_min_px, clearance_p5_px, clearance_mean_px; ///< null: infinite
    int depth_asked_px = 0;
    std::optional<double> depth_used_min_px, depth_used_mean_px, depth_used_max_px;
    std::optional<double> ring_mean, ring_p5, ring_min;
    double off_image_share = 0; ///< share of its pixels that lie in the margin around the picture
    bool thin = false;
    std::string refused; ///< empty, or "absent", "no room"
};

struct PictureReport {
    std::optional<double> outline_iou, context_removed, wall_visible;
    std::int64_t see_through_px = 0;     ///< model before, nothing after
    std::int64_t hole_pixels = 0;        ///< targets and band, inside the picture
    std::vector<std::string> parts_lost; ///< seen before, nowhere after
};

struct RunReport {
    double load = 0, build = 0, plan = 0, render = 0, write = 0, total = 0; ///< seconds
    int threads = 0;
    std::string isa;
    std::int64_t peak_bytes = 0;
};

struct Report {
    std::string version, command, model_path;
    std::int64_t parts = 0, triangles = 0;
    View view;
    std::string camera; ///< what was asked for
    bool nothing_to_cut = false;
    std::vector<TargetReport> targets;
    std::vector<std::string> cut_parts; ///< paths of the parts that were cut
    PictureReport picture;
    ViewPlan::Rays plan_rays;
    RayCounts frame_rays;
    Warnings warnings;
    RunReport run; ///< all that may differ between two runs
};

/// Fills targets, cut_parts, picture and the ray counts. `before` is the plain frame, `after`
/// the opened one (its ids were traced again through the cut, not copied from the plan).
/// `bvh` holds every part with the roles of the plan's cut. Cost: passes over the picture, and
/// rays for thin targets.
[[nodiscard]] Report measure(const Subject& subject, const ViewPlan& plan, const Bvh& bvh, const Frame& before,
                             const Frame& after, const Control& control = {});

/// The report as JSON text, two spaces indented, with a final newline; names are made valid
/// UTF-8. Numbers that differ between runs are all under "run".
[[nodiscard]] std::string to_json(const Report& report);

} // namespace porthole
