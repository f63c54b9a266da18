#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "porthole/report.h"
#include "porthole/report_fields.h"

namespace porthole {

namespace {

using Json = nlohmann::ordered_json;

Json json_of(const std::optional<double>& v) { return v ? Json(*v) : Json(nullptr); }
Json json_of(Vec3d v) { return {v.x, v.y, v.z}; }

Json json_of(const PixelRuns& runs) {
    const Rect w = runs.window;
    return {{"window", {w.x0, w.y0, w.x1, w.y1}}, {"runs", runs.runs}};
}

Json text_or_null(const std::string& text) { return text.empty() ? Json(nullptr) : Json(text); }

Json json_of(const RayCounts& rays) {
    return {{"primary", rays.primary},       {"shadow", rays.shadow},         {"ambient", rays.ambient},
            {"reflection", rays.reflection}, {"refraction", rays.refraction}, {"all", rays.all()}};
}

Json json_of(const RefinementReport& report) {
    const Refinement& r = report.figures;
    const auto share = [&](std::int64_t n) { return r.pixels ? Json(double(n) / double(r.pixels)) : Json(nullptr); };
    return {{"rays", json_of(r.rays)},
            {"full_rays", json_of(r.full_rays)},
            {"traced_share", share(r.traced)},
            {"wrong_ids", r.wrong_ids},
            {"wrong_ids_share", share(r.wrong_ids)},
            {"missed_parts", report.missed_parts},
            {"psnr_db", std::isfinite(r.psnr_db()) ? Json(r.psnr_db()) : Json(nullptr)}};
}

/// Writes the fields of `options`.
struct FieldWriter {
    const Report& report;
    Json& options;
    template <typename T> void operator()(const char* name, const T& value) const { options[name] = json(value); }

