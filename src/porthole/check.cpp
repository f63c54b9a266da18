#include "porthole/check.h"

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <set>

#include "porthole/check_dense.h"
#include "porthole/crumbs.h"

namespace porthole {

namespace {

using Json = nlohmann::ordered_json;

constexpr std::size_t kListed = 20;        ///< differences of one kind that are listed
constexpr std::uint64_t kBytesAPixel = 64; ///< of picture and margin, all values of the passes together

std::string shortened(const Json& value) {
    std::string text = value.is_structured() ? value.type_name() + std::string(" of ") + std::to_string(value.size())
                                             : value.dump(-1, ' ', true, Json::error_handler_t::replace);
    if (text.size() > 80) text = text.substr(0, 77) + "...";
    return text;
}

std::string pixel_text(int x, int y) { return "pixel " + std::to_string(x) + ',' + std::to_string(y); }

std::string color_text(Rgba16 c) {
    return std::to_string(c.r) + ' ' + std::to_string(c.g) + ' ' + std::to_string(c.b) + ' ' + std::to_string(c.a);
}

/// The report in question and what was found about it.
class Comparison {
public:
    Comparison(const Report& reported, std::string_view text, Checked& checked)
        : reported_(reported), json_(Json::parse(text)), checked_(checked) {}

    void differ(const std::string& what, const std::string& where, const std::string& reported,
                const std::string& found) {
        if (++count_[what] <= kListed)
            checked_.differences.push_back({what, where, reported, found});
        else
            ++checked_.unlisted[what];
    }

    /// Compares a value of the report; nothing further is said of one that differs.
    void figure(const std::string& pointer, const Json& found) {
        const Json* const value = at(pointer);
        if (value && *value == found) return;
        if (said_.insert(pointer).second)
            differ("figure", pointer, value ? shortened(*value) : "nothing", shortened(found));
    }

    /// A share of `whole`.
    void share(const std::string& pointer, DenseCount found, std::int64_t whole) {
        if (whole == 0) return figure(pointer, nullptr);
        const Json* const value = at(pointer);
        const double part = value && value->is_number() ? std::round(value->get<double>() * double(whole)) : -1.0;
        const bool right = part >= double(found.least) && part <= double(found.most);
        figure(pointer, (right ? part : double(found.least)) / double(whole));
    }

    /// Compares a mask pixel by pixel over `whole`; `found` is 0 beyond its window. Where
    /// `either` is 1 both answers are right. `of` names the target.
    void mask(const std::string& what, const PixelRuns& reported, const Mask& found, Rect whole, const Mask* either,
              const std::string& of) {
        const Rect box = reported.window;
        const auto corners = [](Rect r) {
            return std::to_string(r.x0) + ',' + std::to_string(r.y0) + " to " + std::to_string(r.x1) + ',' +
                   std::to_string(r.y1);
        };
        const bool within = box.empty() || box.intersected(whole) == box;
        const std::optional<Mask> said = within ? decode_runs(reported) : std::nullopt;
        if (!said)
            return differ(what, "the mask" + of, "runs that are not of a window " + corners(box),
                          "pixels within " + corners(whole));
        for (int y = whole.y0; y < whole.y1; ++y)
            for (int x = whole.x0; x < whole.x1; ++x) {
                const bool r = said->at_or(x, y, 0) != 0, f = found.at_or(x, y, 0) != 0;
                if (r != f && !(either && either->at_or(x, y, 0)))
                    differ(what, pixel_text(x, y) + of, r ? "in" : "out", f ? "in" : "out");
            }
    }

    /// Compares all that was not compared yet with the report of the repeated run.
    void rest(Report found) {
        found.version = reported_.version, found.command = reported_.command;
        found.camera = reported_.camera;
        ModelReport model = reported_.model;
        model.parts = found.model.parts, model.triangles = found.model.triangles;
        found.model = model;
        found.run.isa = reported_.run.isa;
        found.picture.file = reported_.picture.file, found.picture.sha256 = reported_.picture.sha256;
        found.picture.bits = reported_.picture.bits, found.picture.no_background = reported_.picture.no_background;
        compare(json_, Json::parse(to_json(found)), "");
    }

private:
    [[nodiscard]] const Json* at(const std::string& pointer) const {
        const Json::json_pointer place(pointer);
        return json_.contains(place) ? &json_.at(place) : nullptr;
    }

