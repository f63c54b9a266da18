#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>

#include "benchmarks.h"
#include "launcher.h"
#include "scenes.h"

namespace porthole::bench {
namespace {

namespace fs = std::filesystem;

struct Job {
    std::string name, file;
    std::vector<std::string> targets; ///< empty: a plain picture
};

/// Where the jobs write; gone at the end.
struct Folder {
    fs::path path = fs::temp_directory_path() / ("porthole_bench_" + std::to_string(::getpid()));
    Folder() { fs::create_directory(path); }
    ~Folder() {
        std::error_code ignored;
        fs::remove_all(path, ignored);
    }
};

void run(benchmark::State& state, const Job& job, Launcher& launcher) {
    static const Folder folder;
    const fs::path report = folder.path / "report.json";
    std::vector<std::string> command{PORTHOLE_PROGRAM,
                                     job.targets.empty() ? "render" : "reveal",
                                     job.file,
                                     "--quiet",
                                     "-o",
                                     folder.path / "picture.png",
                                     "--report",
                                     report};
    for (const std::string& target : job.targets) command.insert(command.end(), {"--target", target});

    double cpu_s = 0;
    std::int64_t peak_bytes = 0;
    for (auto _ : state) {
        const Finished f = launcher.run(command);
        if (f.status != 0) {
            state.SkipWithError(("the program ended with status " + std::to_string(f.status)).c_str());
            return;
        }
        state.SetIterationTime(f.wall_s);
        cpu_s += f.cpu_s;
        peak_bytes = std::max(peak_bytes, f.peak_bytes);
    }
    const nlohmann::json said = nlohmann::json::parse(std::ifstream(report));
    const auto triangles = said.at("model").at("triangles").get<double>();
    state.counters["cpu_s"] = cpu_s / double(state.iterations());
    state.counters["peak_MB"] = double(peak_bytes) / 1e6;
    state.counters["triangles"] = triangles;
    state.counters["bytes_per_triangle"] = (double(peak_bytes) - double(fs::file_size(job.file))) / triangles;
    for (const auto& [stage, s] : said.at("run").at("seconds").items())
        state.counters[stage + "_s"] = s.is_number() ? s.get<double>() : 0;
}

} // namespace

void add_jobs(const Settings& settings, Launcher& launcher) {
    std::vector<Job> jobs{{"gearbox", PORTHOLE_GEARBOX, {"planet_gear_*"}}};
    const auto add_scenes = [&](const std::vector<SceneSpec>& specs) {
        for (const SceneSpec& s : specs) jobs.push_back({s.name, s.file, s.targets});
    };
    add_scenes(scenes({"assembly"}));
    if (!settings.quick) {
        add_scenes(scenes({"assembly10x", "engine", "body"}));
        if (const std::string cortex = shared_model("large/brain_cortex_6M_draco.glb"); !cortex.empty())
            jobs.push_back({"cortex", cortex, {}});
    }
    for (const Job& job : jobs)
        add("job/" + job.name + '/' + (job.targets.empty() ? "render" : "reveal"), [job, &launcher](
                                                                                       benchmark::State& state) {
            run(state, job, launcher);
        })->UseManualTime();
}

} // namespace porthole::bench
