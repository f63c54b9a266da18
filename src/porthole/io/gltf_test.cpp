#include "porthole/io/gltf.h"

#include <gtest/gtest.h>

#include <cmath>

#include "porthole/io/gltf_test_file.h"
#include "porthole/io/image_file.h"

namespace porthole::gltf {
namespace {

// A triangle with the given material.
TestFile painted(const Json& material) {
    TestFile file;
    file.add_mesh({{"POSITION", file.triangle()}})["material"] = 0;
    file.root["materials"] = {material};
    return file;
}

std::size_t add_png(TestFile& file, Rgba8 color) {
    const std::vector<std::byte> png = encode_png(Image<Rgba8>(2, 3, color), 4);
    const std::size_t view = file.add_view(png);
    file.root["images"].push_back({{"bufferView", view}, {"mimeType", "image/png"}});
    return file.root["images"].size() - 1;
}

TEST(Gltf, VersionsAndExtensions) {
    const auto code = [](const Json& root) {
        return error_of([&] { return read_gltf(FileBytes(root.dump()), "x", {}, {}); }).code;
    };
    const auto version = [&](const char* v) { return code({{"asset", {{"version", v}}}}); };
    EXPECT_EQ(version("2.0"), "none");
    EXPECT_EQ(version("2.7"), "none");
    for (const char* v : {"1.0", "3.0", "2", "", "two", "-2.0"}) EXPECT_EQ(version(v), "E0304") << v;
    EXPECT_EQ(code({{"asset", {{"version", "2.0"}, {"minVersion", "2.1"}}}}), "E0304");
    EXPECT_EQ(code(Json::object()), "E0304");
    EXPECT_EQ(code(Json::array()), "E0303");
    const Json asset = {{"version", "2.0"}};
    EXPECT_EQ(code({{"asset", asset}, {"extensionsRequired", {"ACME_dream"}}}), "E0305");
    EXPECT_EQ(code({{"asset", asset}, {"extensionsUsed", {"ACME_dream"}}}), "none");
    const Json sheen = {{"asset", asset}, {"extensionsRequired", {"KHR_materials_sheen"}}};
    EXPECT_EQ(read_gltf(FileBytes(sheen.dump()), "x", {}, {}).warnings.at(0).code, "W0308");
}

TEST(Gltf, NamesInAnOldCodePage) {
    TestFile file;
    file.add_mesh({{"POSITION", file.triangle()}});
    file.root["nodes"][0]["name"] = "K@rper";
    std::string glb = file.glb();
    glb[glb.find("K@rper") + 1] = '\xF6'; // Latin-1
    const Scene scene = read_gltf(FileBytes(glb), "x.glb", {}, {});
    EXPECT_EQ(scene.parts.at(0).name, "K\xEF\xBF\xBDrper");
    EXPECT_EQ(scene.warnings.at(0).code, "W0310");
}

TEST(Gltf, MetallicRoughnessMaterial) {
    TestFile file =
        painted({{"name", "amber"},
                 {"pbrMetallicRoughness",
                  {{"baseColorFactor", {0.5, 0.25, 0, 1}}, {"metallicFactor", 0}, {"roughnessFactor", 0.5}}},
                 {"alphaMode", "MASK"},
                 {"alphaCutoff", 0.75},
                 {"doubleSided", true},
                 {"emissiveFactor", {1, 0.5, 0}},
                 {"extensions",
                  {{"KHR_materials_emissive_strength", {{"emissiveStrength", 4}}},
                   {"KHR_materials_ior", {{"ior", 1.54}}},
                   {"KHR_materials_transmission", {{"transmissionFactor", 0.9}}},
                   {"KHR_materials_unlit", Json::object()},
                   {"KHR_materials_volume",
                    {{"thicknessFactor", 2}, {"attenuationDistance", 0.1}, {"attenuationColor", {1, 0.6, 0.1}}}}}}});
    const Scene scene = file.read();
    const Material& m = scene.materials.at(0);
    EXPECT_EQ(m.name, "amber");
    EXPECT_EQ(m.base_color, (Vec4f{0.5f, 0.25f, 0, 1}));
    EXPECT_EQ(m.metallic, 0);
    EXPECT_EQ(m.roughness, 0.5f);
    EXPECT_EQ(m.alpha_mode, AlphaMode::mask);
    EXPECT_EQ(m.alpha_cutoff, 0.75f);
    EXPECT_TRUE(m.double_sided && m.unlit);
    EXPECT_EQ(m.emissive, (Vec3f{4, 2, 0}));
    EXPECT_EQ(m.ior, 1.54f);
    EXPECT_EQ(m.transmission, 0.9f);
    EXPECT_EQ(m.thickness, 2);
    EXPECT_EQ(m.attenuation_distance, 0.1f);
    EXPECT_EQ(m.attenuation_color, (Vec3f{1, 0.6f, 0.1f}));
    EXPECT_TRUE(scene.warnings.empty());
}

TEST(Gltf, SpecularGlossinessMaterial) {
    TestFile file = painted(
        {{"pbrMetallicRoughness", {{"baseColorFactor", {1, 0, 0, 1}}}},
         {"extensions",
          {{"KHR_materials_pbrSpecularGlossiness",
            {{"diffuseFactor", {0, 1, 0, 1}}, {"specularFactor", {0.1, 0.2, 0.3}}, {"glossinessFactor", 0.75}}}}}});
    const Material m = file.read().materials.at(0);
    EXPECT_TRUE(m.specular_workflow);
    EXPECT_EQ(m.base_color, (Vec4f{0, 1, 0, 1}));
    EXPECT_EQ(m.specular_color, (Vec3f{0.1f, 0.2f, 0.3f}));
    EXPECT_EQ(m.roughness, 0.25f);
}

TEST(Gltf, ValuesOutOfRangeAreClampedWithAWarning) {
    TestFile file = painted({{"pbrMetallicRoughness", {{"metallicFactor", 2}, {"roughnessFactor", -1}}},
                             {"alphaMode", "GLASS"},
                             {"extensions", {{"KHR_materials_ior", {{"ior", 0.5}}}}}});
    const Scene scene = file.read();
    EXPECT_EQ(scene.materials.at(0).metallic, 1);
    EXPECT_EQ(scene.materials.at(0).roughness, 0);
    EXPECT_EQ(scene.materials.at(0).ior, 1);
    EXPECT_EQ(scene.warnings.size(), 4u);
}

TEST(Gltf, TexturesAndEqualImages) {
    TestFile file =
        painted({{"pbrMetallicRoughness", {{"baseColorTexture", {{"index", 1}, {"texCoord", 1}}}}},
                 {"normalTexture", {{"index", 2}, {"scale", 0.5}}},
                 {"occlusionTexture", {{"index", 1}, {"strength", 0.25}}},
                 {"emissiveTexture",
                  {{"index", 3},
                   {"extensions",
                    {{"KHR_texture_transform",
                      {{"offset", {0.5, 0.25}}, {"scale", {2, 3}}, {"rotation", 1.5}, {"texCoord", 1}}}}}}}});
    const Rgba8 red{255, 0, 0, 128}, blue{0, 0, 255, 255};
    const std::size_t unused = add_png(file, {1, 2, 3, 4}), a = add_png(file, red), b = add_png(file, red),
                      c = add_png(file, blue);
    file.root["samplers"] = {{{"wrapS", 33071}, {"wrapT", 33648}, {"magFilter", 9728}}};
    file.root["textures"] = {{{"source", unused}}, {{"source", a}, {"sampler", 0}}, {{"source", b}}, {{"source", c}}};
    const Scene scene = file.read();
    const Material& m = scene.materials.at(0);
    ASSERT_EQ(scene.images.size(), 2u); // red once, blue; the unused one not at all
    ASSERT_EQ(scene.textures.size(), 3u);
    const auto texture = [&](const TextureRef& ref) -> const Texture& {
        return scene.textures.at(std::size_t(ref.texture));
    };
    EXPECT_EQ(scene.images[std::size_t(texture(m.base_color_texture).image)](1, 2), red);
    EXPECT_EQ(texture(m.normal_texture).image, texture(m.base_color_texture).image);
    EXPECT_EQ(scene.images[std::size_t(texture(m.emissive_texture).image)](0, 0), blue);
    EXPECT_EQ(texture(m.base_color_texture).wrap_u, Wrap::clamp);
    EXPECT_EQ(texture(m.base_color_texture).wrap_v, Wrap::mirror);
    EXPECT_TRUE(texture(m.base_color_texture).nearest);
    EXPECT_EQ(texture(m.normal_texture).wrap_u, Wrap::repeat);
    EXPECT_EQ(m.base_color_texture.uv_set, 1);
    EXPECT_EQ(m.base_color_texture.texture, m.occlusion_texture.texture);
    EXPECT_EQ(m.occlusion_strength, 0.25f);
    EXPECT_EQ(m.normal_scale, 0.5f);
    EXPECT_EQ(m.emissive_texture.uv_set, 1);
    EXPECT_EQ(m.emissive_texture.offset, (Vec2f{0.5f, 0.25f}));
    EXPECT_EQ(m.emissive_texture.scale, (Vec2f{2, 3}));
    EXPECT_EQ(m.emissive_texture.rotation, 1.5f);
    EXPECT_TRUE(scene.warnings.empty());
}

TEST(Gltf, UnreadableTexturesAreWarnings) {
    TestFile file = painted(
        {{"pbrMetallicRoughness", {{"baseColorTexture", {{"index", 0}}}, {"metallicRoughnessTexture", {{"index", 9}}}}},
         {"normalTexture", {{"index", 1}}},
         {"occlusionTexture", {{"index", 2}}},
         {"emissiveTexture", {{"index", 0}, {"texCoord", 5}}}});
    const std::size_t view = file.add_view(std::vector<char>(20, 'x')); // no picture
    file.root["images"] = {{{"bufferView", view}}, {{"uri", "gone.png"}}, {{"uri", "x.ktx2"}}};
    file.root["textures"] = {
        {{"source", 0}}, {{"source", 1}}, {{"extensions", {{"KHR_texture_basisu", {{"source", 2}}}}}}};
    file.root["extensionsRequired"] = {"KHR_texture_basisu"};
    const Scene scene = file.read();
    const Material& m = scene.materials.at(0);
    EXPECT_EQ(m.metallic_roughness_texture.texture, kNone);
    EXPECT_EQ(m.occlusion_texture.texture, kNone);
    EXPECT_EQ(m.emissive_texture.texture, kNone);
    ASSERT_NE(m.base_color_texture.texture, kNone);
    for (const Image<Rgba8>& image : scene.images) EXPECT_TRUE(image.empty());
    EXPECT_EQ(scene.parts.size(), 1u);
    EXPECT_EQ(scene.warnings.size(), 5u);
}

TEST(Gltf, AnimatedNodeAtATime) {
    TestFile file;
    file.add_mesh({{"POSITION", file.triangle()}});
    const auto times = file.scalars({0, 1}), values = file.vec3({0, 0, 0, 4, 0, 0});
    file.root["animations"] = {{{"samplers", {{{"input", times}, {"output", values}}}},
                                {"channels", {{{"sampler", 0}, {"target", {{"node", 0}, {"path", "translation"}}}}}}}};
    EXPECT_EQ(file.read(-1).parts.at(0).world_from_mesh.p.x, 0);
    EXPECT_EQ(file.read(0.25).parts.at(0).world_from_mesh.p.x, 1);
    EXPECT_EQ(file.read(7).parts.at(0).world_from_mesh.p.x, 4);
    file.root["nodes"][0]["matrix"] = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1};
    const Scene scene = file.read(0.25);
    EXPECT_EQ(scene.parts.at(0).world_from_mesh.p.x, 0);
    EXPECT_EQ(scene.warnings.at(0).code, "W0309");
}

TEST(Gltf, Cancelled) {
    TestFile file;
    file.add_mesh({{"POSITION", file.triangle()}});
    std::stop_source source;
    source.request_stop();
    Control control;
    control.stop = source.get_token();
    EXPECT_THROW((void)read_gltf(FileBytes(file.glb()), "x.glb", {}, control), Cancelled);
}

} // namespace
} // namespace porthole::gltf
