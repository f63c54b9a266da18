// porthole check: is a report true?
#include "porthole/check.h"

#include <filesystem>
#include <nlohmann/json.hpp>
#include <system_error>

#include "picture.h"
#include "porthole/base/sha256.h"
#include "porthole/io/files.h"
#include "porthole/io/image_file.h"
#include "session.h"

namespace porthole::cli {

namespace {

namespace fs = std::filesystem;

/// A file that the report names: as it stands, or beside the report.
/// @throws Error input E0201.
std::string find_named(const std::string& name, const std::string& report_path, bool from_here, const char* option) {
    const fs::path folder = report_path == "-" ? fs::path() : fs::path(report_path).parent_path();
    std::vector<fs::path> places;
    if (from_here) places.emplace_back(name);
    places.push_back(folder / name);
    places.push_back(folder / fs::path(name).filename());
    std::error_code ignored;
    for (const fs::path& place : places)
        if (fs::is_regular_file(place, ignored)) return place.string();
    throw Error(
        ErrorKind::input, "E0201", name,
        std::string("the report names this file, but it is neither there nor beside the report; say where with ") +
            option);
}

std::string line_of(const Difference& d) {
    return escaped(d.what) + ": " + escaped(d.where) + ": reported " + escaped(d.reported) + ", found " +
           escaped(d.found);
}

std::string as_json(const Checked& checked, const std::string& picture) {
    using Json = nlohmann::ordered_json;
    Json j;
    j["good"] = checked.good();
    Json differences = Json::array();
    for (const Difference& d : checked.differences)
        differences.push_back({{"what", d.what}, {"where", d.where}, {"reported", d.reported}, {"found", d.found}});
    j["differences"] = differences;
    j["unlisted"] = checked.unlisted;
    j["target_pixels"] = checked.target_pixels;
    j["hole_pixels"] = checked.hole_pixels;
    j["tied_pixels"] = checked.tied_pixels;
    j["picture"] = picture.empty() ? Json(nullptr) : Json(picture);
    j["inside_pixels"] = checked.inside_pixels;
    j["outside_pixels"] = checked.outside_pixels;
    j["rays"] = checked.rays;
    j["crossings"] = checked.crossings;
    return j.dump(2, ' ', false, Json::error_handler_t::replace) + "\n";
}

} // namespace

int run_check(const CheckOptions& options, Output& out, const Control& control) {
    const Stopwatch total;
    const FileBytes file{fs::path(options.report)};
    const Report reported = read_report(file.text(), options.report);
    if (reported.version != PORTHOLE_VERSION)
        out.warning({"W0106", options.report,
                     "written by porthole " + reported.version.substr(0, 40) + ", this is " + PORTHOLE_VERSION +
                         ": pixels may differ"});
    const std::uint64_t most = memory_limit(options.common);
    const View& view = reported.view;
    check_size({view.width, view.height}, most, options.report + ":/size");

    // The model, read as it was read then.
    CommonOptions common = options.common;
    if (common.model.empty()) {
        if (reported.model.path == "-")
            throw Error(ErrorKind::usage, "E0108", "--model",
                        "the report's model came from standard input; say where it is");
        common.model = find_named(reported.model.path, options.report, true, "--model");
    }
    common.load.format = reported.model.format, common.load.time = reported.model.time;
    common.load.up = reported.model.up, common.load.metres_per_unit = reported.model.metres_per_unit;
    const Scene scene = load(common, out, control);
    require_parts(scene);

    // Its picture.
    PictureOptions picture;
    picture.output = options.picture;
    if (picture.output.empty() && !reported.picture.file.empty())
        picture.output = find_named(reported.picture.file, options.report, false, "--picture");
    picture.bits = reported.picture.bits, picture.no_background = reported.picture.no_background;
    picture.render = reported.options.render;
    Image<Rgba16> pixels;
    CheckParams params;
    params.max_bytes = most;
    std::vector<Difference> files;
    if (!reported.model.sha256.empty()) {
        const std::string found = digest_file(fs::path(common.model), control.stop).sha256;
        if (found != reported.model.sha256)
            files.push_back({"model", common.model, "sha256 " + reported.model.sha256, found});
    }
    if (!picture.output.empty()) {
        const FileBytes bytes{fs::path(picture.output)};
        pixels = decode_values(bytes.bytes(), picture.output);
        if (sha256(bytes.bytes()) != reported.picture.sha256)
            out.warning({"W0107", picture.output,
                         "not the file that the report names, byte for byte; its pixels are compared"});
        params.picture = &pixels;
        params.lossy = is_jpeg(picture.output);
        params.as_in_file = [&picture, &control](const Frame& frame) {
            return decode_values(encode_picture(frame, picture, control), picture.output);
        };
    }

    out.progress("build", 0);
    const MeshBvhs meshes = build_mesh_bvhs(scene, {.isa = reported.run.isa}, control);
    out.progress("check", 0);
    Checked checked = check_report(meshes, reported, file.text(), params, control);
    out.done();
    checked.differences.insert(checked.differences.begin(), files.begin(), files.end());

    if (options.json) {
        print(as_json(checked, picture.output));
    } else {
        std::string text;
        for (const Difference& d : checked.differences) text += line_of(d) + '\n';
        for (const auto& [what, n] : checked.unlisted)
            text += escaped(what) + ": " + with_commas(n) + (n == 1 ? " more difference\n" : " more differences\n");
        print(text);
    }
    std::string summary =
        with_commas(checked.target_pixels) + " target pixels, " + with_commas(checked.hole_pixels) + " of the hole";
    if (params.picture)
        summary += "; of the picture " + with_commas(checked.inside_pixels) + " against the reveal, " +
                   with_commas(checked.outside_pixels) + " against the plain picture";
    else
        summary += ", no picture";
    if (checked.tied_pixels > 0) summary += "; " + with_commas(checked.tied_pixels) + " where surfaces tie";
    out.info((checked.good() ? "the report is true: " : "the report is not true: ") + summary + ", " +
             in_seconds(total.seconds()));
    return checked.good() ? kExitDone : kExitDifferences;
}

} // namespace porthole::cli
