#include "session.h"

#include <algorithm>
#include <filesystem>
#include <sys/resource.h>
#include <unistd.h>

#include "picture.h"

namespace porthole::cli {

int exit_code(ErrorKind kind) {
    switch (kind) {
    case ErrorKind::usage: return kExitUsage;
    case ErrorKind::input: return kExitInput;
    case ErrorKind::output: return kExitOutput;
    case ErrorKind::limit: return kExitLimit;
    case ErrorKind::bug: break;
    }
    return kExitBug;
}

std::uint64_t memory_limit(const CommonOptions& options) {
    if (options.max_memory != 0) return options.max_memory;
    const auto pages = ::sysconf(_SC_PHYS_PAGES), page = ::sysconf(_SC_PAGE_SIZE);
    if (pages <= 0 || page <= 0) return options.load.max_bytes;
    return std::min(options.load.max_bytes, std::uint64_t(pages) * std::uint64_t(page) / 4 * 3);
}

void limit_memory(const CommonOptions& options) {
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
    (void)options; // their shadow memory alone is above any limit
#else
    if (options.max_memory == 0) return;
    rlimit limit{};
    if (::getrlimit(RLIMIT_DATA, &limit) != 0) return;
    limit.rlim_cur = std::min<rlim_t>(options.max_memory, limit.rlim_max);
    ::setrlimit(RLIMIT_DATA, &limit);
#endif
}

Scene load(const CommonOptions& options, Output& out, const Control& control) {
    LoadParams params = options.load;
    params.max_bytes = memory_limit(options);
    out.progress("load", 0);
    Scene scene = load_scene(options.model, params, control);
    out.done(scene.format + ", " + with_commas(std::int64_t(scene.parts.size())) + " parts, " +
             with_commas(std::int64_t(triangle_count(scene))) + " triangles");
    for (const Warning& warning : scene.warnings) out.warning(warning);
    return scene;
}

void require_parts(const Scene& scene) {
    // A model whose triangles all lack area has parts, a warning, and an empty picture.
    if (scene.parts.empty())
        throw Error(ErrorKind::input, "E0206", scene.source, "holds no triangles: there is nothing to draw");
}

ModelDigest digest_model(const CommonOptions& common, const PictureOptions& picture, const Control& control) {
    const std::filesystem::path model(common.model);
    std::error_code failure;
    const bool wanted = asks_for_report(picture) && model != "-" && std::filesystem::is_regular_file(model, failure);
    return std::async(wanted ? std::launch::async : std::launch::deferred,
                      [model, wanted, stop = control.stop]() -> std::optional<FileDigest> {
                          if (!wanted) return std::nullopt;
                          return digest_file(model, stop);
                      });
}

void fill_report(Report& report, const char* command, const Scene& scene, const CommonOptions& common,
                 const PictureOptions& picture, ModelDigest digest) {
    report.version = PORTHOLE_VERSION;
    report.command = command;
    report.model.path = common.model;
    report.model.format = common.load.format;
    report.model.time = common.load.time;
    report.model.up = common.load.up;
    report.model.metres_per_unit = common.load.metres_per_unit;
    if (const std::optional<FileDigest> file = digest.get()) {
        report.model.bytes = file->bytes;
        report.model.sha256 = file->sha256;
    }
    report.picture.bits = picture.bits;
    report.picture.no_background = picture.no_background;
    report.model.parts = std::int64_t(scene.parts.size());
    report.model.triangles = std::int64_t(triangle_count(scene));
    const CameraParams& camera = picture.camera;
    if (camera.position || camera.direction)
        report.camera = "custom";
    else if (report.camera.empty())
        report.camera = is_auto(camera) ? "iso" : camera.name;
    report.warnings.insert(report.warnings.begin(), scene.warnings.begin(), scene.warnings.end());
    report.run.isa = picture.isa;
    rusage usage{};
    if (::getrusage(RUSAGE_SELF, &usage) == 0) report.run.peak_bytes = std::int64_t(usage.ru_maxrss) * 1024;
}

} // namespace porthole::cli
