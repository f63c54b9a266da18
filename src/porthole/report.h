// What was done and how well, as numbers: the keys and formulas of DESIGN 2.7.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "porthole/params.h"
#include "porthole/render/compare.h"

namespace porthole {

/// A mask as text: the lengths of its runs of 0 and 1 in turn, the first of 0, row by row, in
/// decimal with spaces between. What follows the last 1 is left out.
struct PixelRuns {
    Rect window;      ///< smallest one around the ones; may reach beyond the picture
    std::string runs; ///< empty: no pixel
    friend bool operator==(const PixelRuns&, const PixelRuns&) = default;
};
[[nodiscard]] PixelRuns encode_runs(const Mask& mask);
/// Empty unless `runs` is what encode_runs makes of some mask. Cost: linear in text and window.
[[nodiscard]] std::optional<Mask> decode_runs(const PixelRuns& runs);

/// The model and how it was read.
struct ModelReport {
    std::string path;        ///< as given; "-": standard input
    std::uint64_t bytes = 0; ///< of the file; 0: standard input
    std::string sha256;      ///< of the file; empty: standard input
    std::string format;      ///< asked for; empty: told from the content
    double time = -1;
    char up = 'y';
    double metres_per_unit = 1;
    std::int64_t parts = 0, triangles = 0;
};

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
    PixelRuns alone;     ///< pixels it covers alone, in the picture and its margin
    PixelRuns mask;      ///< those where it is the nearest of the opened targets
};

/// How the parts that were cut are drawn inside: paths.
struct CapReport {
    std::vector<std::string> solids;      ///< capped wherever they are cut
    std::vector<std::string> shells;      ///< hold a target: capped on the chamfer only
    std::vector<std::string> open;        ///< no closed piece: no cap, seen from both sides
    std::vector<std::string> partly_open; ///< solids or shells with open pieces beside the closed ones
    std::vector<std::string> around_eye;  ///< no cap: the eye lies in them
    std::int64_t cap_pixels = 0;          ///< pixel centres that see a cap
    std::int64_t open_back_pixels = 0;    ///< those that see the back of a part without caps
};

struct PictureReport {
    std::optional<double> outline_iou, context_removed, wall_visible;
    std::int64_t see_through_px = 0;     ///< model before, nothing after
    std::int64_t hole_pixels = 0;        ///< targets and band, inside the picture
    std::vector<std::string> parts_lost; ///< seen before, nowhere after
    CrumbCount crumbs;
    PixelRuns mask;             ///< the hole, in the picture and its margin
    std::string file;           ///< relative to the report's folder; empty: none, or standard output
    std::string sha256;         ///< of the file; empty: no picture was written
    int bits = 8;               ///< per channel
    bool no_background = false; ///< alpha in the file
};

/// A refined picture against the same one with every pixel traced.
struct RefinementReport {
    struct Seconds {
        double wall = 0, cpu = 0; ///< cpu: of all threads of the process
    };
    Refinement figures;
    std::vector<std::string> missed_parts; ///< paths
    Seconds time, full_time;               ///< of drawing the two; they differ between runs
};

struct RunReport {
    double load = 0, build = 0, plan = 0, render = 0, write = 0, total = 0; ///< seconds
    int threads = 0;
    std::string isa;
    std::int64_t peak_bytes = 0;
};

struct Report {
    std::string version, command;
    ModelReport model;
    View view;
    std::string camera;                         ///< what was asked for
    RevealParams options;                       ///< with `view`, all that decides the pixels; not its camera
    std::map<PartId, std::string> option_paths; ///< of the parts that `options` name
    bool nothing_to_cut = false;
    std::vector<TargetReport> targets;
    std::vector<std::string> cut_parts; ///< paths of the parts that were cut
    CapReport caps;
    PictureReport picture;
    ViewPlan::Rays plan_rays;
    RayCounts frame_rays;
    std::int64_t measuring_rays = 0; ///< for the ids of pixels that the picture inferred
    std::optional<RefinementReport> refinement;
    Warnings warnings;
    RunReport run; ///< all that may differ between two runs
};

/// Fills targets, cut_parts, picture and the ray counts. `before` is the plain frame, `after`
/// the opened one (its ids were traced again through the cut, not copied from the plan).
/// `bvh` holds every part with the roles of the plan's cut. Cost: passes over the picture, and
/// rays for thin targets.
[[nodiscard]] Report measure(const Subject& subject, const ViewPlan& plan, const Bvh& bvh, const Frame& before,
                             const Frame& after, const Control& control = {});

/// Says in `report` with which options a picture of `scene` was made.
void set_options(Report& report, const Scene& scene, const RevealParams& options);

/// The report as JSON text, two spaces indented, with a final newline; names are made valid
/// UTF-8. Numbers that differ between runs are all under "run". The schema: docs/report.md.
[[nodiscard]] std::string to_json(const Report& report);

/// What a report says is needed to make its picture again: version, command, model, view (in
/// `options` too), options, isa, the picture's file and mask, and of each target part, path,
/// masks and thin. The figures stay as they are in the text.
/// @param where  the file that errors name.
/// @throws Error input E0220 naming the JSON pointer: not JSON, not a report, an option that is
///         missing, unknown or out of range; limit E0902 above 64 MB or 4 million values.
/// Never crashes on any text. Cost: linear in the text.
[[nodiscard]] Report read_report(std::string_view text, const std::string& where);

} // namespace porthole