    template <typename T> Json json(const T& value) const {
        if constexpr (std::is_enum_v<T>)
            return fields::name_of(value);
        else
            return value;
    }
    Json json(Vec3f v) const { return {v.x, v.y, v.z}; }
    Json json(const std::optional<Length>& v) const {
        return v ? Json{v->value, fields::name_of(v->unit)} : Json(nullptr);
    }
    Json json(const std::optional<double>& v) const { return v ? Json(*v) : Json(nullptr); }
    Json json(const std::vector<Vec2f>& positions) const {
        Json pairs = Json::array();
        for (const Vec2f p : positions) pairs.push_back({p.x, p.y});
        return pairs;
    }
    Json json(const std::vector<PartId>& ids) const {
        Json parts = Json::array();
        for (const PartId id : ids) {
            const auto path = report.option_paths.find(id);
            parts.push_back({{"id", index(id)}, {"path", path == report.option_paths.end() ? "" : path->second}});
        }
        return parts;
    }
};

Json json_of_options(const Report& report) {
    Json options;
    fields::for_each(report.options, FieldWriter{report, options});
    options["isa"] = report.run.isa;
    return options;
}

} // namespace

void set_options(Report& report, const Scene& scene, const RevealParams& options) {
    report.options = options;
    fields::for_each(options, [&](const char*, const auto& value) {
        if constexpr (std::is_same_v<std::decay_t<decltype(value)>, std::vector<PartId>>)
            for (const PartId id : value) report.option_paths[id] = scene.parts[index(id)].path;
    });
}

PixelRuns encode_runs(const Mask& mask) {
    PixelRuns result;
    if (mask.empty()) return result;
    Rect& box = result.window;
    const Rect w = mask.window();
    box = {w.x1, w.y1, w.x0, w.y0};
    for (int y = w.y0; y < w.y1; ++y)
        for (int x = w.x0; x < w.x1; ++x)
            if (mask(x, y))
                box = {std::min(box.x0, x), std::min(box.y0, y), std::max(box.x1, x + 1), std::max(box.y1, y + 1)};
    if (box.empty()) {
        box = {};
        return result;
    }
    bool value = false;
    std::int64_t length = 0;
    const auto end_run = [&] {
        if (!result.runs.empty()) result.runs += ' ';
        result.runs += std::to_string(length);
        length = 0;
        value = !value;
    };
    for (int y = box.y0; y < box.y1; ++y)
        for (int x = box.x0; x < box.x1; ++x) {
            if ((mask(x, y) != 0) != value) end_run();
            ++length;
        }
    if (value) end_run();
    return result;
}

std::optional<Mask> decode_runs(const PixelRuns& runs) {
    const std::int64_t area = runs.window.empty() ? 0 : std::int64_t(runs.window.width()) * runs.window.height();
    // The text is read before memory is set aside for it.
    std::vector<std::int64_t> lengths;
    const std::string& text = runs.runs;
    std::int64_t sum = 0;
    for (std::size_t at = 0; at < text.size();) {
        std::int64_t length = 0;
        std::size_t digits = 0;
        for (; at < text.size() && text[at] >= '0' && text[at] <= '9'; ++at, ++digits)
            if ((length = 10 * length + (text[at] - '0')) > area) return std::nullopt;
        sum += length;
        if (digits == 0 || sum > area || (length == 0 && !lengths.empty())) return std::nullopt;
        lengths.push_back(length);
        if (at < text.size() && (text[at++] != ' ' || at == text.size())) return std::nullopt;
    }
    if (lengths.size() % 2 != 0) return std::nullopt;
    Mask mask(runs.window, 0);
    auto pixel = mask.pixels().begin();
    for (std::size_t i = 0; i < lengths.size(); ++i) {
        if (i % 2 == 1) std::fill_n(pixel, lengths[i], std::uint8_t(1));
        pixel += lengths[i];
    }
    return mask;
}

std::string to_json(const Report& report) {
    Json j;
    j["version"] = report.version;
    j["command"] = report.command;
    const ModelReport& m = report.model;
    j["model"] = {{"path", m.path},
                  {"parts", m.parts},
                  {"triangles", m.triangles},
                  {"bytes", m.bytes},
                  {"sha256", text_or_null(m.sha256)},
                  {"format", text_or_null(m.format)},
                  {"time", m.time},
                  {"up", std::string(1, m.up)},
                  {"metres_per_unit", m.metres_per_unit}};
    j["options"] = json_of_options(report);
    const Affine3d c(report.view.world_from_camera);
    j["camera"] = {{"name", report.camera},
                   {"orthographic", report.view.orthographic},
                   {"position", json_of(c.p)},
                   {"right", json_of(c.x)},
                   {"up", json_of(c.y)},
                   {"forward", json_of(-c.z)},
                   {report.view.orthographic ? "half_height" : "tan_half_fov_y", report.view.half_height}};
    j["size"] = {report.view.width, report.view.height};
    j["nothing_to_cut"] = report.nothing_to_cut;

    Json targets = Json::array();
    for (const TargetReport& t : report.targets)
        targets.push_back(
            {{"id", index(t.part)},
             {"path", t.path},
             {"pixels_alone", t.pixels_alone},
             {"visible_before", json_of(t.visible_before)},
             {"visible_after", json_of(t.visible_after)},
             {"visible_among_targets", json_of(t.visible_among_targets)},
             {"contour_pixels", t.contour_pixels},
             {"components", t.components},
             {"closed", t.closed},
             {"covered", json_of(t.covered)},
             {"clearance_px",
              {{"min", json_of(t.clearance_min_px)},
               {"p5", json_of(t.clearance_p5_px)},
               {"mean", json_of(t.clearance_mean_px)}}},
             {"depth_asked_px", t.depth_asked_px},
             {"depth_used_px",
              {{"min", json_of(t.depth_used_min_px)},
               {"mean", json_of(t.depth_used_mean_px)},
               {"max", json_of(t.depth_used_max_px)}}},
             {"ring", {{"mean", json_of(t.ring_mean)}, {"p5", json_of(t.ring_p5)}, {"min", json_of(t.ring_min)}}},
             {"off_image_share", t.off_image_share},
             {"thin", t.thin},
             {"refused", text_or_null(t.refused)},
             {"alone", json_of(t.alone)},
             {"mask", json_of(t.mask)}});
    j["targets"] = targets;
    j["cut_parts"] = report.cut_parts;
    const CapReport& caps = report.caps;
    j["caps"] = {{"solids", caps.solids},
                 {"shells", caps.shells},
                 {"open", caps.open},
                 {"partly_open", caps.partly_open},
                 {"around_eye", caps.around_eye},
                 {"cap_pixels", caps.cap_pixels},
                 {"open_back_pixels", caps.open_back_pixels}};
    const PictureReport& p = report.picture;
    j["picture"] = {{"outline_iou", json_of(p.outline_iou)},
                    {"see_through_px", p.see_through_px},
                    {"context_removed", json_of(p.context_removed)},
                    {"parts_lost", p.parts_lost},
                    {"wall_visible", json_of(p.wall_visible)},
                    {"hole_pixels", p.hole_pixels},
                    {"crumbs",
                     {{"removed", p.crumbs.removed},
                      {"removed_px", p.crumbs.removed_px},
                      {"kept", p.crumbs.kept},
                      {"kept_px", p.crumbs.kept_px}}},
                    {"mask", json_of(p.mask)},
                    {"file", text_or_null(p.file)},
                    {"sha256", text_or_null(p.sha256)},
                    {"bits", p.bits},
                    {"no_background", p.no_background}};

    const ViewPlan::Rays& r = report.plan_rays;
    const RayCounts& f = report.frame_rays;
    const std::int64_t primary = f.primary + report.measuring_rays + r.targets + r.alone + r.enclosing + r.spans +
                                 r.loose + r.paper_step1 + r.paper_step2;
    const std::int64_t all = primary + f.all() - f.primary;
    j["rays"] = {{"targets", r.targets},
                 {"targets_alone", r.alone},
                 {"spans", r.spans},
                 {"enclosing", r.enclosing},
                 {"loose", r.loose},
                 {"paper_step1", r.paper_step1},
                 {"paper_step2", r.paper_step2},
                 {"primary", f.primary},
                 {"measuring", report.measuring_rays},
                 {"shadow", f.shadow},
                 {"ambient", f.ambient},
                 {"reflection", f.reflection},
                 {"refraction", f.refraction},
                 {"primary_share", all ? Json(double(primary) / double(all)) : Json(nullptr)}};
    j["refinement"] = report.refinement ? json_of(*report.refinement) : Json(nullptr);

    Json warnings = Json::array();
    for (const Warning& w : report.warnings)
        warnings.push_back({{"code", w.code}, {"where", w.where}, {"reason", w.reason}});
    j["warnings"] = warnings;
    const RunReport& run = report.run;
    j["run"] = {{"seconds",
                 {{"load", run.load},
                  {"build", run.build},
                  {"plan", run.plan},
                  {"render", run.render},
                  {"write", run.write},
                  {"total", run.total}}},
                {"threads", run.threads},
                {"isa", run.isa},
                {"peak_bytes", run.peak_bytes}};
    if (const std::optional<RefinementReport>& refined = report.refinement)
        j["run"]["refinement_seconds"] = {
            {"refined", {{"wall", refined->time.wall}, {"cpu", refined->time.cpu}}},
            {"full", {{"wall", refined->full_time.wall}, {"cpu", refined->full_time.cpu}}}};
    return j.dump(2, ' ', false, Json::error_handler_t::replace) + "\n";
}

} // namespace porthole
