#include <gtest/gtest.h>

#include <cmath>

#include "porthole/io/gltf_node.h"
#include "porthole/io/gltf_test_file.h"

namespace porthole::gltf {
namespace {

TEST(GltfAnimation, StepLinearAndOutside) {
    const std::vector<float> times = {1, 2, 4}, values = {0, 0, 10, 1, 30, 5};
    const auto at = [&](Interpolation how, double t) { return sample_curve(times, values, 2, how, false, t); };
    using V = std::vector<double>;
    EXPECT_EQ(at(Interpolation::linear, 0), (V{0, 0}));
    EXPECT_EQ(at(Interpolation::linear, 1.5), (V{5, 0.5}));
    EXPECT_EQ(at(Interpolation::linear, 2), (V{10, 1}));
    EXPECT_EQ(at(Interpolation::linear, 3), (V{20, 3}));
    EXPECT_EQ(at(Interpolation::linear, 9), (V{30, 5}));
    EXPECT_EQ(at(Interpolation::step, 1.999), (V{0, 0}));
    EXPECT_EQ(at(Interpolation::step, 2), (V{10, 1}));
    EXPECT_EQ(at(Interpolation::step, 9), (V{30, 5}));
}

TEST(GltfAnimation, CubicSplineIsHermite) {
    // Keys at 0 and 2: values 1 and 3, out-tangent 0.5 and in-tangent -0.25 per second.
    const std::vector<float> times = {0, 2}, values = {9, 1, 0.5f, -0.25f, 3, 9};
    const auto at = [&](double t) { return sample_curve(times, values, 1, Interpolation::cubic, false, t)[0]; };
    EXPECT_DOUBLE_EQ(at(0), 1);
    EXPECT_DOUBLE_EQ(at(2), 3);
    EXPECT_DOUBLE_EQ(at(-1), 1);
    EXPECT_DOUBLE_EQ(at(1), 0.5 * 1 + 2 * 0.125 * 0.5 + 0.5 * 3 + 2 * -0.125 * -0.25);
    EXPECT_NEAR((at(1e-6) - at(0)) / 1e-6, 0.5, 1e-4);
    EXPECT_NEAR((at(2) - at(2 - 1e-6)) / 1e-6, -0.25, 1e-4);
}

TEST(GltfAnimation, RotationTakesTheShortWay) {
    const float s = std::sqrt(0.5f);
    const std::vector<float> times = {0, 1};
    for (const float sign : {1.0f, -1.0f}) { // q and -q are the same rotation
        const std::vector<float> values = {0, 0, 0, 1, 0, 0, sign * s, sign * s};
        const auto q = sample_curve(times, values, 4, Interpolation::linear, true, 0.5);
        EXPECT_NEAR(q[2], std::sin(3.14159265358979 / 8), 1e-7); // half of 90 degrees about z
        EXPECT_NEAR(q[3], std::cos(3.14159265358979 / 8), 1e-7);
    }
}

TEST(GltfNode, RotationMatrixTurnsXToY) {
    const Affine3d m = compose({1, 2, 3}, normalize(Quaternion{0, 0, 2, 2}), {2, 1, 1}); // 90 degrees about z
    const Vec3d p = m.point({1, 0, 0});
    EXPECT_NEAR(p.x, 1, 1e-12);
    EXPECT_NEAR(p.y, 4, 1e-12);
    EXPECT_NEAR(p.z, 3, 1e-12);
}

TEST(GltfNode, TreesOnly) {
    const auto code = [](const Json& nodes, const Json& roots) {
        TestFile file;
        file.root["nodes"] = nodes;
        file.root["scenes"] = {{{"nodes", roots}}};
        return error_of([&] { return file.read(); }).code;
    };
    const Json leaf = Json::object();
    EXPECT_EQ(code({{{"children", {1}}}, leaf}, {0}), "none");
    EXPECT_EQ(code({{{"children", {0}}}}, {0}), "E0309");
    EXPECT_EQ(code({{{"children", {1}}}, {{"children", {0}}}}, {0}), "E0309");
    EXPECT_EQ(code({{{"children", {1}}}, {{"children", {0}}}, leaf}, {2}), "E0309"); // unused, but broken
    EXPECT_EQ(code({{{"children", {2}}}, {{"children", {2}}}, leaf}, {0, 1}), "E0309");
    EXPECT_EQ(code({{{"children", {1, 1}}}, leaf}, {0}), "E0309");
    EXPECT_EQ(code({{{"children", {7}}}, leaf}, {0}), "E0306");
    EXPECT_EQ(code(Json::array({leaf}), {1}), "E0306");
}

TEST(GltfNode, DeepChainsDoNotRecurse) {
    TestFile file;
    file.add_mesh({{"POSITION", file.triangle()}});
    const int levels = 200000;
    Json nodes = Json::array();
    for (int i = 1; i < levels; ++i) nodes.push_back({{"children", {i}}, {"translation", {0, 0, 1}}});
    nodes.push_back({{"mesh", 0}});
    file.root["nodes"] = nodes;
    file.root["scenes"] = {{{"nodes", {0}}}};
    const Scene scene = file.read();
    ASSERT_EQ(scene.parts.size(), 1u);
    EXPECT_EQ(scene.parts[0].world_from_mesh.p.z, levels - 1);
    EXPECT_FALSE(scene.warnings.empty());
}

TEST(GltfNode, PathsOfALongNameAreBounded) {
    TestFile file;
    file.add_mesh({{"POSITION", file.triangle()}});
    Json children = Json::array(), nodes = {{{"name", std::string(1 << 16, 'n')}}};
    for (int i = 1; i <= 5000; ++i) {
        nodes.push_back({{"mesh", 0}});
        children.push_back(i);
    }
    nodes[0]["children"] = children;
    file.root["nodes"] = nodes; // 5000 paths of 64 kB
    EXPECT_EQ(error_of([&] { return file.read(); }).kind, ErrorKind::limit);
}

TEST(GltfNode, NamesAndPaths) {
    TestFile file;
    file.add_mesh({{"POSITION", file.triangle()}});
    file.root["meshes"][0]["name"] = "rod";
    file.root["nodes"] = {{{"name", "engine"}, {"children", {1, 2, 3, 4}}},
                          {{"mesh", 0}},
                          {{"mesh", 0}},
                          {{"mesh", 0}, {"name", "piston"}},
                          {{"children", {5}}},
                          {{"mesh", 0}, {"name", "a\u0000b"}}};
    file.root["nodes"][5]["name"] = std::string("a\0b", 3);
    const Scene scene = file.read();
    ASSERT_EQ(scene.parts.size(), 4u);
    EXPECT_EQ(scene.meshes.size(), 1u);
    EXPECT_EQ(scene.parts[0].name, "rod");
    EXPECT_EQ(scene.parts[0].path, "engine/rod[0]");
    EXPECT_EQ(scene.parts[1].path, "engine/rod[1]");
    EXPECT_EQ(scene.parts[2].path, "engine/piston");
    EXPECT_EQ(scene.parts[3].name, "a\xEF\xBF\xBD"
                                   "b");
    EXPECT_EQ(scene.parts[3].path, "engine/[0]/a\xEF\xBF\xBD"
                                   "b");
    ASSERT_EQ(scene.warnings.size(), 1u);
    EXPECT_EQ(scene.warnings[0].code, "W0310");
}

TEST(GltfNode, DefaultSceneAndVisibility) {
    TestFile file;
    file.add_mesh({{"POSITION", file.triangle()}});
    const Json hidden = {{"KHR_node_visibility", {{"visible", false}}}};
    file.root["nodes"] = {{{"mesh", 0}}, {{"mesh", 0}}, {{"children", {3}}, {"extensions", hidden}}, {{"mesh", 0}}};
    file.root["scenes"] = {{{"nodes", {0}}}, {{"nodes", {0, 1, 2}}}};
    EXPECT_EQ(file.read().parts.size(), 1u);
    file.root["scene"] = 1;
    EXPECT_EQ(file.read().parts.size(), 2u);
    file.root["scene"] = 2;
    EXPECT_EQ(error_of([&] { return file.read(); }).code, "E0306");
    file.root.erase("scene");
    file.root.erase("scenes");
    EXPECT_EQ(file.read().parts.size(), 2u);
}

TEST(GltfNode, UnusableTransformsLeaveThePartOut) {
    for (const Json& node :
         {Json{{"scale", {0, 1, 1}}}, Json{{"scale", {1e30, 1e30, 1e30}}}, Json{{"matrix", std::vector<int>(16, 0)}}}) {
        TestFile file;
        file.add_mesh({{"POSITION", file.triangle()}});
        file.root["nodes"][0].update(node);
        const Scene scene = file.read();
        EXPECT_TRUE(scene.parts.empty()) << node;
        ASSERT_FALSE(scene.warnings.empty());
        EXPECT_EQ(scene.warnings.back().code, "W0305");
    }
    TestFile mirrored;
    mirrored.add_mesh({{"POSITION", mirrored.triangle()}});
    mirrored.root["nodes"][0]["scale"] = {-2, 1, 1};
    const Scene scene = mirrored.read();
    ASSERT_EQ(scene.parts.size(), 1u);
    EXPECT_TRUE(scene.warnings.empty());
    EXPECT_EQ(scene.parts[0].world_from_mesh.determinant(), -2);
}

TEST(GltfNode, CamerasAndLights) {
    TestFile file;
    file.root["cameras"] = {
        {{"type", "perspective"}, {"name", "eye"}, {"perspective", {{"yfov", 0.5}, {"znear", 0.1}}}},
        {{"type", "orthographic"}, {"orthographic", {{"xmag", 2}, {"ymag", 3}, {"znear", 0}, {"zfar", 9}}}},
        {{"type", "perspective"}, {"perspective", {{"yfov", 0}, {"znear", 0}}}}};
    file.root["extensions"]["KHR_lights_punctual"]["lights"] = {
        {{"type", "spot"},
         {"intensity", 5},
         {"color", {1, 0.5, 0}},
         {"spot", {{"innerConeAngle", 0.1}, {"outerConeAngle", 0.2}}}},
        {{"type", "laser"}}};
    const auto with_light = [](int n) { return Json{{"KHR_lights_punctual", {{"light", n}}}}; };
    file.root["nodes"] = {{{"camera", 0}, {"scale", {2, 3, 4}}, {"translation", {1, 2, 3}}},
                          {{"camera", 1}},
                          {{"camera", 2}},
                          {{"camera", 9}},
                          {{"extensions", with_light(0)},
                           {"translation", {0, 5, 0}},
                           {"rotation", {-std::sqrt(0.5), 0, 0, std::sqrt(0.5)}}},
                          {{"extensions", with_light(1)}},
                          {{"extensions", with_light(2)}}};
    const Scene scene = file.read();
    ASSERT_EQ(scene.cameras.size(), 2u);
    EXPECT_EQ(scene.cameras[0].name, "eye");
    EXPECT_EQ(scene.cameras[0].fov_y, 0.5f);
    EXPECT_EQ(scene.cameras[0].world_from_camera.p, (Vec3d{1, 2, 3}));
    EXPECT_EQ(scene.cameras[0].world_from_camera.determinant(), 1);
    EXPECT_TRUE(scene.cameras[1].orthographic);
    EXPECT_EQ(scene.cameras[1].half_height, 3);
    ASSERT_EQ(scene.lights.size(), 1u);
    EXPECT_NEAR(scene.lights[0].direction.y, -1, 1e-6); // turned to look down
    EXPECT_EQ(scene.lights[0].position, (Vec3f{0, 5, 0}));
    EXPECT_EQ(scene.lights[0].outer_cone, 0.2f);
    EXPECT_EQ(scene.warnings.size(), 4u);
    for (const Warning& w : scene.warnings) EXPECT_EQ(w.code, "W0306");
}

TEST(GltfNode, Instancing) {
    TestFile file;
    file.add_mesh({{"POSITION", file.triangle()}});
    const auto at = file.vec3({1, 0, 0, 2, 0, 0, 3, 0, 0}), scale = file.vec3({1, 1, 1, 2, 2, 2, 3, 3, 3});
    file.root["nodes"][0]["name"] = "bolt";
    file.root["nodes"][0]["translation"] = {0, 7, 0};
    Json& attributes = file.root["nodes"][0]["extensions"]["EXT_mesh_gpu_instancing"]["attributes"];
    attributes = {{"TRANSLATION", at}, {"SCALE", scale}};
    const Scene scene = file.read();
    ASSERT_EQ(scene.parts.size(), 3u);
    EXPECT_EQ(scene.meshes.size(), 1u);
    EXPECT_EQ(scene.parts[2].path, "bolt[2]");
    EXPECT_EQ(scene.parts[2].world_from_mesh.point({1, 1, 0}), (Vec3d{6, 10, 0}));
    attributes["SCALE"] = file.vec3({1, 1, 1});
    EXPECT_EQ(error_of([&] { return file.read(); }).code, "E0303");
}

} // namespace
} // namespace porthole::gltf
