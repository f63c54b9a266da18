// Reports that are true pass; each thing altered by hand is caught.
#include "porthole/check.h"

#include <gtest/gtest.h>

#include <array>
#include <nlohmann/json.hpp>
#include <random>

#include "porthole/base/tone.h"
#include "porthole/check_dense.h"
#include "porthole/io/load.h"
#include "porthole/scene/select.h"
#include "support/shapes.h"

namespace porthole {
namespace {

using test::Builder;
using test::look;
using Json = nlohmann::ordered_json;

Image<Rgba16> as_in_file(const Frame& frame) {
    const Image<Rgba8> bytes = to_srgb8(frame.color, {1, 1, 1}, false);
    Image<Rgba16> values(bytes.window());
    for (std::size_t i = 0; i < bytes.pixels().size(); ++i) {
        const Rgba8 c = bytes.pixels()[i];
        values.pixels()[i] = {c.r, c.g, c.b, c.a};
    }
    return values;
}

/// A run with its report and picture, as the command line would have written them.
struct Finished {
    Scene scene;
    std::unique_ptr<MeshBvhs> meshes;
    std::string text;
    Image<Rgba16> picture;
    ViewPlan plan;

    Finished(Scene&& made, RevealParams params) : scene(std::move(made)) {
        meshes = std::make_unique<MeshBvhs>(build_mesh_bvhs(scene));
        params.render.samples = 4;
        Revealed revealed = reveal(*meshes, params);
        revealed.report.command = "reveal";
        revealed.report.version = "test";
        revealed.report.model.path = "made";
        revealed.report.run = {}; // the same text every time
        revealed.report.run.isa = "avx2";
        text = to_json(revealed.report);
        if (!revealed.plan.nothing_revealed()) picture = as_in_file(revealed.frame);
        plan = std::move(revealed.plan);
    }

