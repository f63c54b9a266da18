#include "porthole/io/scene_json.h"

#include <filesystem>

#include <gtest/gtest.h>

#include "porthole/io/load.h"
#include "support/temporary_folder.h"

namespace porthole {
namespace {

Scene read(std::string text, const LoadParams& params = {}) {
    return read_scene_json(FileBytes(std::move(text)), "s.json", params, {});
}
/// A file with these parts.
std::string with_parts(const std::string& parts, const std::string& more = "") {
    return R"({"porthole_scene": 1, "parts": [)" + parts + "]" + more + "}";
}
std::string failure(const std::string& text, const LoadParams& params = {}) {
    try {
        (void)read(text, params);
    } catch (const Error& error) {
        EXPECT_FALSE(std::string(error.what()).empty());
        return error.code + " " + error.where;
    }
    return "none";
}
std::string reason(const std::string& text) {
    try {
        (void)read(text);
    } catch (const Error& error) {
        return error.what();
    }
    return "none";
}
/// What goes wrong with one part.
std::string part_failure(const std::string& part) { return failure(with_parts(part)); }

Bounds3d box_of(const std::string& part) {
    const Scene scene = read(with_parts(part));
    return part_bounds(scene, PartId{0});
}
void expect_box(const std::string& part, Vec3d lower, Vec3d upper) {
    const Bounds3d box = box_of(part);
    for (int axis = 0; axis < 3; ++axis) {
        EXPECT_NEAR(box.lower[axis], lower[axis], 1e-12) << part << ' ' << axis;
        EXPECT_NEAR(box.upper[axis], upper[axis], 1e-12) << part << ' ' << axis;
    }
}

TEST(SceneJson, ShapesHaveTheirSizes) {
    expect_box(R"({"sphere": {"radius": 2}})", {-2, -2, -2}, {2, 2, 2});
    expect_box(R"({"box": {"size": [1, 2, 3]}})", {-0.5, -1, -1.5}, {0.5, 1, 1.5});
    expect_box(R"({"box": {"size": 4}})", {-2, -2, -2}, {2, 2, 2});
    expect_box(R"({"box": {"from": [1, 2, 3], "to": [4, 6, 8]}})", {1, 2, 3}, {4, 6, 8});
    expect_box(R"({"cylinder": {"radius": 1, "height": 3}})", {-1, -1.5, -1}, {1, 1.5, 1});
    expect_box(R"({"cylinder": {"radius": 0.5, "from": [0, 0, -1], "to": [0, 0, 5]}})", {-0.5, -0.5, -1},
               {0.5, 0.5, 5});
    expect_box(R"({"cone": {"radius": 1, "height": 2}})", {-1, -1, -1}, {1, 1, 1});
    expect_box(R"({"cone": {"radius": 1, "top_radius": 3, "from": [2, 0, 0], "to": [7, 0, 0]}})", {2, -3, -3},
               {7, 3, 3});
    expect_box(R"({"torus": {"radius": 2, "tube": 0.5}})", {-2.5, -0.5, -2.5}, {2.5, 0.5, 2.5});
}

TEST(SceneJson, ConesPointTheWayTheyShould) {
    std::vector<PrimitiveCrossing> list;
    const auto width = [&](const std::string& part, double y) {
        const Scene scene = read(with_parts(part));
        const PrimitiveTree tree = placed(scene.meshes[0].primitives, scene.parts[0].world_from_mesh);
        find_crossings(tree, {-9, y, 0}, {1, 0, 0}, list);
        return list.size() == 2 ? list[1].t - list[0].t : 0;
    };
    EXPECT_NEAR(width(R"({"cone": {"radius": 1, "height": 2}})", -0.5), 1.5, 1e-9);
    EXPECT_NEAR(width(R"({"cone": {"radius": 0, "top_radius": 1, "height": 2}})", 0.5), 1.5, 1e-9);
    EXPECT_NEAR(width(R"({"cone": {"radius": 2, "top_radius": 1, "from": [0, 5, 0], "to": [0, 1, 0]}})", 4), 3.5, 1e-9);
}

TEST(SceneJson, PlacementsScaleThenTurnThenMove) {
    expect_box(R"({"box": {"size": 2}, "scale": [1, 2, 3], "rotate": [0, 0, 90], "translate": [10, 0, 0]})",
               {8, -1, -3}, {12, 1, 3});
    expect_box(R"({"box": {"from": [0, 0, 0], "to": [1, 2, 3]}, "rotate": [90, 90, 0]})", {0, -3, -1}, {2, 0, 0});
    expect_box(R"({"box": {"from": [0, 0, 0], "to": [1, 2, 3]}, "scale": -1})", {-1, -2, -3}, {0, 0, 0});
    expect_box(R"({"name": "g", "translate": [0, 5, 0], "scale": 2, "parts": [{"translate": [1, 0, 0], "parts": [
                  {"sphere": {"radius": 1}, "translate": [0, 0, 1]}]}]})",
               {0, 3, 0}, {4, 7, 4});
    expect_box(
        R"({"union": [{"sphere": {"radius": 1}, "translate": [3, 0, 0]}, {"sphere": {"radius": 1}}], "scale": 2})",
        {-2, -2, -2}, {8, 2, 2});
}

