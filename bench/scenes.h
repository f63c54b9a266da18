// The named scenes of the benchmarks, each loaded and built once, when first asked for.
#pragma once

#include <benchmark/benchmark.h>

#include <initializer_list>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "bare_embree.h"
#include "porthole/plan.h"
#include "porthole/render/render.h"

namespace porthole::bench {

struct SceneSpec {
    std::string name;
    std::string file;                 ///< empty: procedural
    Scene (*make)() = nullptr;        ///< procedural
    std::vector<std::string> targets; ///< selectors; empty: none
};

/// Those of `names` that are there, in that order. Procedural scenes always are: spheres, wires, balls, clutter,
/// crowd.
/// engine, house, mosquito, office, saw, body, worm and head are files below $PORTHOLE_SHARED/models; assembly and
/// assembly10x are $PORTHOLE_ASSEMBLY and $PORTHOLE_ASSEMBLY_10X.
[[nodiscard]] std::vector<SceneSpec> scenes(std::initializer_list<std::string_view> names);

/// Path of a model below $PORTHOLE_SHARED/models; empty if there is none.
[[nodiscard]] std::string shared_model(const std::string& path);

/// A scene with its hierarchies and views. Not safe to use from several threads.
class Stage {
public:
    explicit Stage(const SceneSpec& spec);
    Stage(const Stage&) = delete;
    Stage& operator=(const Stage&) = delete;

    [[nodiscard]] const Scene& scene() const { return scene_; }
    [[nodiscard]] const MeshBvhs& meshes() const { return meshes_; }
    [[nodiscard]] const Bvh& whole() const { return whole_; }
    [[nodiscard]] const std::vector<PartId>& targets() const { return targets_; }
    [[nodiscard]] const Subject& subject() const;
    [[nodiscard]] const BareEmbree& bare() const;
    /// The whole model from above a corner, 16:9.
    [[nodiscard]] View view(int height_px) const;
    /// The same, as near to the targets as `porthole reveal` goes.
    [[nodiscard]] View target_view(int height_px) const;

private:
    Scene scene_;
    MeshBvhs meshes_;
    Bvh whole_;
    std::vector<PartId> targets_;
    mutable std::unique_ptr<Subject> subject_;
    mutable std::unique_ptr<BareEmbree> bare_;
};

/// The stage of a scene; lives as long as the program.
[[nodiscard]] Stage& stage(const SceneSpec& spec);

/// One thread, so that ratios do not depend on how threads are scheduled.
[[nodiscard]] const Control& one_thread();

/// Registers a benchmark that counts the CPU time of all threads.
template <typename F> benchmark::internal::Benchmark* add(const std::string& name, F function) {
    return benchmark::RegisterBenchmark(name.c_str(), std::move(function))
        ->Unit(benchmark::kMillisecond)
        ->MeasureProcessCPUTime();
}

/// The counters dB (99: no channel of the 8-bit pictures differs), wrong_ids_%, missed and traced_% of a frame.
void count_differences(benchmark::State& state, const Frame& frame, const Frame& full);

} // namespace porthole::bench
