#include "porthole/render/shade.h"

#include <gtest/gtest.h>

#include "porthole/render/lighting.h"
#include "porthole/render/test_scene.h"

namespace porthole {
namespace {

struct Point {
    Scene scene;
    View view = test::look_at({0, 0, 4}, {0, 0, 0}, 64, 64);
    Substance substance;
    SurfacePoint point;

    Point() {
        scene.materials = {test::matte({1, 1, 1})};
        test::add_part(scene, test::quad_mesh({-1, -1, 0}, {2, 0, 0}, {0, 2, 0}));
        substance.material = &scene.materials[0];
        substance.diffuse = {kLightest, kLightest, kLightest};
        substance.f0 = {0.04f, 0.04f, 0.04f};
        point.flat_normal = point.normal = {0, 0, 1};
    }
    [[nodiscard]] Vec3f light(Vec3f to_eye, const Reach& reach = {}) const {
        return shade(make_lighting(scene, view, {}), point, point.normal, to_eye, substance, reach, false).light;
    }
};

TEST(Shoulder, IsTheIdentityThenRisesWithoutReachingOne) {
    EXPECT_EQ(shoulder({0.1f, 0.5f, 0.7f}), (Vec3f{0.1f, 0.5f, 0.7f}));
    float last = 0.69f;
    for (float v = 0.7f; v < 100; v *= 1.1f) {
        const float s = shoulder({v, v, v}).x;
        EXPECT_GT(s, last);
        EXPECT_LT(s, 1.0f);
        last = s;
    }
    // No kink where it begins.
    EXPECT_NEAR((shoulder({0.701f, 0, 0}).x - 0.7f) / 0.001f, 1.0f, 0.01f);
    EXPECT_EQ(shoulder({-1, std::nanf(""), kInfinity}).x, 0.0f);
    EXPECT_LE(shoulder({-1, std::nanf(""), kInfinity}).z, 1.0f);
}

TEST(Shade, ShadowAndOcclusionTakeAwayWhatTheyShould) {
    const Point p;
    const Vec3f eye{0, 0, 1};
    const float open = p.light(eye).y, shadow = p.light(eye, {{0, 0, 0}, 1}).y, closed = p.light(eye, {{0, 0, 0}, 0}).y;
    // The key gives .6 of the albedo times its cosine, 1 / |(-.35, .5, 1)|.
    EXPECT_NEAR(open - shadow, 0.6f * 0.854f * kLightest, 0.04f);
    // Fill and ambient stay in part: nothing is ever black.
    EXPECT_LT(closed, 0.6f * shadow);
    EXPECT_GT(closed, 0.2f);
    // A coloured shadow takes away by channel.
    const Vec3f red = p.light(eye, {{1, 0, 0}, 1});
    EXPECT_NEAR(red.x, open, 1e-4f);
    EXPECT_NEAR(red.y, shadow, 1e-4f);
}

TEST(Shade, AMetalIsAboutAsBrightAsPaintAtAnyRoughness) {
    Point p;
    const float paint = p.light({0, 0, 1}).y;
    for (const float roughness : {0.3f, 0.6f, 1.0f}) {
        Point m;
        m.substance.diffuse = {0, 0, 0};
        m.substance.f0 = {0.9f, 0.9f, 0.9f};
        m.substance.roughness = roughness;
        const float metal = m.light({0, 0, 1}).y;
        EXPECT_GT(metal, 0.4f * paint) << roughness;
        EXPECT_LT(metal, 2.0f * paint) << roughness;
    }
}

TEST(Shade, UnlitIsShownAsItIs) {
    Point p;
    p.scene.materials[0].unlit = true;
    p.substance.color = {0.3f, 1.0f, 0.0f};
    const Shaded s =
        shade(make_lighting(p.scene, p.view, {}), p.point, p.point.normal, {0, 0, 1}, p.substance, {}, true);
    EXPECT_EQ(s.shown, p.substance.color);
    EXPECT_EQ(s.light, (Vec3f{0, 0, 0}));
}

TEST(Substance, KeepsAlbedoWithinWhatCanBeShown) {
    Scene s;
    s.materials = {test::matte({0, 0, 0}), test::matte({1, 1, 1})};
    test::add_part(s, test::quad_mesh({0, 0, 0}, {1, 0, 0}, {0, 1, 0}, 0));
    test::add_part(s, test::quad_mesh({0, 0, 0}, {1, 0, 0}, {0, 1, 0}, 1));
    const auto placements = make_placements(s);
    EXPECT_EQ(substance(s, placements[0], {PartId{0}, 0, 0.2f, 0.2f}).diffuse.x, kDarkest);
    EXPECT_EQ(substance(s, placements[1], {PartId{1}, 0, 0.2f, 0.2f}).diffuse.x, kLightest);
}

TEST(SurfacePoint, FacesTheViewerFromBothSidesAndInMirroredPlacements) {
    Scene s;
    s.materials = {test::matte({1, 1, 1})};
    test::add_part(s, test::quad_mesh({0, 0, 0}, {1, 0, 0}, {0, 1, 0})); // faces +z
    Part mirrored = s.parts[0];
    mirrored.world_from_mesh.x = {-2, 0, 0};
    s.parts.push_back(mirrored);
    const auto placements = make_placements(s);
    for (std::size_t i = 0; i < 2; ++i)
        for (const float side : {1.0f, -1.0f}) {
            const Vec3f direction = normalize(Vec3f{0.3f, 0.1f, -side});
            const SurfacePoint p = surface_point(placements[i], {PartId(std::uint32_t(i)), 0, 0.2f, 0.3f}, direction);
            EXPECT_LT(dot(p.flat_normal, direction), 0.0f);
            EXPECT_NEAR(p.flat_normal.z, side, 1e-6f);
            // A mirrored front is still the front.
            EXPECT_EQ(p.front, side > 0);
            EXPECT_GT(dot(p.start - p.position, p.flat_normal), 0.0f);
            EXPECT_LT(dot(p.beyond - p.position, p.flat_normal), 0.0f);
        }
}

TEST(SurfacePoint, SmoothNormalsFollowTheWindingWhateverTheirSign) {
    for (const float sign : {1.0f, -1.0f}) {
        Scene s;
        s.materials = {test::matte({1, 1, 1})};
        Mesh mesh = test::quad_mesh({0, 0, 0}, {1, 0, 0}, {0, 1, 0});
        mesh.normals.assign(4, normalize(Vec3f{0.3f, 0, 1}) * sign);
        test::add_part(s, mesh);
        const auto placements = make_placements(s);
        const SurfacePoint p = surface_point(placements[0], {PartId{0}, 0, 0.2f, 0.3f}, {0, 0, -1});
        EXPECT_NEAR(p.normal.x, 0.2873f, 1e-3f);
        EXPECT_GT(p.normal.z, 0.9f);
        // Seen from so low that the smooth normal would face away, it is bent to the viewer.
        const Vec3f low = normalize(Vec3f{1, 0, -0.05f});
        EXPECT_GE(dot(surface_point(placements[0], {PartId{0}, 0, 0.2f, 0.3f}, low).normal, -low), 0.0f);
    }
}

TEST(NormalMap, PointsTheWayTheGltfSpecSays) {
    // A map whose every texel leans towards +x (red) or +y (green, up in the picture).
    for (const bool tangents : {false, true})
        for (const bool green : {false, true}) {
            Scene s;
            s.materials = {test::matte({1, 1, 1})};
            s.images = {Image<Rgba8>(1, 1, green ? Rgba8{128, 218, 218, 255} : Rgba8{218, 128, 218, 255})};
            Texture texture;
            texture.image = 0;
            s.textures = {texture};
            s.materials[0].normal_texture.texture = 0;
            Mesh mesh = test::quad_mesh({0, 0, 0}, {1, 0, 0}, {0, 1, 0});
            mesh.uv[0] = {{0, 1}, {1, 1}, {1, 0}, {0, 0}}; // v runs down
            mesh.normals.assign(4, {0, 0, 1});
            if (tangents) mesh.tangents.assign(4, {1, 0, 0, 1});
            test::add_part(s, mesh);
            const auto placements = make_placements(s);
            const Hit hit{PartId{0}, 0, 0.2f, 0.3f};
            const Vec3f direction{0, 0, -1};
            const SurfacePoint p = surface_point(placements[0], hit, direction);
            const Vec3f n = mapped_normal(s, placements[0], hit, p, s.materials[0], direction);
            EXPECT_NEAR(green ? n.y : n.x, 0.707f, 0.02f) << tangents << green;
            EXPECT_NEAR(green ? n.x : n.y, 0.0f, 0.02f) << tangents << green;
        }
}

TEST(Lighting, ManyLampsAreLimitedAndHostileOnesDropped) {
    Scene s;
    s.materials = {test::matte({1, 1, 1})};
    test::add_part(s, test::quad_mesh({0, 0, 0}, {1, 0, 0}, {0, 1, 0}));
    for (int i = 0; i < 1000; ++i) {
        Light light;
        light.kind = Light::Kind::point;
        light.position = {float(i), 1, 1};
        light.intensity = i % 3 == 0 ? kInfinity : 1.0f;
        s.lights.push_back(light);
    }
    const View view = test::look_at({0, 0, 4}, {0, 0, 0}, 64, 64);
    const Lighting lighting = make_lighting(s, view, {});
    EXPECT_EQ(lighting.lamps.size(), 16u);
    for (const Lamp& lamp : lighting.lamps) EXPECT_TRUE(is_finite(lamp.strength));
    // Lights that give nothing leave the rig.
    s.lights.assign(1, Light{});
    s.lights[0].intensity = 0;
    EXPECT_EQ(make_lighting(s, view, {}).lamps.size(), 1u);
    EXPECT_EQ(make_lighting(s, view, {}).lamps[0].kind, Light::Kind::directional);
    EXPECT_EQ(make_lighting(s, view, {}).lamps[0].strength.x, 0.6f);
}

TEST(Lighting, AmbientReachFollowsTheTargetsWithinBounds) {
    Scene s;
    s.materials = {test::matte({1, 1, 1})};
    const PartId big = test::add_part(s, test::box_mesh({-5, -5, -5}, {5, 5, 5}));
    const PartId small = test::add_part(s, test::box_mesh({-2, -2, -2}, {2, 2, 2}));
    const PartId tiny = test::add_part(s, test::box_mesh({0, 0, 0}, {0.01f, 0.01f, 0.01f}));
    const View view = test::look_at({0, 0, 40}, {0, 0, 0}, 64, 64);
    const float scene = 5 * std::sqrt(3.0f);
    EXPECT_NEAR(make_lighting(s, view, {}).plain_radius, 0.12f * scene, 1e-4f);
    EXPECT_NEAR(make_lighting(s, view, std::vector{small}).hole_radius, 0.1f * scene, 1e-4f);
    EXPECT_NEAR(make_lighting(s, view, std::vector{tiny}).hole_radius, 0.02f * scene, 1e-4f);
    EXPECT_NEAR(make_lighting(s, view, std::vector{big}).hole_radius, 0.25f * scene, 1e-4f);
    // The plain picture does not know of targets.
    EXPECT_EQ(make_lighting(s, view, std::vector{small}).plain_radius, make_lighting(s, view, {}).plain_radius);
}

} // namespace
} // namespace porthole