TEST(SceneJson, PathsFollowTheGroups) {
    const std::string ball = R"("sphere": {"radius": 1})";
    const Scene scene =
        read(with_parts(R"({"name": "a", "parts": [{"name": "x", )" + ball + R"(}, {"name": "x", )" + ball +
                        R"(}]}, {"name": "b", "parts": [{)" + ball + R"(}]},
                                        {"name": "b", "parts": [{"name": "y", )" +
                        ball + R"(}]}, {"parts": [{"name": "z", )" + ball + R"(}]}, {"name": "top", )" + ball + "}"));
    std::vector<std::string> paths;
    for (const Part& part : scene.parts) paths.push_back(part.path);
    EXPECT_EQ(paths, (std::vector<std::string>{"a/x[0]", "a/x[1]", "b[0]/", "b[1]/y", "[0]/z", "top"}));
    EXPECT_EQ(scene.parts[1].name, "x");
    EXPECT_EQ(scene.format, "scene");
}

TEST(SceneJson, MaterialsAreInheritedAndWellFilled) {
    const Scene scene = read(R"({"porthole_scene": 1, "materials": {
        "red": {"color": [1, 0, 0], "metallic": 0.5, "roughness": 0.25},
        "glass": {"color": "#80ff00", "transmission": 0.9, "ior": 1.4},
        "veil": {"alpha": 0.5}, "lamp": {"emission": [5, 4, 3]}},
      "parts": [
        {"material": "red", "parts": [{"name": "own", "sphere": {"radius": 1}, "material": "glass"},
                                      {"name": "inherited", "sphere": {"radius": 1}}]},
        {"name": "plain", "sphere": {"radius": 1}},
        {"name": "mixed", "material": "veil", "difference": [{"box": {"size": 2}}, {"sphere": {"radius": 1}, "material": "lamp"},
                                                  {"torus": {"radius": 1, "tube": 0.1}, "material": "lamp"}]}]})");
    const auto material = [&](std::uint32_t part, std::uint32_t surface) {
        return scene.materials[scene.mesh_of(PartId{part}).material_of(surface)];
    };
    EXPECT_EQ(material(0, 0).name, "glass");
    EXPECT_FLOAT_EQ(material(0, 0).transmission, 0.9f);
    EXPECT_GT(material(0, 0).thickness, 0) << "bodies bend light";
    EXPECT_NEAR(material(0, 0).base_color.x, 0.2158605f, 1e-6) << "web colours are sRGB";
    EXPECT_EQ(material(1, 0).name, "red");
    EXPECT_FLOAT_EQ(material(1, 0).metallic, 0.5f);
    EXPECT_EQ(material(2, 0).name, "");
    EXPECT_EQ(material(2, 0).metallic, 0);
    for (std::uint32_t s = 0; s < 6; ++s) EXPECT_EQ(material(3, s).alpha_mode, AlphaMode::blend) << s;
    EXPECT_EQ(material(3, 6).emissive, (Vec3f{5, 4, 3}));
    EXPECT_EQ(material(3, 7).emissive, (Vec3f{5, 4, 3}));
    EXPECT_EQ(scene.mesh_of(PartId{3}).submeshes.size(), 2u);
}

