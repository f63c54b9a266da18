#include "porthole/scene/texture.h"

#include <gtest/gtest.h>

#include <cmath>

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

/// A texture of cells x cells squares of two colours, `side` texels wide, on one triangle whose
/// texture coordinates are (u, v).
Scene checker(int side, int cells) {
    Scene s = textured();
    s.images[0] = Image<Rgba8>(side, side);
    for (int y = 0; y < side; ++y)
        for (int x = 0; x < side; ++x)
            s.images[0](x, y) =
                (x * cells / side + y * cells / side) % 2 ? Rgba8{250, 240, 20, 255} : Rgba8{10, 90, 200, 255};
    s.materials[0].base_color = {1, 1, 1, 1};
    return s;
}

/// The mean of the image itself over the ellipse of a footprint.
Vec4f averaged(const Scene& s, float u, float v, const Footprint& f) {
    Vec4f sum{0, 0, 0, 0};
    int n = 0;
    constexpr int kSide = 160;
    for (int i = 0; i < kSide; ++i)
        for (int j = 0; j < kSide; ++j) {
            const float a = (float(i) + 0.5f) / kSide - 0.5f, b = (float(j) + 0.5f) / kSide - 0.5f;
            if (a * a + b * b > 0.25f) continue;
            sum = sum + sample_texture(s, ref(), s.meshes[0], 0, u + f.a.x * a + f.b.x * b, v + f.a.y * a + f.b.y * b,
                                       Encoding::srgb);
            ++n;
        }
    return sum * (1.0f / float(n));
}

double distance(Vec4f a, Vec4f b) {
    return std::hypot(double(a.x) - double(b.x), double(a.y) - double(b.y), double(a.z) - double(b.z));
}

TEST(Mips, EachLevelIsTheMeanAsLightWhateverTheSize) {
    for (const Vec2i size : {Vec2i{64, 64}, Vec2i{37, 19}, Vec2i{1, 5}, Vec2i{3, 1}}) {
        Scene s = textured();
        s.images[0] = Image<Rgba8>(size.x, size.y);
        unsigned random = 7;
        double mean[4] = {};
        for (Rgba8& p : s.images[0].pixels()) {
            const auto next = [&] { return std::uint8_t((random = random * 1664525u + 1013904223u) >> 24); };
            p = {next(), next(), next(), next()};
            mean[0] += double(linear_from_srgb8(p.r)), mean[1] += double(linear_from_srgb8(p.g));
            mean[2] += double(linear_from_srgb8(p.b)), mean[3] += p.a / 255.0;
        }
        build_mips(s);
        ASSERT_EQ(s.mips.size(), 1u);
        ASSERT_FALSE(s.mips[0].empty());
        const Image<Rgba8>& last = s.mips[0].back();
        ASSERT_EQ(last.pixels().size(), 1u);
        const Rgba8 p = last(0, 0);
        const double n = double(size.x) * size.y,
                     got[4] = {double(linear_from_srgb8(p.r)), double(linear_from_srgb8(p.g)),
                               double(linear_from_srgb8(p.b)), p.a / 255.0};
        for (int c = 0; c < 4; ++c) EXPECT_NEAR(got[c], mean[c] / n, 0.02) << size.x << 'x' << size.y;
        int width = size.x;
        for (const auto& level : s.mips[0]) EXPECT_EQ(level.width(), width = std::max(1, width / 2));
    }
}

TEST(Mips, DataAreAveragedAsNumbersAndHiddenColoursDoNotCount) {
    Scene s = textured();
    s.images[0] = Image<Rgba8>(2, 1);
    s.images[0](0, 0) = {200, 0, 0, 255}, s.images[0](1, 0) = {0, 200, 100, 0};
    s.materials[0].alpha_mode = AlphaMode::mask;
    build_mips(s);
    EXPECT_EQ(s.mips[0][0](0, 0), (Rgba8{200, 0, 0, 128}));
    s.materials[0].base_color_texture = {};
    s.materials[0].normal_texture.texture = 0;
    build_mips(s);
    EXPECT_EQ(s.mips[0][0](0, 0), (Rgba8{100, 100, 50, 128}));
}

TEST(Mips, AFootprintIsTheMeanOfTheImageOverIt) {
    for (const int side : {64, 150}) {
        Scene s = checker(side, side / 4); // squares of four texels
        const Scene plain = s;
        build_mips(s);
        double filtered = 0, point = 0, worst = 0;
        int n = 0;
        for (int i = 0; i < 300; ++i) {
            const float angle = float(i) * 2.4f, size = 0.5f * std::pow(40.0f, float(i % 10) / 9); // 0.5 to 20 texels
            const float ratio = 1.0f + float(i % 7);
            const Vec2f d{std::cos(angle) / float(side), std::sin(angle) / float(side)};
            Footprint f;
            f.a = d * (size * ratio), f.b = Vec2f{-d.y, d.x} * size;
            if (i % 2) std::swap(f.a, f.b);
            const float u = 0.1f + 0.35f * float(i % 17) / 17, v = 0.1f + 0.35f * float(i % 23) / 23;
            const Vec4f exact = averaged(plain, u, v, f);
            const double error = distance(sample_texture(s, ref(), s.meshes[0], 0, u, v, Encoding::srgb, f), exact);
            filtered += error * error;
            worst = std::max(worst, error);
            const double unfiltered = distance(sample_texture(s, ref(), s.meshes[0], 0, u, v, Encoding::srgb), exact);
            point += unfiltered * unfiltered;
            ++n;
        }
        filtered = std::sqrt(filtered / n), point = std::sqrt(point / n);
        EXPECT_LT(filtered, 0.2 * point) << side; // the squares' colours are 1.1 apart
        EXPECT_LT(filtered, 0.10) << side;
        EXPECT_LT(worst, 0.4) << side;
    }
}

TEST(Mips, WithoutThemOrWithinATexelTheImageIsLookedUpAsItIs) {
    Scene s = checker(64, 16);
    const Footprint small{{0.004f, 0}, {0, 0.003f}}, large{{0.2f, 0}, {0, 0.1f}};
    const auto at = [&](const Footprint& f) {
        return sample_texture(s, ref(), s.meshes[0], 0, 0.31f, 0.27f, Encoding::srgb, f);
    };
    const Vec4f plain = at({});
    expect_color(at(large), plain, 0);
    build_mips(s);
    expect_color(at({}), plain, 0);
    expect_color(at(small), plain, 0);
    EXPECT_GT(distance(at(large), plain), 0.05);
}

} // namespace
} // namespace porthole
