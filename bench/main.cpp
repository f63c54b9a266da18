// Speed claims, as ratios within one run: every scene brings its own yardstick. docs/performance.md
// says what they are; scripts/bench builds and runs this, and prints the ratios.
//
//   porthole_bench [--quick] --benchmark_enable_random_interleaving=true --benchmark_repetitions=3
//                  --benchmark_out=FILE
#include <benchmark/benchmark.h>

#include <algorithm>
#include <cstring>
#include <thread>

#include "benchmarks.h"
#include "launcher.h"

int main(int argc, char** argv) {
    using namespace porthole::bench;
    Launcher launcher; // before anything takes memory
    char** const end = std::remove_if(argv + 1, argv + argc, [](const char* a) { return !std::strcmp(a, "--quick"); });
    const Settings settings{.quick = end != argv + argc};
    argc = int(end - argv);
    *end = nullptr;

    add_primary(settings);
    add_refine(settings);
    add_antialias(settings);
    add_contours(settings);
    add_cut(settings);
    add_threads(settings);
    add_instances(settings);
    add_jobs(settings, launcher);

    benchmark::Initialize(&argc, argv);
    if (benchmark::ReportUnrecognizedArguments(argc, argv)) return 2;
    benchmark::AddCustomContext("quick", settings.quick ? "yes" : "no");
    benchmark::RunSpecifiedBenchmarks();
    return 0;
}