TEST(SceneJson, CamerasAndLightsAreRead) {
    const Scene scene = read(with_parts(R"({"sphere": {"radius": 1}})", R"(,
      "cameras": [{"name": "c", "position": [0, 0, 5], "look_at": [0, 0, 0], "view_angle_deg": 45},
                  {"position": [0, 5, 0], "look_at": [0, 0, 0], "up": [0, 0, -1], "half_height": 2}],
      "lights": [{"type": "point", "position": [1, 2, 3], "intensity": 100, "color": [1, 0.5, 0.5]},
                 {"type": "directional", "direction": [0, -2, 0]}])"));
    ASSERT_EQ(scene.cameras.size(), 2u);
    EXPECT_EQ(scene.cameras[0].name, "c");
    EXPECT_NEAR(scene.cameras[0].fov_y, kPi / 4, 1e-6);
    EXPECT_EQ(scene.cameras[0].world_from_camera.p, (Vec3d{0, 0, 5}));
    EXPECT_TRUE(scene.cameras[1].orthographic);
    EXPECT_EQ(scene.cameras[1].world_from_camera.y, (Vec3d{0, 0, -1}));
    ASSERT_EQ(scene.lights.size(), 2u);
    EXPECT_EQ(scene.lights[0].intensity, 100);
    EXPECT_EQ(scene.lights[1].direction, (Vec3f{0, -1, 0}));
}

TEST(SceneJson, ErrorsNameThePlace) {
    EXPECT_EQ(failure("{"), "E1001 s.json:byte 1");
    EXPECT_EQ(failure("[]"), "E1001 s.json");
    EXPECT_EQ(failure("{}"), "E1001 s.json");
    EXPECT_EQ(failure(R"({"porthole_scene": 2, "parts": []})"), "E1001 s.json:/porthole_scene");
    EXPECT_EQ(failure(R"({"porthole_scene": 1})"), "E1002 s.json");
    EXPECT_EQ(failure(with_parts("")), "E1002 s.json");
    EXPECT_EQ(failure(with_parts("7")), "E1002 s.json:/parts/0");
    EXPECT_EQ(part_failure(R"({"name": "no shape"})"), "E1002 s.json:/parts/0");
    EXPECT_EQ(part_failure(R"({"name": 7, "sphere": {"radius": 1}})"), "E1002 s.json:/parts/0/name");
    EXPECT_EQ(part_failure(R"({"sphere": {"radius": 1}, "colour": 7})"), "E1002 s.json:/parts/0/colour");
    EXPECT_EQ(part_failure(R"({"sphere": {"radius": 1}, "box": {"size": 1}})"), "E1002 s.json:/parts/0/box");
    EXPECT_EQ(part_failure(R"({"sphere": {"radius": 1}, "parts": []})"), "E1002 s.json:/parts/0/sphere");
    EXPECT_EQ(part_failure(R"({"parts": []})"), "E1002 s.json:/parts/0/parts");
    EXPECT_EQ(part_failure(R"({"sphere": 5})"), "E1002 s.json:/parts/0/sphere");
    EXPECT_EQ(part_failure(R"({"sphere": {}})"), "E1002 s.json:/parts/0/sphere");
    EXPECT_EQ(part_failure(R"({"sphere": {"radius": "1"}})"), "E1002 s.json:/parts/0/sphere/radius");
    EXPECT_EQ(part_failure(R"({"sphere": {"radius": 1}, "material": "gold"})"), "E1002 s.json:/parts/0/material");
    EXPECT_EQ(part_failure(R"({"sphere": {"radius": 1}, "translate": [1, 2]})"), "E1002 s.json:/parts/0/translate");
    EXPECT_EQ(part_failure(R"({"sphere": {"radius": 1}, "translate": [1, 2, null]})"),
              "E1002 s.json:/parts/0/translate/2");
    EXPECT_EQ(part_failure(R"({"union": []})"), "E1002 s.json:/parts/0/union");
    EXPECT_EQ(part_failure(R"({"union": {"sphere": {"radius": 1}}})"), "E1002 s.json:/parts/0/union");
    EXPECT_EQ(part_failure(R"({"union": [{"name": "x", "sphere": {"radius": 1}}]})"),
              "E1002 s.json:/parts/0/union/0/name");
    EXPECT_EQ(part_failure(R"({"box": {"size": 1, "to": [1, 1, 1]}})"), "E1002 s.json:/parts/0/box");
    EXPECT_EQ(part_failure(R"({"cylinder": {"radius": 1, "height": 1, "from": [0, 0, 0], "to": [1, 1, 1]}})"),
              "E1002 s.json:/parts/0/cylinder/height");
    EXPECT_EQ(failure(R"({"porthole_scene": 1, "materials": {"a": {"color": "red"}}, "parts": []})"),
              "E1002 s.json:/materials/a/color");
    EXPECT_EQ(failure(R"({"porthole_scene": 1, "materials": {"a": {"color": [1, 0, 2]}}, "parts": []})"),
              "E1003 s.json:/materials/a/color/2");
    EXPECT_NE(reason(with_parts(R"({"sphere": {"radius": 1, "r": 1}})")).find("the keys are: radius"),
              std::string::npos);
    const std::string lights = R"(, "lights": [{"type": "spot"}])",
                      cameras = R"(, "cameras": [{"position": [0, 1, 0], "look_at": [0, 0, 0]}])";
    EXPECT_EQ(failure(with_parts(R"({"sphere": {"radius": 1}})", lights)), "E1002 s.json:/lights/0/type");
    EXPECT_EQ(failure(with_parts(R"({"sphere": {"radius": 1}})", cameras)), "E1003 s.json:/cameras/0");
}

TEST(SceneJson, NumbersStayInRange) {
    EXPECT_EQ(part_failure(R"({"sphere": {"radius": 0}})"), "E1003 s.json:/parts/0/sphere/radius");
    EXPECT_EQ(part_failure(R"({"sphere": {"radius": -1}})"), "E1003 s.json:/parts/0/sphere/radius");
    EXPECT_EQ(part_failure(R"({"sphere": {"radius": 1e300}})"), "E1003 s.json:/parts/0/sphere/radius");
    EXPECT_EQ(part_failure(R"({"sphere": {"radius": 1e999}})").substr(0, 5), "E1001");
    EXPECT_EQ(part_failure(R"({"sphere": {"radius": NaN}})").substr(0, 5), "E1001");
    EXPECT_EQ(part_failure(R"({"box": {"size": [1, 0, 1]}})"), "E1003 s.json:/parts/0/box/size/1");
    EXPECT_EQ(part_failure(R"({"box": {"from": [0, 0, 0], "to": [1, -1, 1]}})"), "E1003 s.json:/parts/0/box/to/1");
    EXPECT_EQ(part_failure(R"({"cylinder": {"radius": 1, "from": [1, 1, 1], "to": [1, 1, 1]}})"),
              "E1003 s.json:/parts/0/cylinder/to");
    EXPECT_EQ(part_failure(R"({"cone": {"radius": 0, "height": 1}})"), "E1003 s.json:/parts/0/cone/radius");
    EXPECT_EQ(part_failure(R"({"torus": {"radius": 1, "tube": 1}})"), "E1003 s.json:/parts/0/torus/tube");
    EXPECT_EQ(part_failure(R"({"sphere": {"radius": 1}, "scale": 0})"), "E1003 s.json:/parts/0/scale");
    EXPECT_EQ(part_failure(R"({"sphere": {"radius": 1}, "scale": [1, 1e-9, 1]})"), "E1003 s.json:/parts/0/scale");
    EXPECT_EQ(part_failure(R"({"sphere": {"radius": 1}, "translate": [1e7, 0, 0]})"),
              "E1003 s.json:/parts/0/translate/0");
    // Each placement is fine, all together are not.
    EXPECT_EQ(part_failure(R"({"scale": 1e-5, "parts": [{"scale": 1e-5, "parts": [{"sphere": {"radius": 1}}]}]})"),
              "E1003 s.json:/parts/0/parts/0");
    EXPECT_EQ(
        part_failure(R"({"union": [{"union": [{"sphere": {"radius": 1}, "scale": 1e5}], "scale": 1e5}]})").substr(0, 5),
        "E1003");
    EXPECT_EQ(part_failure(R"({"scale": [1, 1e-4, 1], "parts": [{"rotate": [0, 0, 45], "parts": [
                              {"sphere": {"radius": 1}, "scale": [1e4, 1, 1]}]}]})"),
              "E1003 s.json:/parts/0/parts/0");
    EXPECT_EQ(
        part_failure(
            R"({"intersection": [{"sphere": {"radius": 1}}, {"sphere": {"radius": 1}, "translate": [0, 3, 0]}]})"),
        "E1005 s.json:/parts/0/intersection");
}

