#include "porthole/scene/texture.h"

#include <gtest/gtest.h>

namespace porthole {
namespace {

// One triangle whose texture coordinates equal (u, v), and a 2x2 picture:
// red green
// blue  white, half transparent
Scene textured(Wrap wrap = Wrap::repeat, bool nearest = false) {
    Scene scene;
    Image<Rgba8> image(2, 2);
    image(0, 0) = {255, 0, 0, 255};
    image(1, 0) = {0, 255, 0, 255};
    image(0, 1) = {0, 0, 255, 255};
    image(1, 1) = {255, 255, 255, 128};
    scene.images.push_back(image);
    Texture texture;
    texture.image = 0, texture.wrap_u = texture.wrap_v = wrap, texture.nearest = nearest;
    scene.textures.push_back(texture);
    Material material;
    material.base_color = {0.5f, 1, 1, 0.8f};
    material.base_color_texture.texture = 0;
    scene.materials.push_back(material);
    Mesh mesh;
    mesh.positions = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
    mesh.triangles = {{0, 1, 2}};
    mesh.uv[0] = {{0, 0}, {1, 0}, {0, 1}};
    mesh.submeshes = {{0, 1, 0}};
    scene.meshes.push_back(mesh);
    return scene;
}

TextureRef ref() {
    TextureRef r;
    r.texture = 0;
    return r;
}

void expect_color(Vec4f a, Vec4f b, float tolerance = 1e-5f) {
    EXPECT_NEAR(a.x, b.x, tolerance);
    EXPECT_NEAR(a.y, b.y, tolerance);
    EXPECT_NEAR(a.z, b.z, tolerance);
    EXPECT_NEAR(a.w, b.w, tolerance);
}

TEST(Texture, TexelCentresGiveTheTexelsAndTopLeftIsFirst) {
    const Scene s = textured();
    expect_color(sample_texture(s, ref(), {0.25f, 0.25f}, Encoding::linear), {1, 0, 0, 1});
    expect_color(sample_texture(s, ref(), {0.75f, 0.25f}, Encoding::linear), {0, 1, 0, 1});
    expect_color(sample_texture(s, ref(), {0.25f, 0.75f}, Encoding::linear), {0, 0, 1, 1});
    expect_color(sample_texture(s, ref(), {0.75f, 0.75f}, Encoding::linear), {1, 1, 1, 128 / 255.0f});
}

TEST(Texture, IsBilinearBetweenThem) {
    const Scene s = textured();
    expect_color(sample_texture(s, ref(), {0.5f, 0.25f}, Encoding::linear), {0.5f, 0.5f, 0, 1});
    expect_color(sample_texture(s, ref(), {0.5f, 0.5f}, Encoding::linear), {0.5f, 0.5f, 0.5f, (3 + 128 / 255.0f) / 4});
    const Scene n = textured(Wrap::repeat, true);
    expect_color(sample_texture(n, ref(), {0.49f, 0.25f}, Encoding::linear), {1, 0, 0, 1});
    expect_color(sample_texture(n, ref(), {0.51f, 0.25f}, Encoding::linear), {0, 1, 0, 1});
}

TEST(Texture, WrapsAsAsked) {
    const Vec4f red{1, 0, 0, 1}, green{0, 1, 0, 1};
    expect_color(sample_texture(textured(Wrap::repeat), ref(), {1.25f, -0.75f}, Encoding::linear), red);
    expect_color(sample_texture(textured(Wrap::clamp), ref(), {7.0f, -3.0f}, Encoding::linear), green);
    expect_color(sample_texture(textured(Wrap::mirror), ref(), {1.25f, 0.25f}, Encoding::linear), green);
    expect_color(sample_texture(textured(Wrap::mirror), ref(), {-0.25f, 0.25f}, Encoding::linear), red);
    // Across the border: repeat mixes with the other side, clamp does not.
    expect_color(sample_texture(textured(Wrap::repeat), ref(), {0.0f, 0.25f}, Encoding::linear), {0.5f, 0.5f, 0, 1});
    expect_color(sample_texture(textured(Wrap::clamp), ref(), {0.0f, 0.25f}, Encoding::linear), red);
}

TEST(Texture, HostileCoordinatesAndIndicesAreHarmless) {
    const Scene s = textured();
    for (const float u : {1e30f, -1e30f, kInfinity, -kInfinity, std::nanf("")}) {
        const Vec4f c = sample_texture(s, ref(), {u, u}, Encoding::srgb);
        EXPECT_TRUE(c.x >= 0 && c.x <= 1);
    }
    TextureRef beyond = ref();
    beyond.texture = 5;
    expect_color(sample_texture(s, beyond, {0.25f, 0.25f}, Encoding::srgb), {1, 1, 1, 1});
    Scene empty = textured();
    empty.images[0] = {};
    expect_color(sample_texture(empty, ref(), {0.25f, 0.25f}, Encoding::srgb), {1, 1, 1, 1});
}

TEST(Texture, DecodesSrgbButNotAlpha) {
    Scene s = textured();
    s.images[0] = Image<Rgba8>(1, 1, Rgba8{188, 0, 10, 188});
    const Vec4f c = sample_texture(s, ref(), {0.5f, 0.5f}, Encoding::srgb);
    EXPECT_NEAR(c.x, 0.5029f, 1e-3f);
    EXPECT_NEAR(c.z, 10 / 255.0f / 12.92f, 1e-6f);
    EXPECT_NEAR(c.w, 188 / 255.0f, 1e-6f);
}

TEST(TextureTransform, ScalesTurnsThenShifts) {
    TextureRef r = ref();
    r.scale = {2, 3};
    r.offset = {0.1f, 0.2f};
    EXPECT_NEAR(transform_uv(r, {1, 1}).x, 2.1f, 1e-6f);
    EXPECT_NEAR(transform_uv(r, {1, 1}).y, 3.2f, 1e-6f);
    // A quarter turn counter-clockwise as seen on the image, whose v runs down: (1,0) -> (0,-1).
    r = ref();
    r.rotation = kPi / 2;
    EXPECT_NEAR(transform_uv(r, {1, 0}).x, 0.0f, 1e-6f);
    EXPECT_NEAR(transform_uv(r, {1, 0}).y, -1.0f, 1e-6f);
}

TEST(BaseColor, MultipliesFactorTextureAndVertexColor) {
    Scene s = textured();
    s.meshes[0].colors = {{1, 1, 1, 0.5f}, {1, 1, 1, 0.5f}, {1, 1, 1, 0.5f}};
    expect_color(base_color(s, s.meshes[0], 0, 0.25f, 0.25f), {0.5f, 0, 0, 0.4f});
    EXPECT_NEAR(base_alpha(s, s.meshes[0], 0, 0.25f, 0.25f), 0.4f, 1e-6f);
    EXPECT_NEAR(base_alpha(s, s.meshes[0], 0, 0.75f, 0.75f), 0.8f * 0.5f * 128 / 255, 1e-5f);
}

TEST(TransmissionTint, OpaqueStopsBlendedAndTransmissiveTint) {
    Scene s = textured();
    const Mesh& mesh = s.meshes[0];
    EXPECT_EQ(transmission_tint(s, mesh, 0, 0.25f, 0.25f), (Vec3f{0, 0, 0}));
    s.materials[0].base_color_texture.texture = kNone;
    s.materials[0].base_color = {1, 0.5f, 0, 0.25f};
    s.materials[0].alpha_mode = AlphaMode::blend;
    const Vec3f blend = transmission_tint(s, mesh, 0, 0.25f, 0.25f);
    EXPECT_NEAR(blend.x, 0.75f, 1e-6f);
    EXPECT_NEAR(blend.y, 0.75f * 0.875f, 1e-6f);
    EXPECT_NEAR(blend.z, 0.75f * 0.75f, 1e-6f);
    s.materials[0].alpha_mode = AlphaMode::opaque;
    s.materials[0].transmission = 0.9f;
    const Vec3f glass = transmission_tint(s, mesh, 0, 0.25f, 0.25f);
    EXPECT_NEAR(glass.x, 0.9f, 1e-6f);
    EXPECT_NEAR(glass.y, 0.45f, 1e-6f);
    // A body is crossed twice: both crossings together give its colour and Beer's law.
    s.materials[0].transmission = 1;
    s.materials[0].thickness = 2;
    s.materials[0].attenuation_distance = 1;
    s.materials[0].attenuation_color = {1, 0.5f, 1};
    const Vec3f once = transmission_tint(s, mesh, 0, 0.25f, 0.25f);
    EXPECT_NEAR(once.y * once.y, 0.5f * 0.25f, 1e-6f);
}

} // namespace
} // namespace porthole