    [[nodiscard]] Checked check() const { return check(text); }
    [[nodiscard]] Checked check(const std::string& report, int threads = 0) const {
        CheckParams params;
        if (!picture.empty()) params.picture = &picture, params.as_in_file = as_in_file;
        return check_report(*meshes, read_report(report, "test"), report, params, test::with_threads(threads));
    }
    /// With one value of the report replaced.
    [[nodiscard]] Checked altered(const std::string& pointer, const Json& value) const {
        Json json = Json::parse(text);
        EXPECT_TRUE(json.contains(Json::json_pointer(pointer))) << pointer;
        json[Json::json_pointer(pointer)] = value;
        return check(json.dump());
    }
    [[nodiscard]] Json at(const std::string& pointer) const {
        return Json::parse(text).at(Json::json_pointer(pointer));
    }
};

std::string said(const Checked& checked) {
    std::string all;
    for (const Difference& d : checked.differences)
        all += d.what + ": " + d.where + ": reported " + d.reported + ", found " + d.found + '\n';
    return all;
}

std::int64_t count(const Checked& checked, const std::string& what) {
    const auto more = checked.unlisted.find(what);
    return std::count_if(checked.differences.begin(), checked.differences.end(),
                         [&](const Difference& d) { return d.what == what; }) +
           (more == checked.unlisted.end() ? 0 : more->second);
}

bool has(const Checked& checked, const std::string& what, const std::string& where) {
    return std::any_of(checked.differences.begin(), checked.differences.end(),
                       [&](const Difference& d) { return d.what == what && d.where == where; });
}

/// A ball and a bolt in a thick box that stands on a plate.
Finished box_run(HoleStyle style = HoleStyle::cutaway, bool orthographic = false) {
    Builder b;
    const PartId ball = b.add_sphere("ball", {0.1, 0, 0}, 0.35);
    const PartId bolt = b.add_box("bolt", {-0.4, 0.1, 0.1}, {0.1, 0.3, 0.1});
    b.add_box("box", {0, 0, 0}, {1, 0.7, 0.8});
    b.add_box("plate", {0, -0.8, 0}, {2, 0.1, 2});
    RevealParams params;
    params.targets = {ball, bolt};
    params.view = look({2, 2, 4}, {}, 160, 120, orthographic ? 1.3f : 0.3f, orthographic);
    params.plan.style = style;
    params.plan.depth = Length{Length::Unit::pixel, 6};
    return {std::move(b.scene), params};
}

TEST(Check, TrueReportsPass) {
    for (const HoleStyle style : {HoleStyle::cutaway, HoleStyle::hole, HoleStyle::paper})
        for (const bool orthographic : {false, true}) {
            const Finished run = box_run(style, orthographic);
            ASSERT_FALSE(run.plan.nothing_to_cut());
            const Checked checked = run.check();
            EXPECT_TRUE(checked.good()) << said(checked);
            EXPECT_GT(checked.target_pixels, 500);
            EXPECT_GE(checked.hole_pixels, checked.target_pixels);
            EXPECT_GE(checked.inside_pixels, checked.hole_pixels);
            EXPECT_EQ(checked.inside_pixels + checked.outside_pixels, 160 * 120);
        }
}

TEST(Check, RestyledPicturesAreHeldAgainstTheReveal) {
    const auto good = [](HoleStyle style, Rest rest, Lines lines) {
        Builder b;
        RevealParams params;
        params.targets = {b.add_sphere("ball", {0.1, 0, 0}, 0.35)};
        b.add_box("box", {0, 0, 0}, {1, 0.7, 0.8});
        b.add_box("plate", {0, -0.8, 0}, {2, 0.1, 2});
        params.view = look({2, 2, 4}, {}, 160, 120, 0.3f);
        params.plan.style = style;
        params.rest = rest;
        params.render.lines = lines;
        Finished run(std::move(b.scene), params);
        const Checked checked = run.check();
        EXPECT_TRUE(checked.good()) << said(checked);
        run.picture(1, 1).r ^= 1;
        EXPECT_TRUE(has(run.check(), "picture outside", "pixel 1,1"));
        return checked;
    };
    for (const Rest rest : {Rest::dim, Rest::line, Rest::ghost})
        EXPECT_EQ(good(HoleStyle::cutaway, rest, Lines::rim).outside_pixels, 0);
    EXPECT_EQ(good(HoleStyle::ghost, Rest::keep, Lines::rim).outside_pixels, 0);
    EXPECT_GT(good(HoleStyle::cutaway, Rest::keep, Lines::all).outside_pixels, 0);
}

TEST(Check, SaysTheSameWithAnyNumberOfThreads) {
    const Finished run = box_run();
    Json json = Json::parse(run.text);
    json["picture"]["mask"]["runs"] = "";
    const Checked one = run.check(json.dump(), 1), seven = run.check(json.dump(), 7);
    EXPECT_FALSE(one.good());
    EXPECT_EQ(said(one), said(seven));
    EXPECT_EQ(one.crossings, seven.crossings);
    EXPECT_EQ(one.tied_pixels, seven.tied_pixels);
}

TEST(Check, TrueReportsOfOddViewsPass) {
    const auto good = [](Scene&& scene, const RevealParams& params, const char* what) {
        const Finished run(std::move(scene), params);
        const Checked checked = run.check();
        EXPECT_TRUE(checked.good()) << what << '\n' << said(checked);
    };
    RevealParams params;
    params.view = look({0, 0, 6}, {}, 120, 90, 0.3f);
    params.plan.depth = Length{Length::Unit::pixel, 5};
    {
        Builder b;
        params.targets = {b.add_sphere("pea", {0.2, 0.1, 0}, 0.02)};
        b.add_sphere("shell", {}, 1);
        good(std::move(b.scene), params, "thin target");
    }
    {
        Builder b;
        params.targets = {b.add_sphere("inner", {}, 0.99)};
        b.add_sphere("outer", {}, 1);
        good(std::move(b.scene), params, "refused target");
    }
    {
        Builder b;
        params.targets = {b.add_sphere("seen", {}, 0.5), b.add_sphere("absent", {0, 50, 0}, 0.5)};
        good(std::move(b.scene), params, "nothing to cut, one absent");
    }
    {
        Builder b; // at the edge of the picture
        params.targets = {b.add_sphere("inner", {2.3, 0, 0}, 0.4)};
        b.add_sphere("outer", {2.3, 0, 0}, 1);
        good(std::move(b.scene), params, "partly beyond the picture");
    }
    {
        Builder b; // two targets with a common face in one plane, and a copy of one in place
        params.targets = {b.add_box("left", {-0.25, 0, 0}, {0.25, 0.3, 0.2}),
                          b.add_box("right", {0.1, 0.1, 0}, {0.25, 0.3, 0.2}),
                          b.add_box("again", {0.1, 0.1, 0}, {0.25, 0.3, 0.2})};
        b.add_box("case", {0, 0, 0}, {0.9, 0.8, 0.7});
        const Finished run(std::move(b.scene), params);
        const Checked checked = run.check();
        EXPECT_TRUE(checked.good()) << said(checked);
        EXPECT_GT(checked.tied_pixels, 20); // or the case would show nothing
    }
    {
        Builder b; // a kept part hides the target partly
        params.targets = {b.add_sphere("inner", {}, 0.4)};
        params.keep = {b.add_box("bar", {0, 0, 0.6}, {0.1, 0.9, 0.05})};
        b.add_sphere("outer", {}, 1);
        good(std::move(b.scene), params, "kept part");
    }
}

TEST(Check, AlteredMaskIsCaught) {
    const Finished run = box_run();
    Mask mask = run.plan.hole.mask;
    const Rect w = mask.window();
    Vec2i first{-1, -1};
    for (int y = w.y0; y < w.y1 && first.x < 0; ++y)
        for (int x = w.x0; x < w.x1 && first.x < 0; ++x)
            if (mask(x, y)) first = {x, y};
    mask(first.x, first.y) = 0;
    const PixelRuns runs = encode_runs(mask);
    Json json = Json::parse(run.text);
    json["picture"]["mask"] = {{"window", {runs.window.x0, runs.window.y0, runs.window.x1, runs.window.y1}},
                               {"runs", runs.runs}};
    const Checked checked = run.check(json.dump());
    EXPECT_EQ(checked.differences.size(), 1u) << said(checked);
    EXPECT_TRUE(has(checked, "hole", "pixel " + std::to_string(first.x) + ',' + std::to_string(first.y)))
        << said(checked);
}

TEST(Check, AlteredTargetMasksAreCaught) {
    const Finished run = box_run();
    for (const char* key : {"/targets/1/mask/runs", "/targets/1/alone/runs"}) {
        // One pixel less in the first run of ones.
        std::string runs = run.at(key).get<std::string>();
        const std::size_t space = runs.find(' '), end = runs.find(' ', space + 1);
        const int zeros = std::stoi(runs.substr(0, space)), ones = std::stoi(runs.substr(space + 1, end));
        ASSERT_GT(ones, 1);
        runs = std::to_string(zeros + 1) + ' ' + std::to_string(ones - 1) + runs.substr(end);
        const Checked checked = run.altered(key, runs);
        EXPECT_EQ(count(checked, "target pixels"), 1) << said(checked);
        EXPECT_EQ(checked.differences.size(), 1u) << said(checked);
        ASSERT_FALSE(checked.good());
        EXPECT_NE(checked.differences[0].where.find("of bolt"), std::string::npos) << said(checked);
    }
    // Runs that are none, and windows beyond picture and margin.
    for (const char* bad : {"1 2 3", "x", "-1 5", "5  5", "99999999999999999999 1", "5 5 ", "3 0 2 1"})
        EXPECT_EQ(count(run.altered("/targets/0/mask/runs", bad), "target pixels"), 1) << bad;
    EXPECT_EQ(count(run.altered("/targets/0/mask/window", {-60000, -60000, 60000, 60000}), "target pixels"), 1);
}

TEST(Check, AlteredFiguresAreCaught) {
    const Finished run = box_run();
    const auto caught = [&](const std::string& pointer, const Json& value) {
        const Checked checked = run.altered(pointer, value);
        EXPECT_EQ(checked.differences.size(), 1u) << said(checked);
        EXPECT_TRUE(has(checked, "figure", pointer)) << pointer << '\n' << said(checked);
    };
    caught("/targets/0/pixels_alone", run.at("/targets/0/pixels_alone").get<int>() + 1);
    caught("/targets/0/visible_after", 0.5);
    caught("/targets/1/visible_before", "much");
    caught("/targets/1/visible_among_targets", nullptr);
    caught("/targets/0/ring/mean", 0.125);
    caught("/targets/0/depth_asked_px", 7);
    caught("/picture/hole_pixels", run.at("/picture/hole_pixels").get<int>() - 1);
    caught("/picture/outline_iou", 0.9999);
    caught("/picture/see_through_px", 1);
    caught("/picture/wall_visible", 1.5);
    caught("/cut_parts", Json::array());
    caught("/rays/targets", 1);
    caught("/model/parts", 5);
    caught("/nothing_to_cut", true);

    Json json = Json::parse(run.text);
    json["targets"][0].erase("visible_after");
    json["picture"]["beauty"] = 10;
    const Checked checked = run.check(json.dump());
    EXPECT_TRUE(has(checked, "figure", "/targets/0/visible_after")) << said(checked);
    EXPECT_TRUE(has(checked, "figure", "/picture/beauty")) << said(checked);
}

TEST(Check, AlteredTargetListIsCaught) {
    const Finished run = box_run();
    const auto caught = [](const Checked& checked, const std::string& where) {
        EXPECT_TRUE(has(checked, "targets", where)) << said(checked);
    };
    caught(run.altered("/targets/0/id", 2), "/targets/0");
    caught(run.altered("/targets/0/path", "axle"), "/targets/0");
    caught(run.altered("/options/targets/0/id", 2), "/options");
    caught(run.altered("/targets/1/id", 4000000000), "/targets/1");
    Json json = Json::parse(run.text);
    json["targets"].erase(1);
    caught(run.check(json.dump()), "/targets");
    // The same in both lists: no longer the same run.
    json["options"]["targets"].erase(1);
    const Checked checked = run.check(json.dump());
    EXPECT_GT(count(checked, "hole"), 0) << said(checked);
    EXPECT_GT(count(checked, "picture inside"), 0);
}

TEST(Check, AlteredCameraIsCaught) {
    const Finished run = box_run();
    Json position = run.at("/camera/position");
    position[0] = position[0].get<double>() + 0.2;
    const Checked moved = run.altered("/camera/position", position);
    EXPECT_GT(count(moved, "target pixels"), 0);
    EXPECT_GT(count(moved, "picture outside"), 0);
    EXPECT_GT(count(run.altered("/camera/tan_half_fov_y", 0.31), "target pixels"), 0);
    EXPECT_GT(count(run.altered("/size", {161, 120}), "picture inside"), 0);
}

TEST(Check, AlteredOptionsAreCaught) {
    const Finished run = box_run();
    EXPECT_GT(count(run.altered("/options/depth", {9, "px"}), "hole"), 0);
    EXPECT_GT(count(run.altered("/options/style", "hole"), "picture inside"), 0);
    EXPECT_GT(count(run.altered("/options/shadows", false), "picture outside"), 0);
    EXPECT_GT(count(run.altered("/options/emphasis", "none"), "picture inside"), 0);
}

TEST(Check, AlteredPictureIsCaught) {
    Finished run = box_run();
    Vec2i in{-1, -1};
    for (int y = 0; y < 120; ++y)
        for (int x = 0; x < 160; ++x)
            if (run.plan.hole.mask.at_or(x, y, 0)) in = {x, y};
    const auto alter = [&](Vec2i p, const char* what) {
        const Rgba16 before = run.picture(p.x, p.y);
        run.picture(p.x, p.y).g ^= 1;
        const Checked checked = run.check();
        EXPECT_EQ(checked.differences.size(), 1u) << said(checked);
        EXPECT_TRUE(has(checked, what, "pixel " + std::to_string(p.x) + ',' + std::to_string(p.y))) << said(checked);
        run.picture(p.x, p.y) = before;
    };
    ASSERT_GE(in.x, 0);
    alter(in, "picture inside");
    alter({0, 0}, "picture outside");
    alter({159, 119}, "picture outside");
    EXPECT_TRUE(run.check().good());

    // Many: listed in part, counted in full.
    for (int x = 0; x < 100; ++x) run.picture(x, 0).r ^= 1;
    const Checked checked = run.check();
    EXPECT_EQ(checked.differences.size(), 20u);
    EXPECT_EQ(count(checked, "picture outside"), 100);
}

TEST(Check, PlainPicturesAreChecked) {
    Finished run = box_run();
    const View& view = run.plan.view;
    Report report;
    report.command = "render", report.version = "test", report.run.isa = "avx2";
    report.view = view;
    report.options.render.samples = 4;
    report.nothing_to_cut = true;
    report.model.parts = std::int64_t(run.scene.parts.size());
    report.model.triangles = std::int64_t(triangle_count(run.scene));
    const Frame frame =
        render(build_bvh(*run.meshes, all_parts(run.scene)), nullptr, view, report.options.render, nullptr, nullptr);
    report.frame_rays = frame.rays;
    run.picture = as_in_file(frame);
    const Checked good = run.check(to_json(report));
    EXPECT_TRUE(good.good()) << said(good);
    EXPECT_EQ(good.outside_pixels, 160 * 120);
    run.picture(5, 5).b ^= 1;
    EXPECT_EQ(count(run.check(to_json(report)), "picture outside"), 1);
}

TEST(Check, GearboxPassesAndItsAlteredReportDoesNot) {
    Scene scene = load_scene(PORTHOLE_SOURCE_DIR "/examples/gearbox/gearbox.glb");
    RevealParams params;
    params.targets = select_parts(scene, std::vector<std::string>{"planet_gear_*"});
    params.camera.name = "iso";
    params.width = 240, params.height = 180;
    const Finished run(std::move(scene), params);
    const Checked checked = run.check();
    EXPECT_TRUE(checked.good()) << said(checked);
    EXPECT_GT(checked.target_pixels, 1000);
    EXPECT_GT(count(run.altered("/targets/2/pixels_alone", 1), "figure"), 0);
}

TEST(Check, PictureAndMarginMustFitIntoMemory) {
    const Finished run = box_run();
    Json json = Json::parse(run.text);
    json["options"]["depth"] = {4096, "px"};
    const std::string text = json.dump();
    CheckParams params;
    params.max_bytes = std::uint64_t(1) << 30;
    try {
        (void)check_report(*run.meshes, read_report(text, "test"), text, params);
        FAIL();
    } catch (const Error& e) {
        EXPECT_EQ(e.code, "E0901");
    }
}

// ---------------------------------------------------------------- reading

std::string code_of(const std::string& text) {
    try {
        (void)read_report(text, "r.json");
        return "";
    } catch (const Error& e) {
        EXPECT_EQ(e.where.find("r.json"), 0u) << e.where;
        return e.code;
    }
}

TEST(ReadReport, GivesBackEveryOptionBitForBit) {
    Finished run = box_run();
    Report report = read_report(run.text, "test");
    const View &a = *report.options.view, &b = run.plan.view;
    EXPECT_EQ(a.world_from_camera.x, b.world_from_camera.x);
    EXPECT_EQ(a.world_from_camera.y, b.world_from_camera.y);
    EXPECT_EQ(a.world_from_camera.z, b.world_from_camera.z);
    EXPECT_EQ(a.world_from_camera.p, b.world_from_camera.p);
    EXPECT_EQ(a.half_height, b.half_height);
    EXPECT_EQ(a.width, b.width);
    EXPECT_EQ(report.options.targets, (std::vector{PartId{0}, PartId{1}}));
    EXPECT_EQ(report.option_paths.at(PartId{1}), "bolt");
    EXPECT_EQ(report.options.plan.depth->value, 6);

    // Through JSON and back nothing changes, whatever the values.
    report.options.plan.depth = Length{Length::Unit::millimetre, 0.1};
    report.options.plan.tight = Tight::open;
    report.options.render.background = {0.1f, 1.0f / 3.0f, 1e-20f};
    report.options.render.rim_px = 0.7f;
    report.options.render.emphasis = Emphasis::none;
    report.options.keep = {PartId{3}};
    report.option_paths[PartId{3}] = "plate";
    const std::string text = to_json(report);
    const Report again = read_report(text, "test");
    EXPECT_EQ(again.options.render.background, report.options.render.background);
    EXPECT_EQ(again.options.render.rim_px, 0.7f);
    EXPECT_EQ(again.options.plan.depth->value, 0.1);
    EXPECT_EQ(again.options.keep, report.options.keep);
    EXPECT_EQ(Json::parse(to_json(again))["options"], Json::parse(text)["options"]);
}

TEST(ReadReport, RefusesWhatIsNoReport) {
    for (const char* text : {"", "{", "[]", "null", "7", "\"report\"", "{}", "{\"version\":1}", "\xff\xfe",
                             "{\"a\":1}x", "{\"version\":\"1\",\"command\":\"reveal\"}", "{\"version\":1e999}"})
        EXPECT_EQ(code_of(text), "E0220") << text;
    EXPECT_EQ(code_of(std::string(100000, '[')), "E0220");
    std::string deep;
    for (int i = 0; i < 100000; ++i) deep += "{\"a\":";
    EXPECT_EQ(code_of(deep), "E0220");
    EXPECT_EQ(code_of(std::string((std::size_t(64) << 20) + 1, ' ')), "E0902");
}

TEST(ReadReport, RefusesValuesThatCannotBeMeant) {
    const Finished run = box_run();
    const auto altered = [&](const std::string& pointer, const Json& value) {
        Json json = Json::parse(run.text);
        json[Json::json_pointer(pointer)] = value;
        return code_of(json.dump());
    };
    EXPECT_EQ(altered("/command", "parts"), "E0220");
    EXPECT_EQ(altered("/size", {0, 5}), "E0220");
    EXPECT_EQ(altered("/size", {1e9, 5}), "E0220");
    EXPECT_EQ(altered("/size", {5.5, 5}), "E0220");
    EXPECT_EQ(altered("/camera/right", {0, 0, 0}), "E0220");
    EXPECT_EQ(altered("/camera/right", {1, 0}), "E0220");
    EXPECT_EQ(altered("/camera/tan_half_fov_y", -1), "E0220");
    EXPECT_EQ(altered("/camera/position", {1e300, 0, 0}), "E0220");
    EXPECT_EQ(altered("/options/style", "baroque"), "E0220");
    EXPECT_EQ(altered("/options/depth", {5, "furlong"}), "E0220");
    EXPECT_EQ(altered("/options/samples", "many"), "E0220");
    EXPECT_EQ(altered("/options/samples", 1e30), "E0220");
    EXPECT_EQ(altered("/options/glow", true), "E0220");
    EXPECT_EQ(altered("/options/isa", "sse"), "E0220");
    EXPECT_EQ(altered("/options/targets/0/id", -1), "E0220");
    EXPECT_EQ(altered("/picture/bits", 12), "E0220");
    EXPECT_EQ(altered("/picture/mask/window", {0, 0, 1e9, 1}), "E0220");
    EXPECT_EQ(altered("/targets", 5), "E0220");
    EXPECT_EQ(altered("/model/up", "w"), "E0220");
}

TEST(ReadReport, NeverCrashesOnDamagedText) {
    Builder b(8);
    const PartId ball = b.add_sphere("ball", {}, 0.4);
    b.add_box("box", {}, {1, 1, 1});
    RevealParams params;
    params.targets = {ball};
    params.view = look({2, 2, 4}, {}, 24, 18, 0.3f);
    const Finished run(std::move(b.scene), params);
    std::mt19937 random(7);
    int read = 0, differ = 0;
    for (int i = 0; i < 3000; ++i) {
        std::string text = run.text;
        if (i % 3 == 0) text.resize(random() % text.size());
        for (int n = int(random() % 3); n >= 0 && !text.empty(); --n) {
            const std::size_t at = random() % text.size();
            if (random() % 2)
                text[at] = "0123456789-+.eE\"[]{},: \\ntfx"[random() % 27];
            else
                text.erase(at, 1 + random() % 4);
        }
        try {
            const Report report = read_report(text, "test");
            ++read;
            // What asks for much more work is not repeated here.
            if (report.view.width > 64 || report.view.height > 64 || report.options.render.samples > 16) continue;
            CheckParams limits;
            limits.max_bytes = 64u << 20;
            differ += !check_report(*run.meshes, report, text, limits).good();
        } catch (const Error&) {
        }
    }
    EXPECT_GT(read, 100);
    EXPECT_GT(differ, 50);
}

TEST(ReadReport, ExtremeValuesAreRefusedOrDrawn) {
    Builder b(8);
    const PartId ball = b.add_sphere("ball", {}, 0.4);
    b.add_box("box", {}, {1, 1, 1});
    RevealParams params;
    params.targets = {ball};
    params.view = look({2, 2, 4}, {}, 24, 18, 0.3f);
    const Finished run(std::move(b.scene), params);
    const Json whole = Json::parse(run.text);
    CheckParams limits;
    limits.max_bytes = 64u << 20;
    int numbers = 0, refused = 0;
    const auto tried = [&](const std::string& pointer, const Json& value) {
        Json json = whole;
        json[Json::json_pointer(pointer)] = value;
        const std::string text = json.dump();
        try {
            (void)check_report(*run.meshes, read_report(text, "test"), text, limits);
        } catch (const Error&) {
            ++refused;
        }
    };
    for (const char* part : {"/camera", "/options"}) {
        const Json flat = whole.at(Json::json_pointer(part)).flatten();
        for (const auto& [below, value] : flat.items()) {
            if (!value.is_number() && !value.is_null()) continue;
            ++numbers;
            const std::string pointer = part + below;
            for (const double extreme : {0.0, -1.0, 0.5, 1e-30, -1e30, 1e30, 1e9, 3.4e38, -3.4e38}) {
                tried(pointer, extreme);
                if (value.is_null()) tried(pointer, {extreme, "px"});
            }
            for (const std::int64_t extreme : {std::int64_t(-2147483648), std::int64_t(2147483647)})
                tried(pointer, extreme);
        }
    }
    EXPECT_GT(numbers, 20);
    EXPECT_GT(refused, numbers);
}

TEST(PixelRuns, GoThereAndBack) {
    std::mt19937 random(3);
    for (int i = 0; i < 200; ++i) {
        Mask mask(Rect{-5, 3, -5 + 1 + int(random() % 20), 3 + 1 + int(random() % 20)}, 0);
        const auto share = random() % 5;
        for (std::uint8_t& v : mask.pixels()) v = random() % 4 < share;
        const PixelRuns runs = encode_runs(mask);
        const std::optional<Mask> back = decode_runs(runs);
        ASSERT_TRUE(back) << runs.runs;
        for (int y = mask.window().y0; y < mask.window().y1; ++y)
            for (int x = mask.window().x0; x < mask.window().x1; ++x)
                ASSERT_EQ(back->at_or(x, y, 0), mask(x, y)) << x << ',' << y << ' ' << runs.runs;
    }
    EXPECT_EQ(encode_runs(Mask(4, 4, 0)).runs, "");
    EXPECT_EQ(encode_runs(Mask(Rect{5, 2, 3, 9}, 0)).runs, ""); // as intersections leave it
    EXPECT_EQ(encode_runs(Mask(2, 2, 1)).runs, "0 4");
}

TEST(DenseOutline, FillsWhatTheModelEncloses) {
    const auto mask = [](const std::vector<std::string>& rows) {
        Mask m(std::int32_t(rows[0].size()), std::int32_t(rows.size()), 0);
        for (int y = 0; y < m.height(); ++y)
            for (int x = 0; x < m.width(); ++x) m(x, y) = rows[std::size_t(y)][std::size_t(x)] == '#';
        return m;
    };
    const Mask ring = mask({".....", ".###.", ".#.#.", ".###.", "....."});
    const Mask full = mask({".....", ".###.", ".###.", ".###.", "....."});
    const Mask open = mask({".....", ".###.", ".#...", ".###.", "....."});
    EXPECT_EQ(dense_outline_iou(ring, full), 1);
    EXPECT_EQ(dense_outline_iou(open, full), 7.0 / 9);
    EXPECT_EQ(dense_outline_iou(Mask(3, 3, 0), Mask(3, 3, 0)), 1);
    // Diagonal gaps do not let the background in.
    EXPECT_EQ(dense_outline_iou(mask({"....", ".##.", "#..#", ".##."}), mask({"....", ".##.", "####", ".##."})), 1.0);
}

} // namespace
} // namespace porthole