TEST(SceneJson, DepthAndCountAreLimited) {
    const auto nested = [](const std::string& open, const std::string& close, int n) {
        std::string text;
        for (int i = 0; i < n; ++i) text += open;
        text += R"({"sphere": {"radius": 1}})";
        for (int i = 0; i < n; ++i) text += close;
        return text;
    };
    EXPECT_EQ(part_failure(nested(R"({"parts": [)", "]}", 64)), "none");
    EXPECT_EQ(part_failure(nested(R"({"parts": [)", "]}", 65)).substr(0, 5), "E1004");
    EXPECT_EQ(part_failure(nested(R"({"union": [{"box": {"size": 1}}, )", "]}", 63)), "none");
    EXPECT_EQ(part_failure(nested(R"({"union": [{"box": {"size": 1}}, )", "]}", 64)).substr(0, 5), "E1004");
    EXPECT_EQ(part_failure(nested(R"({"union": [)", "]}", 5000)).substr(0, 5), "E1001")
        << "deeper than any JSON that is read";
    EXPECT_EQ(part_failure(std::string(1'000'000, '[')).substr(0, 5), "E1001");

    std::string many = R"({"union": [{"sphere": {"radius": 1}})";
    for (std::uint32_t i = 0; i < kMaxTreeLeaves; ++i) many += R"(,{"sphere": {"radius": 1}})";
    EXPECT_EQ(part_failure(many + "]}"), "E1004 s.json:/parts/0/union");

    LoadParams little;
    little.max_bytes = 200'000;
    std::string parts = R"({"sphere": {"radius": 1}})";
    for (int i = 0; i < 500; ++i) parts += R"(,{"sphere": {"radius": 1}})";
    EXPECT_EQ(failure(with_parts(parts), little).substr(0, 5), "E0902");
}

