#include "scenes.h"

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <map>
#include <random>

#include "porthole/io/load.h"
#include "porthole/render/compare.h"
#include "porthole/scene/camera.h"
#include "porthole/scene/select.h"
#include "support/shapes.h"

namespace porthole::bench {
namespace {

/// Three smooth spheres, one within a crescent of another's shadow: few edges.
Scene spheres() {
    test::Builder b(200);
    b.add_sphere("large", {}, 2);
    b.add_sphere("middle", {2.6, 0.4, 1.2}, 1.2);
    b.add_sphere("small", {0.3, 2.6, 0.6}, 0.8);
    return std::move(b.scene);
}

/// A thousand strings of beads one or two pixels thick: nothing but edges.
Scene wires() {
    test::Builder b(6);
    std::mt19937 random(7);
    std::uniform_real_distribution<double> u(-1, 1);
    for (int i = 0; i < 1000; ++i) {
        const Vec3d from{u(random), u(random), u(random)}, to{u(random), u(random), u(random)};
        for (int k = 0; k < 24; ++k) b.add_sphere("wire" + std::to_string(i), from + (to - from) * (k / 24.0), 0.004);
    }
    return std::move(b.scene);
}

/// A shell around many small balls.
Scene balls() {
    test::Builder b(100);
    b.add_sphere("shell", {}, 2);
    std::mt19937 random(4);
    std::uniform_real_distribution<double> u(-1, 1);
    for (int i = 0; i < 120; ++i) b.add_sphere("ball" + std::to_string(i), {u(random), u(random), u(random)}, 0.12);
    return std::move(b.scene);
}

/// A closed shell of 200,000 triangles around balls, rods and wires down to a pixel's width.
Scene clutter() {
    test::Builder b(24);
    const auto shell = std::uint32_t(b.scene.meshes.size());
    b.scene.meshes.push_back(test::sphere(224));
    b.add("shell", shell, {}, {2, 2, 2});
    std::mt19937 random(4);
    std::uniform_real_distribution<double> u(-1, 1);
    for (int i = 0; i < 400; ++i) {
        const Vec3d c{u(random), u(random), u(random)};
        const std::string name = "part_" + std::to_string(i);
        if (i % 4 == 0) b.add_sphere(name, c, 0.09);
        if (i % 4 == 1) b.add_box(name, c, {0.12, 0.03, 0.02});
        if (i % 4 == 2) b.add_box(name, c, {0.004, 0.15, 0.004});
        if (i % 4 == 3) b.add_sphere(name, c, 0.02);
    }
    return std::move(b.scene);
}

/// A closed shell of 200,000 triangles around 500 parts of 5,000 and, six to each of those, 3,000 balls and
/// wires about a pixel thick. Every seventh part is a large one.
Scene crowd() {
    test::Builder b(3);
    const auto shell = std::uint32_t(b.scene.meshes.size()), fine = shell + 1;
    b.scene.meshes.push_back(test::sphere(224));
    b.scene.meshes.push_back(test::sphere(36));
    b.add("shell", shell, {}, {2, 2, 2});
    std::mt19937 random(4);
    std::uniform_real_distribution<double> u(-1, 1);
    const auto somewhere = [&] {
        const double x = u(random), y = u(random), z = u(random);
        return Vec3d{x, y, z};
    };
    for (int i = 0; i < 500; ++i) {
        const std::string name = "part_" + std::to_string(i);
        const double wide = 0.06 + 0.03 * std::abs(u(random)), high = 0.03 + 0.09 * std::abs(u(random));
        b.add(name, fine, somewhere(), {wide, high, 0.07});
        for (int k = 0; k < 4; ++k) b.add_sphere(name + "_ball", somewhere(), 0.002);
        b.add_box(name + "_wire", somewhere(), {0.1, 0.001, 0.001});
        b.add_box(name + "_wire", somewhere(), {0.001, 0.1, 0.001});
    }
    return std::move(b.scene);
}

std::string environment(const char* name) {
    const char* value = std::getenv(name);
    return value ? value : "";
}

std::vector<SceneSpec> known() {
    return {{"spheres", "", spheres, {}},
            {"wires", "", wires, {}},
            {"balls", "", balls, {"ball1*"}},
            {"clutter", "", clutter, {"part_1*"}},
            {"crowd", "", crowd, {"part_1*"}},
            {"assembly", environment("PORTHOLE_ASSEMBLY"), nullptr, {"part_00"}},
            {"assembly10x", environment("PORTHOLE_ASSEMBLY_10X"), nullptr, {"part_00"}},
            {"engine", shared_model("assembly/2CylinderEngine.glb"), nullptr, {"rod_123-699*"}},
            {"house", shared_model("assembly/FZK_Haus.glb"), nullptr, {}},
            {"mosquito", shared_model("assembly/MosquitoInAmber.glb"), nullptr, {}},
            {"office", shared_model("assembly/Office_A.glb"), nullptr, {}},
            {"saw", shared_model("assembly/ReciprocatingSaw.glb"), nullptr, {"body_69"}},
            {"body", shared_model("assembly/vh_male_body.glb"), nullptr, {"VH_M_heart_left_ventricle"}},
            {"worm", shared_model("assembly/virtual_worm.glb"), nullptr, {"pm5d"}},
            {"head", shared_model("medical/head_brain_mri.glb"), nullptr, {"Thalamus_L"}}};
}

} // namespace

std::string shared_model(const std::string& path) {
    const std::string shared = environment("PORTHOLE_SHARED");
    const std::string file = shared + "/models/" + path;
    return !shared.empty() && std::filesystem::exists(file) ? file : "";
}

std::vector<SceneSpec> scenes(std::initializer_list<std::string_view> names) {
    const std::vector<SceneSpec> all = known();
    std::vector<SceneSpec> chosen;
    for (const std::string_view name : names)
        std::copy_if(all.begin(), all.end(), std::back_inserter(chosen),
                     [&](const SceneSpec& s) { return s.name == name && (s.make || !s.file.empty()); });
    return chosen;
}

Stage::Stage(const SceneSpec& spec)
    : scene_(spec.make ? spec.make() : load_scene(spec.file)), meshes_(build_mesh_bvhs(scene_)),
      whole_(build_bvh(meshes_, all_parts(scene_))) {
    if (!spec.targets.empty()) targets_ = select_parts(scene_, spec.targets);
}

const Subject& Stage::subject() const {
    if (!subject_) subject_ = std::make_unique<Subject>(make_subject(meshes_, targets_));
    return *subject_;
}

const BareEmbree& Stage::bare() const {
    if (!bare_) bare_ = std::make_unique<BareEmbree>(scene_);
    return *bare_;
}

namespace {

View from_corner(const Scene& scene, const std::vector<PartId>& parts, int height_px) {
    return view_from_direction(frame_subject(scene, parts), {1.0f, 0.8f, 1.0f}, {}, height_px * 16 / 9, height_px);
}

} // namespace

View Stage::view(int height_px) const { return from_corner(scene_, {}, height_px); }

View Stage::target_view(int height_px) const { return from_corner(scene_, targets_, height_px); }

Stage& stage(const SceneSpec& spec) {
    static std::map<std::string, std::unique_ptr<Stage>> stages;
    std::unique_ptr<Stage>& s = stages[spec.name];
    if (!s) s = std::make_unique<Stage>(spec);
    return *s;
}

const Control& one_thread() {
    static const Control control{{}, {}, 1};
    return control;
}

void count_differences(benchmark::State& state, const Frame& frame, const Frame& full) {
    const Refinement r = compare_frames(frame, full, {1, 1, 1});
    state.counters["dB"] = std::min(99.0, r.psnr_db());
    state.counters["wrong_ids_%"] = 100 * double(r.wrong_ids) / double(r.pixels);
    state.counters["missed"] = double(r.missed.size());
    state.counters["traced_%"] = 100 * double(r.traced) / double(r.pixels);
}

} // namespace porthole::bench