    void compare(const Json& reported, const Json& found, const std::string& pointer) {
        // Masks were compared pixel by pixel; a run and its warnings may differ.
        if (pointer == "/run" || pointer == "/warnings" || said_.contains(pointer)) return;
        if (pointer.ends_with("/mask") || pointer.ends_with("/alone")) return;
        const auto below = [&](const std::string& key) {
            std::string longer = pointer;
            return longer.append("/").append(key);
        };
        if (reported.is_object() && found.is_object()) {
            for (const auto& [key, value] : found.items()) {
                const std::string place = below(key);
                const auto other = reported.find(key);
                if (other != reported.end())
                    compare(*other, value, place);
                else if (said_.insert(place).second)
                    differ("figure", place, "nothing", shortened(value));
            }
            for (const auto& [key, value] : reported.items())
                if (!found.contains(key)) differ("figure", below(key), shortened(value), "nothing");
            return;
        }
        if (reported.is_array() && found.is_array() && reported.size() == found.size()) {
            for (std::size_t i = 0; i < found.size(); ++i) compare(reported[i], found[i], below(std::to_string(i)));
            return;
        }
        if (reported != found) differ("figure", pointer, shortened(reported), shortened(found));
    }

    const Report& reported_;
    Json json_;
    Checked& checked_;
    std::map<std::string, std::size_t> count_;
    std::set<std::string> said_;
};

/// Whether the model has the parts that the report speaks of, and the report speaks of the
/// targets it was made for: otherwise there is nothing to repeat.
bool same_parts(const Scene& scene, const Report& reported, Comparison& comparison) {
    bool same = true;
    const auto expect = [&](PartId id, const std::string& path, const std::string& where) {
        const bool there = index(id) < scene.parts.size();
        // Paths are compared as the report holds them: as valid UTF-8.
        const std::string found =
            there ? Json(scene.parts[index(id)].path).dump(-1, ' ', false, Json::error_handler_t::replace) : "no part";
        if (there && found == Json(path).dump(-1, ' ', false, Json::error_handler_t::replace)) return;
        comparison.differ("targets", where, '#' + std::to_string(index(id)) + ' ' + path, found);
        same = false;
    };
    for (const auto& [id, path] : reported.option_paths) expect(id, path, "/options");
    for (std::size_t i = 0; i < reported.targets.size(); ++i)
        expect(reported.targets[i].part, reported.targets[i].path, "/targets/" + std::to_string(i));

    std::set<PartId> asked(reported.options.targets.begin(), reported.options.targets.end()), listed;
    for (const TargetReport& target : reported.targets) listed.insert(target.part);
    const auto names = [](const std::set<PartId>& parts) {
        std::string text;
        for (const PartId id : parts) text += (text.empty() ? "#" : " #") + std::to_string(index(id));
        return text.empty() ? "none" : text.size() > 80 ? text.substr(0, 77) + "..." : text;
    };
    if (asked != listed || listed.size() != reported.targets.size()) {
        comparison.differ("targets", "/targets", names(listed), names(asked) + " in /options/targets");
        same = false;
    }
    return same;
}

/// 1 at pixels of `mask` and their eight neighbours, over `window`.
Mask grown_by_one(const Mask& mask, Rect window) {
    Mask result(window, 0);
    for (int y = window.y0; y < window.y1; ++y)
        for (int x = window.x0; x < window.x1; ++x)
            for (int dy = -1; dy <= 1; ++dy)
                for (int dx = -1; dx <= 1; ++dx) result(x, y) |= mask.at_or(x + dx, y + dy, 0);
    return result;
}

/// Whether a target is hit somewhere in the pixel, if not at its centre: a hair of it may reach
/// out of the hole, and samples that hit a target show it.
bool holds_target(const Bvh& targets, const View& view, int x, int y) {
    constexpr int kSteps = 32;
    bool hit = false;
    for (int row = 0; row < kSteps && !hit; ++row)
        for (int column = 0; column < kSteps; column += kLanes) {
            RayHit16 rays;
            for (int i = 0; i < kLanes; ++i) {
                const Ray ray =
                    view.ray(float(x) + (float(column + i) + 0.5f) / kSteps, float(y) + (float(row) + 0.5f) / kSteps);
                rays.set(i, ray.origin, ray.direction, 0, kInfinity);
            }
            for_each_crossing(targets, rays, [&](const Crossing&) { hit = true; });
        }
    return hit;
}

/// The picture against the plain one beside the hole and against the reveal at the hole.
/// @param restyled  beside the hole, too, it is not the plain picture.
void compare_picture(const CheckParams& params, const View& view, const Mask& hole, const Bvh* targets,
                     const Frame& plain, const Frame& opened, bool restyled, Comparison& comparison, Checked& checked) {
    const Image<Rgba16>& file = *params.picture;
    if (file.width() != view.width || file.height() != view.height)
        return comparison.differ("picture inside", "size",
                                 std::to_string(view.width) + 'x' + std::to_string(view.height),
                                 std::to_string(file.width()) + 'x' + std::to_string(file.height()) + " in the file");
    const Mask touched = grown_by_one(hole, view.window());
    const Image<Rgba16> inside = params.as_in_file(opened);
    const bool has_plain = !params.lossy && !restyled;
    const Image<Rgba16> outside = has_plain ? params.as_in_file(plain) : inside;
    for (int y = 0; y < view.height; ++y)
        for (int x = 0; x < view.width; ++x) {
            bool in = touched(x, y) != 0;
            if (!in && targets && has_plain && file(x, y) != outside(x, y) && file(x, y) == inside(x, y))
                in = holds_target(*targets, view, x, y);
            const Rgba16 found = in ? inside(x, y) : outside(x, y);
            ++(in || !has_plain ? checked.inside_pixels : checked.outside_pixels);
            if (file(x, y) != found)
                comparison.differ(in ? "picture inside" : "picture outside", pixel_text(x, y),
                                  color_text(file(x, y)) + " in the file", color_text(found));
        }
}

/// The targets, the hole and the figures that the dense passes confirm.
void compare_dense(const Report& reported, const ViewPlan& plan, const DenseView& dense, Comparison& comparison,
                   Checked& checked) {
    for (std::size_t i = 0; i < reported.targets.size(); ++i) {
        const TargetReport& said = reported.targets[i];
        const DenseTarget& own = *std::find_if(dense.targets.begin(), dense.targets.end(),
                                               [&](const DenseTarget& t) { return t.part == said.part; });
        Mask nearest(own.depth.window(), 0);
        for (int y = nearest.window().y0; y < nearest.window().y1; ++y)
            for (int x = nearest.window().x0; x < nearest.window().x1; ++x) {
                nearest(x, y) = dense.nearest.id(x, y) == own.part;
                checked.target_pixels += nearest(x, y);
            }
        comparison.mask("target pixels", said.alone, own.alone(), plan.whole, nullptr, " of " + said.path + " alone");
        comparison.mask("target pixels", said.mask, nearest, plan.whole, &dense.tied, " of " + said.path);

        const std::string at = "/targets/" + std::to_string(i);
        comparison.figure(at + "/pixels_alone", own.pixels_alone);
        if (own.samples > 0) comparison.figure(at + "/thin", own.thin);
        comparison.share(at + "/visible_before", own.before, own.samples);
        comparison.share(at + "/visible_after", own.after, own.samples);
        if (!own.thin && !own.among_tied) comparison.share(at + "/visible_among_targets", own.after_among, own.among);
    }

    const Mask& hole = plan.hole.mask;
    checked.hole_pixels = std::count(hole.pixels().begin(), hole.pixels().end(), std::uint8_t(1));
    comparison.mask("hole", reported.picture.mask, hole, plan.whole, nullptr, "");
    // Thin shells hide the background as the whole parts do.
    const bool shells = plan.ghost || reported.options.rest == Rest::ghost;
    const Mask& after = shells ? dense.before : dense.after;
    std::int64_t in_picture = 0, see_through = 0;
    const Rect picture = plan.view.window();
    for (int y = picture.y0; y < picture.y1; ++y)
        for (int x = picture.x0; x < picture.x1; ++x) {
            in_picture += hole.at_or(x, y, 0);
            see_through += dense.before(x, y) && !after(x, y);
        }
    comparison.figure("/picture/hole_pixels", plan.cut.empty() ? 0 : in_picture);
    comparison.figure("/picture/see_through_px", see_through);
    comparison.figure("/picture/outline_iou", dense_outline_iou(dense.before, after));
}

/// @throws Error limit E0901.
void check_memory(const Subject& subject, const RevealParams& params, std::uint64_t max_bytes) {
    // The margin is four bands wide, and what closing and blurring reach.
    const View& view = *params.view;
    const std::int64_t margin = 5 * std::int64_t(band_depth_px(subject, view, params.plan)) + view.height / 2 + 64;
    const std::uint64_t pixels = std::uint64_t(view.width + 2 * margin) * std::uint64_t(view.height + 2 * margin);
    if (pixels * kBytesAPixel > max_bytes)
        throw Error(ErrorKind::limit, "E0901", "/options/depth",
                    "tracing picture and margin needs about " + std::to_string(pixels * kBytesAPixel >> 20) + " MB, " +
                        std::to_string(max_bytes >> 20) + " MB are allowed");
}

void check_reveal(const MeshBvhs& meshes, const Report& reported, const CheckParams& params, Comparison& comparison,
                  Checked& checked, const Control& control) {
    const RevealParams& options = reported.options;
    const Subject subject = make_subject(meshes, options, control);
    check_memory(subject, options, params.max_bytes);
    {
        PlanParams full = options.plan;
        if (full.contours == ContourMethod::exact) full.contours = ContourMethod::full;
        ViewPlan plan = plan_view(subject, *options.view, full, control);
        if (full.contours == ContourMethod::paper)
            // Step 1 of the paper may miss a target: then it is none.
            std::erase_if(plan.opened, [&](PartId id) {
                const std::span<const PartId> ids = plan.target_ids.id.pixels();
                return std::find(ids.begin(), ids.end(), id) == ids.end();
            });
        if (full.style != HoleStyle::paper && !plan.ghost) {
            plan_caps(subject, plan, full.solidity, control);
            const Bvh opened = build_bvh(meshes, all_parts(meshes.scene()), plan.cut.role, plan.cut.level);
            (void)remove_crumbs(subject, plan, opened, build_bvh(meshes, plan.opened), control);
        }
        const DenseView dense = look_densely(subject, plan, control);
        checked.rays = dense.rays, checked.crossings = dense.crossings, checked.tied_pixels = dense.tied_pixels;
        compare_dense(reported, plan, dense, comparison, checked);
    }

    const Revealed again = reveal(meshes, options, control);
    if (params.picture && !again.plan.nothing_revealed()) {
        const Frame plain = render(subject.whole, nullptr, *options.view, look_of(options), nullptr, nullptr, control);
        const Bvh targets = build_bvh(meshes, again.plan.opened);
        compare_picture(params, *options.view, again.plan.hole.mask, &targets, plain, again.frame,
                        again.plan.ghost || options.rest != Rest::keep, comparison, checked);
    }
    comparison.rest(again.report);
}

void check_render(const MeshBvhs& meshes, const Report& reported, const CheckParams& params, Comparison& comparison,
                  Checked& checked, const Control& control) {
    const View& view = *reported.options.view;
    const Bvh whole = build_bvh(meshes, all_parts(meshes.scene()));
    Report found;
    const Frame frame = render_plain(meshes, whole, view, reported.options, control, &found.refinement);
    if (params.picture) compare_picture(params, view, {}, nullptr, frame, frame, false, comparison, checked);
    found.model.parts = std::int64_t(meshes.scene().parts.size());
    found.model.triangles = std::int64_t(triangle_count(meshes.scene()));
    found.view = view;
    found.options = reported.options;
    found.nothing_to_cut = true;
    found.frame_rays = frame.rays;
    comparison.rest(std::move(found));
}

} // namespace

Checked check_report(const MeshBvhs& meshes, const Report& reported, std::string_view text, const CheckParams& params,
                     const Control& control) {
    Checked checked;
    Comparison comparison(reported, text, checked);
    if (!same_parts(meshes.scene(), reported, comparison)) return checked;
    if (reported.command == "render")
        check_render(meshes, reported, params, comparison, checked, control);
    else
        check_reveal(meshes, reported, params, comparison, checked, control);
    return checked;
}

} // namespace porthole