TEST(SceneJson, TruncatedAndMutatedFilesAreRefusedCleanly) {
    const std::filesystem::path house = std::filesystem::path(PORTHOLE_SOURCE_DIR) / "examples/primitives/house.json";
    const std::string good(FileBytes(house).text());
    EXPECT_EQ(failure(good), "none");
    for (std::size_t n = 0; n < good.size() - 2; n += 37) EXPECT_NE(failure(good.substr(0, n)), "none") << n;
    // Every number replaced by hostile ones: refused or read, never worse.
    int refused = 0;
    for (std::size_t at = 0; at < good.size(); ++at) {
        if (!std::isdigit(static_cast<unsigned char>(good[at])) ||
            std::isdigit(static_cast<unsigned char>(good[at - 1])))
            continue;
        for (const char* value : {"-1e308", "1e-320", "null"})
            if (at % 5 == 0) refused += failure(good.substr(0, at) + value + good.substr(at + 1)) != "none";
    }
    EXPECT_GT(refused, 100);
}

TEST(SceneJson, LoadTellsScenesFromOtherJson) {
    const test::TemporaryFolder folder;
    const std::string scene = with_parts(R"({"name": "ball", "sphere": {"radius": 1}})");
    const auto load = [&](const char* name, const std::string& text) {
        try {
            const Scene s = load_scene(folder.write(name, text).string());
            return s.format + (s.warnings.empty() ? "" : " " + s.warnings[0].code);
        } catch (const Error& error) {
            return error.code;
        }
    };
    EXPECT_EQ(load("a.json", scene), "scene");
    EXPECT_EQ(load("noending", scene), "scene");
    EXPECT_EQ(load("a.gltf", scene), "scene W0201");
    EXPECT_EQ(load("b.json", R"({"parts": []})"), "E1001") << "the name says which reader explains";
    EXPECT_EQ(load("c.json", R"({"asset": {"version": "2.0"}})").substr(0, 4), "glTF");
    LoadParams params;
    params.format = "scene";
    params.up = 'z';
    params.metres_per_unit = 0.001;
    const Scene small =
        load_scene(folder.write("d.txt", with_parts(R"({"box": {"size": [1, 2, 3]}})")).string(), params);
    EXPECT_NEAR(part_bounds(small, PartId{0}).upper.y, 0.0015, 1e-12);
}

TEST(SceneJson, TheExamplesAreRead) {
    for (const char* name : {"house.json", "spheres.json"}) {
        const Scene scene =
            load_scene((std::filesystem::path(PORTHOLE_SOURCE_DIR) / "examples/primitives" / name).string());
        EXPECT_GE(scene.parts.size(), 6u);
        EXPECT_TRUE(scene.warnings.empty());
        EXPECT_EQ(triangle_count(scene), 0u);
    }
}

} // namespace
} // namespace porthole
