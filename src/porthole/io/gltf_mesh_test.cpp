#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "porthole/io/gltf_mesh.h"
#include "porthole/io/gltf_test_file.h"

namespace porthole::gltf {
namespace {

constexpr std::initializer_list<float> kQuad = {0, 0, 0, 1, 0, 0, 0, 1, 0, 1, 1, 0};

TEST(GltfMesh, StripsFansAndLists) {
    const auto triangles = [](int mode, const std::vector<std::uint16_t>& indices) {
        TestFile file;
        Json& primitive = file.add_mesh({{"POSITION", file.vec3({0, 0, 0, 1, 0, 0, 0, 1, 0, 1, 1, 0, 0, 2, 1})}});
        primitive["mode"] = mode;
        if (!indices.empty()) primitive["indices"] = file.indices(indices);
        return file.read().meshes.at(0).triangles;
    };
    using T = std::vector<Vec3u>;
    EXPECT_EQ(triangles(4, {0, 1, 2, 2, 1, 3}), (T{{0, 1, 2}, {2, 1, 3}}));
    EXPECT_EQ(triangles(4, {}), (T{{0, 1, 2}})); // 5 vertices: one triangle, the rest is warned about
    EXPECT_EQ(triangles(5, {0, 1, 2, 3, 4}), (T{{0, 1, 2}, {1, 3, 2}, {2, 3, 4}}));
    EXPECT_EQ(triangles(5, {}), (T{{0, 1, 2}, {1, 3, 2}, {2, 3, 4}}));
    EXPECT_EQ(triangles(6, {0, 1, 3, 2}), (T{{1, 3, 0}, {3, 2, 0}}));
}

TEST(GltfMesh, LinesAndPointsAreLeftOutWithAWarning) {
    TestFile file;
    file.add_mesh({{"POSITION", file.triangle()}})["mode"] = 1;
    const Scene scene = file.read();
    EXPECT_TRUE(scene.parts.empty());
    ASSERT_EQ(scene.warnings.size(), 1u);
    EXPECT_EQ(scene.warnings[0].code, "W0302");
}

TEST(GltfMesh, IndexBeyondTheVerticesDropsItsTriangle) {
    TestFile file;
    file.add_mesh({{"POSITION", file.vec3(kQuad)}})["indices"] = file.indices({0, 1, 2, 2, 1, 4, 2, 1, 3});
    const Scene scene = file.read();
    EXPECT_EQ(scene.meshes.at(0).triangles, (std::vector<Vec3u>{{0, 1, 2}, {2, 1, 3}}));
    ASSERT_EQ(scene.warnings.size(), 1u);
    EXPECT_EQ(scene.warnings[0].where, "test.glb:/meshes/0/primitives/0/indices");
    EXPECT_NE(scene.warnings[0].reason.find("triangle 1 has index 4"), std::string::npos) << scene.warnings[0].reason;
}

TEST(GltfMesh, NonFiniteVerticesDropTheirTriangles) {
    TestFile file;
    std::vector<float> quad(kQuad);
    quad[9] = std::numeric_limits<float>::quiet_NaN();
    file.add_mesh({{"POSITION", file.vec3(quad)}})["indices"] = file.indices({0, 1, 2, 2, 1, 3});
    const Scene scene = file.read();
    EXPECT_EQ(scene.meshes.at(0).triangles.size(), 1u);
    for (const Vec3f& p : scene.meshes[0].positions) EXPECT_TRUE(is_finite(p));
    ASSERT_EQ(scene.warnings.size(), 1u);
    EXPECT_EQ(scene.warnings[0].code, "W0301");
}

TEST(GltfMesh, PrimitivesOfOneVertexArrayShareIt) {
    TestFile file;
    const auto positions = file.vec3(kQuad);
    file.root["materials"] = {{{"name", "red"}}, {{"name", "unused"}}, {{"name", "blue"}}};
    const Json attributes = {{"POSITION", positions}};
    file.root["meshes"] = {{{"primitives",
                             {{{"attributes", attributes}, {"indices", file.indices({0, 1, 2})}, {"material", 2}},
                              {{"attributes", attributes}, {"indices", file.indices({2, 1, 3})}, {"material", 0}},
                              {{"attributes", {{"POSITION", file.triangle()}}}}}}}};
    file.root["nodes"] = {{{"mesh", 0}}};
    const Scene scene = file.read();
    const Mesh& mesh = scene.meshes.at(0);
    EXPECT_EQ(mesh.positions.size(), 7u);
    EXPECT_EQ(mesh.triangles, (std::vector<Vec3u>{{0, 1, 2}, {2, 1, 3}, {4, 5, 6}}));
    ASSERT_EQ(scene.materials.size(), 3u);
    EXPECT_EQ(scene.materials[mesh.material_of(0)].name, "blue");
    EXPECT_EQ(scene.materials[mesh.material_of(1)].name, "red");
    EXPECT_EQ(scene.materials[mesh.material_of(2)].name, "");
    EXPECT_GE(mesh.positions.capacity(), mesh.positions.size() + 1);
}

TEST(GltfMesh, PrimitiveWithoutNormalsBesideOneWithBecomesFlat) {
    TestFile file;
    const auto up = file.vec3({0, 0, 2, 0, 0, 2, 0, 0, 0}); // not unit; the last has no length
    file.root["meshes"] = {{{"primitives",
                             {{{"attributes", {{"POSITION", file.triangle()}, {"NORMAL", up}}}},
                              {{"attributes", {{"POSITION", file.vec3({0, 0, 0, 0, 1, 0, 0, 0, 1})}}}}}}}};
    file.root["nodes"] = {{{"mesh", 0}}};
    const Mesh mesh = file.read().meshes.at(0);
    ASSERT_EQ(mesh.normals.size(), mesh.positions.size());
    for (const std::uint32_t v : {mesh.triangles[0].x, mesh.triangles[0].z})
        EXPECT_EQ(mesh.normals[v], (Vec3f{0, 0, 1}));
    for (const std::uint32_t v : {mesh.triangles[1].x, mesh.triangles[1].z})
        EXPECT_EQ(mesh.normals[v], (Vec3f{1, 0, 0}));
    for (const Vec3f& n : mesh.normals) EXPECT_NEAR(length(n), 1, 1e-6);
}

TEST(GltfMesh, AttributesOfAnotherCountAreIgnored) {
    TestFile file;
    file.add_mesh({{"POSITION", file.triangle()}, {"COLOR_0", file.vec4({1, 0, 0, 1})}});
    const Scene scene = file.read();
    EXPECT_TRUE(scene.meshes.at(0).colors.empty());
    ASSERT_EQ(scene.warnings.size(), 1u);
    EXPECT_EQ(scene.warnings[0].where, "test.glb:/meshes/0/primitives/0/attributes/COLOR_0");
}

TEST(GltfMesh, ColorsTextureCoordinatesAndTangents) {
    TestFile file;
    const auto colors = file.add<std::uint8_t>({255, 0, 51, 0, 0, 0, 0, 0, 0}, "VEC3", 5121, 3);
    file.root["accessors"][colors]["normalized"] = true;
    const auto uv = file.add<float>({0, 1, 2, std::numeric_limits<float>::infinity(), 0, 0}, "VEC2", 5126, 2);
    file.add_mesh({{"POSITION", file.triangle()},
                   {"NORMAL", file.vec3({0, 0, 1, 0, 0, 1, 0, 0, 1})},
                   {"COLOR_0", colors},
                   {"TEXCOORD_1", uv},
                   {"TANGENT", file.vec4({2, 0, 0, -1, 0, 0, 0, 1, 0, 3, 0, 1})}});
    const Mesh mesh = file.read().meshes.at(0);
    EXPECT_EQ(mesh.colors[0], (Vec4f{1, 0, 51.0f / 255.0f, 1}));
    EXPECT_TRUE(mesh.uv[0].empty());
    EXPECT_EQ(mesh.uv[1][1], (Vec2f{2, 0}));
    EXPECT_EQ(mesh.tangents[0], (Vec4f{1, 0, 0, -1}));
    EXPECT_EQ(mesh.tangents[2], (Vec4f{0, 1, 0, 1}));
    EXPECT_NEAR(length(Vec3f{mesh.tangents[1].x, mesh.tangents[1].y, mesh.tangents[1].z}), 1, 1e-6);
}

TEST(GltfMesh, MorphTargetsByMeshNodeAndAnimation) {
    TestFile file;
    const auto lift = file.vec3({0, 0, 1, 0, 0, 1, 0, 0, 1}), push = file.vec3({10, 0, 0, 10, 0, 0, 10, 0, 0});
    Json& primitive = file.add_mesh({{"POSITION", file.triangle()}});
    primitive["targets"] = {{{"POSITION", lift}}, {{"POSITION", push}}};
    file.root["nodes"].push_back({{"mesh", 0}, {"weights", {0, 0.5}}});
    file.root["nodes"].push_back({{"mesh", 0}});
    const auto first_point = [](const Scene& scene, std::size_t part) {
        return scene.meshes[scene.parts.at(part).mesh].positions[0];
    };
    EXPECT_EQ(first_point(file.read(), 0), (Vec3f{0, 0, 0}));
    EXPECT_EQ(first_point(file.read(), 1), (Vec3f{5, 0, 0}));
    EXPECT_EQ(file.read().meshes.size(), 2u); // nodes 0 and 2 share one
    file.root["meshes"][0]["weights"] = {0.25, 0};
    EXPECT_EQ(first_point(file.read(), 0), (Vec3f{0, 0, 0.25f}));
    EXPECT_EQ(first_point(file.read(), 1), (Vec3f{5, 0, 0}));

    const auto times = file.scalars({0, 2}), weights = file.scalars({0, 0, 1, 1});
    file.root["animations"] = {{{"samplers", {{{"input", times}, {"output", weights}}}},
                                {"channels", {{{"sampler", 0}, {"target", {{"node", 2}, {"path", "weights"}}}}}}}};
    EXPECT_EQ(first_point(file.read(), 2), (Vec3f{0, 0, 0.25f})); // at rest
    EXPECT_EQ(first_point(file.read(1), 2), (Vec3f{5, 0, 0.5f})); // half way
    EXPECT_EQ(first_point(file.read(99), 2), (Vec3f{10, 0, 1}));
}

// Two joints; the third vertex hangs half on each.
TEST(GltfMesh, SkinsBlendJointsAndIgnoreTheNode) {
    TestFile file;
    const auto joints = file.add<std::uint8_t>({0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0}, "VEC4", 5121, 4);
    const auto weights = file.vec4({1, 0, 0, 0, 2, 0, 0, 0, 0.5f, 0.5f, 0, 0}); // the second is not normalised
    file.add_mesh({{"POSITION", file.triangle()},
                   {"NORMAL", file.vec3({0, 0, 1, 0, 0, 1, 0, 0, 1})},
                   {"JOINTS_0", joints},
                   {"WEIGHTS_0", weights}});
    std::vector<float> inverse_bind(32, 0);
    for (int j = 0; j < 2; ++j)
        for (int k = 0; k < 4; ++k) inverse_bind[std::size_t(j * 16 + k * 5)] = 1;
    inverse_bind[16 + 12] = -1; // joint 1 was bound at x = 1
    file.root["skins"] = {{{"joints", {1, 2}}, {"inverseBindMatrices", file.add(inverse_bind, "MAT4", 5126, 16)}}};
    file.root["nodes"][0]["skin"] = 0;
    file.root["nodes"][0]["translation"] = {100, 0, 0};
    const float s = std::sqrt(0.5f);
    file.root["nodes"].push_back({{"translation", {0, 0, 5}}});
    file.root["nodes"].push_back({{"translation", {1, 0, 0}}, {"rotation", {0, s, 0, s}}}); // 90 degrees about y
    const Scene scene = file.read();
    ASSERT_EQ(scene.parts.size(), 1u);
    EXPECT_EQ(scene.parts[0].world_from_mesh, Affine3d{});
    const Mesh& mesh = scene.meshes[0];
    const auto near = [](Vec3f a, Vec3f b) { return length(a - b) < 1e-6f; };
    EXPECT_TRUE(near(mesh.positions[0], {0, 0, 5}));
    EXPECT_TRUE(near(mesh.positions[1], {1, 0, 0}));
    EXPECT_TRUE(near(mesh.positions[2], {0.5f, 1, 3})); // mean of (0,1,5) and (1,1,1)
    EXPECT_TRUE(near(mesh.normals[0], {0, 0, 1}));
    EXPECT_TRUE(near(mesh.normals[1], {1, 0, 0}));
    EXPECT_TRUE(scene.warnings.empty());

    file.root["skins"][0]["joints"] = {1};
    EXPECT_EQ(file.read().warnings.at(0).code, "W0307");
    file.root["skins"][0]["joints"] = {9};
    EXPECT_EQ(error_of([&] { return file.read(); }).code, "E0306");
    file.root["skins"][0]["joints"] = {0, 1, 2};
    EXPECT_EQ(error_of([&] { return file.read(); }).code, "E0303"); // two matrices for three joints
}

TEST(GltfMesh, ResultDoesNotDependOnThreads) {
    TestFile file;
    std::vector<float> positions, normals;
    for (int i = 0; i < 300000; ++i) {
        const float t = float(i) * 0.001f;
        positions.insert(positions.end(), {std::cos(t), std::sin(t), t});
        normals.insert(normals.end(), {std::cos(t) * 3, std::sin(t), 0.1f});
    }
    file.add_mesh({{"POSITION", file.vec3(positions)}, {"NORMAL", file.vec3(normals)}})["mode"] = 5;
    const Scene one = file.read(-1, 1), many = file.read(-1, 5);
    ASSERT_EQ(one.meshes[0].triangles.size(), 299998u);
    EXPECT_EQ(one.meshes[0].triangles, many.meshes[0].triangles);
    EXPECT_EQ(one.meshes[0].positions, many.meshes[0].positions);
    EXPECT_EQ(one.meshes[0].normals, many.meshes[0].normals);
}

TEST(GltfMesh, MemoryLimit) {
    TestFile file;
    const auto positions = file.vec3(std::vector<float>(30000, 1));
    for (int i = 0; i < 100; ++i) file.add_mesh({{"POSITION", positions}});
    LoadParams params;
    params.max_bytes = 1 << 20;
    EXPECT_EQ(error_of([&] { return read_gltf(FileBytes(file.glb()), "x.glb", params, {}); }).code, "E0902");
}

// What can be referred to any number of times must not fill the memory: nothing here takes
// more than a moment.
TEST(GltfMesh, SmallFilesDoNotUnfold) {
    TestFile many;
    const auto positions = many.vec3(std::vector<float>(300000, 1));
    for (int i = 0; i < 1000; ++i) many.add_mesh({{"POSITION", positions}}); // 1.2 GB
    EXPECT_EQ(error_of([&] { return many.read(); }).code, "E0902");

    TestFile instances;
    instances.root["accessors"] = {{{"componentType", 5126}, {"type", "VEC3"}, {"count", 65000}}};
    instances.add_mesh({{"POSITION", instances.triangle()}});
    instances.root["nodes"][0]["extensions"]["EXT_mesh_gpu_instancing"]["attributes"]["TRANSLATION"] = 0;
    for (int i = 0; i < 100; ++i) instances.root["nodes"].push_back(Json(instances.root["nodes"][0]));
    EXPECT_EQ(error_of([&] { return instances.read(); }).code, "E0902");

    TestFile sparse;
    const auto base = sparse.add(std::vector<std::uint8_t>(4000, 0), "SCALAR", 5121, 1);
    std::vector<std::uint16_t> all(4000);
    for (std::size_t i = 0; i < all.size(); ++i) all[i] = static_cast<std::uint16_t>(i);
    const auto at = sparse.add_view(all);
    sparse.root["accessors"][base]["sparse"] = {
        {"count", 4000}, {"indices", {{"bufferView", at}, {"componentType", 5123}}}, {"values", {{"bufferView", 0}}}};
    for (int i = 0; i < 300; ++i) sparse.root["accessors"].push_back(Json(sparse.root["accessors"][base]));
    EXPECT_EQ(error_of([&] { return sparse.read(); }).code, "E0902");
}

TEST(GltfMesh, BrokenDracoIsRefused) {
    TestFile file;
    Json& primitive = file.add_mesh({{"POSITION", file.triangle()}});
    const std::size_t view = file.add_view(std::vector<char>(100, 'D'));
    primitive["extensions"]["KHR_draco_mesh_compression"] = {{"bufferView", view}, {"attributes", {{"POSITION", 0}}}};
    const Error e = error_of([&] { return file.read(); });
    EXPECT_EQ(e.code, "E0308");
    EXPECT_EQ(e.where, "test.glb:/meshes/0/primitives/0/extensions/KHR_draco_mesh_compression");
}

} // namespace
} // namespace porthole::gltf
