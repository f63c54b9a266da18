#include "picture.h"

#include <cmath>
#include <cstdio>
#include <filesystem>
#include <system_error>
#include <unistd.h>

#include "output.h"
#include "porthole/base/sha256.h"
#include "porthole/base/tone.h"
#include "porthole/io/files.h"
#include "porthole/io/image_file.h"
#include "porthole/report_fields.h"

namespace porthole::cli {

namespace {

namespace fs = std::filesystem;

constexpr std::uint64_t kBytesPerPixel = 160; ///< of two frames, a hole over all of them, and the file

std::string lower_extension(const std::string& path) {
    std::string extension = fs::path(path).extension().string();
    for (char& c : extension)
        if (c >= 'A' && c <= 'Z') c = char(c - 'A' + 'a');
    return extension;
}

void check_writable(const std::string& path, bool no_clobber) {
    if (path.empty() || path == "-") return;
    std::error_code ignored;
    if (fs::is_directory(path, ignored)) throw Error(ErrorKind::output, "E0801", path, "is a folder");
    if (no_clobber && fs::exists(fs::symlink_status(path, ignored)))
        throw Error(ErrorKind::output, "E0804", path, "exists, and --no-clobber says to leave it");
    const fs::path folder = fs::path(path).has_parent_path() ? fs::path(path).parent_path() : fs::path(".");
    if (!fs::is_directory(folder, ignored))
        throw Error(ErrorKind::output, "E0801", path, "there is no folder " + folder.string());
    if (::access(folder.c_str(), W_OK) != 0)
        throw Error(ErrorKind::output, "E0801", path, "the folder cannot be written to");
}

} // namespace

bool is_jpeg(const std::string& path) {
    const std::string extension = lower_extension(path);
    return extension == ".jpg" || extension == ".jpeg";
}

void check_size(Vec2i size, std::uint64_t max_memory, const std::string& where) {
    const std::uint64_t needed = std::uint64_t(size.x) * std::uint64_t(size.y) * kBytesPerPixel;
    if (needed > max_memory)
        throw Error(ErrorKind::limit, "E0901", where,
                    std::to_string(size.x) + 'x' + std::to_string(size.y) + " needs about " +
                        std::to_string(needed >> 20) + " MB, " + std::to_string(max_memory >> 20) +
                        " MB are allowed (--max-memory)");
}

bool asks_for_report(const PictureOptions& options) { return options.json || !options.report_path.empty(); }

void check_outputs(const PictureOptions& options, std::uint64_t max_memory) {
    const auto usage = [](const char* code, const std::string& where, const std::string& reason) {
        return Error(ErrorKind::usage, code, where, reason);
    };
    const std::string& out = options.output;
    if (!out.empty() && out != "-" && lower_extension(out) != ".png" && !is_jpeg(out))
        throw usage("E0106", "--output " + out,
                    "the name must end in .png, .jpg or .jpeg, or be - for a PNG on standard output");
    if (is_jpeg(out) && options.bits != 8) throw usage("E0106", "--bits", "JPEG has 8 bits a channel; write a .png");
    if (is_jpeg(out) && options.no_background)
        throw usage("E0106", "--no-background", "JPEG has no transparency; write a .png");
    const bool report_on_stdout = options.json || options.report_path == "-";
    if (out == "-" && report_on_stdout)
        throw usage("E0107", "--output -", "picture and report cannot both go to standard output");
    if (!out.empty() && out != "-" && out == options.report_path)
        throw usage("E0107", "--report " + out, "picture and report cannot be the same file");
    if (out == "-" && ::isatty(STDOUT_FILENO) == 1)
        throw usage("E0107", "--output -", "standard output is a terminal; send the PNG to a file or a pipe");

    check_size(options.size, max_memory, "--size");
    check_writable(out, options.no_clobber);
    check_writable(options.report_path, options.no_clobber);
}

std::vector<std::byte> encode_picture(const Frame& frame, const PictureOptions& options, const Control& control) {
    const bool alpha = options.no_background;
    const Vec3f background = options.render.background;
    if (is_jpeg(options.output)) return encode_jpeg(to_srgb8(frame.color, background, false, control));
    if (options.bits == 16)
        return encode_png16(to_srgb16(frame.color, background, alpha, control), frame.color.width(),
                            frame.color.height(), alpha ? 4 : 3, control);
    return encode_png(to_srgb8(frame.color, background, alpha, control), alpha ? 4 : 3, control);
}

void write_picture(const Frame& frame, const PictureOptions& options, PictureReport& report, const Control& control) {
    const std::vector<std::byte> bytes = encode_picture(frame, options, control);
    write_file(options.output, bytes, options.no_clobber);
    if (!asks_for_report(options)) return;
    report.sha256 = sha256(bytes);
    if (options.output == "-") return;
    const bool beside = !options.report_path.empty() && options.report_path != "-";
    const fs::path folder = beside ? fs::absolute(options.report_path).parent_path() : fs::current_path();
    report.file =
        fs::absolute(options.output).lexically_normal().lexically_proximate(folder.lexically_normal()).string();
}

std::string summary(const RefinementReport& report, Refine refine) {
    const Refinement& r = report.figures;
    const auto number = [](const char* format, double value) {
        char text[32];
        std::snprintf(text, sizeof text, format, value);
        return std::string(text);
    };
    const auto percent = [&](std::int64_t n) {
        return number("%.4g %%", r.pixels ? 100 * double(n) / double(r.pixels) : 0.0);
    };
    const std::string quality = std::isfinite(r.psnr_db()) ? number("%.1f dB", r.psnr_db()) : "the same picture";
    return std::string(fields::name_of(refine)) + " against full: " + percent(r.traced) + " of the pixels traced, " +
           with_commas(r.rays.all()) + " rays of " + with_commas(r.full_rays.all()) + ", " + quality + ", " +
           with_commas(r.wrong_ids) + (r.wrong_ids == 1 ? " wrong id (" : " wrong ids (") + percent(r.wrong_ids) +
           "), " + with_commas(std::int64_t(report.missed_parts.size())) +
           (report.missed_parts.size() == 1 ? " part missed, " : " parts missed, ") + number("%.2f", report.time.cpu) +
           " CPU-s of " + number("%.2f", report.full_time.cpu) + ", " + in_seconds(report.time.wall) + " of " +
           in_seconds(report.full_time.wall);
}

void write_report(const Report& report, const PictureOptions& options) {
    const std::string text = to_json(report);
    if (!options.report_path.empty())
        write_file(options.report_path, std::as_bytes(std::span(text)), options.no_clobber);
    if (options.json && options.report_path != "-") print(text);
}

} // namespace porthole::cli
