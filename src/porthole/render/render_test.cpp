#include "porthole/render/render.h"

#include <gtest/gtest.h>

#include "porthole/render/test_frame.h"
#include "porthole/render/test_scene.h"
#include "porthole/scene/texture.h"
#include "porthole/trace/visibility.h"

namespace porthole {
namespace {

using test::add_part;
using test::box_mesh;
using test::look_at;
using test::matte;
using test::quad_mesh;
using test::same_bits;
using test::same_color;
using test::sphere_mesh;

/// A floor, a wall, boxes and spheres of several materials, some of them glass.
Scene still_life() {
    Scene s;
    s.materials = {matte({0.8f, 0.8f, 0.8f}), matte({0.7f, 0.2f, 0.1f}), matte({0.9f, 0.9f, 0.9f}),
                   matte({0.5f, 0.9f, 0.6f}), matte({0.2f, 0.3f, 0.8f})};
    s.materials[2].metallic = 1, s.materials[2].roughness = 0.05f;
    s.materials[3].transmission = 1, s.materials[3].thickness = 0.1f, s.materials[3].roughness = 0;
    s.materials[4].alpha_mode = AlphaMode::blend, s.materials[4].base_color.w = 0.4f;
    add_part(s, quad_mesh({-3, 0, 3}, {6, 0, 0}, {0, 0, -6}, 0), "floor");
    add_part(s, box_mesh({-1, 0, -0.5f}, {-0.4f, 0.6f, 0.1f}, 1), "box");
    add_part(s, sphere_mesh({0.3f, 0.4f, -0.6f}, 0.4f, 24, 2), "metal");
    add_part(s, sphere_mesh({0.5f, 0.25f, 0.4f}, 0.25f, 24, 3), "glass");
    add_part(s, quad_mesh({-0.9f, 0.05f, 0.6f}, {0.8f, 0, 0}, {0, 0.7f, 0}, 4), "film");
    return s;
}

struct Built {
    Scene scene;
    MeshBvhs meshes;
    Bvh bvh;
    explicit Built(Scene s)
        : scene(padded(std::move(s))), meshes(build_mesh_bvhs(scene)), bvh(build_bvh(meshes, all_parts(scene))) {}
    /// A copied scene has lost the room that Embree wants behind the vertices.
    static Scene padded(Scene s) {
        for (Mesh& mesh : s.meshes) mesh.positions.reserve(mesh.positions.size() + 1);
        return s;
    }
    Built(const Built&) = delete;
    Built& operator=(const Built&) = delete;
    [[nodiscard]] Frame draw(const View& view, const RenderParams& params = {}, int threads = 2) const {
        Control control;
        control.threads = threads;
        return render(bvh, nullptr, view, params, nullptr, nullptr, control);
    }
};

TEST(Render, GivesTheSameBitsForAnyNumberOfThreads) {
    const Built b(still_life());
    const View view = look_at({0.4f, 1.2f, 3}, {0, 0.3f, 0}, 203, 151);
    const Frame one = b.draw(view, {}, 1);
    EXPECT_TRUE(same_bits(one, b.draw(view, {}, 2)));
    EXPECT_TRUE(same_bits(one, b.draw(view, {}, 7)));
    EXPECT_TRUE(same_bits(one, b.draw(view, {}, 1)));
}

TEST(Render, IdsAreThePlainIdBuffer) {
    const Built b(still_life());
    for (const bool orthographic : {false, true}) {
        View view = look_at({0.4f, 1.2f, 3}, {0, 0.3f, 0}, 203, 151);
        view.orthographic = orthographic;
        if (orthographic) view.half_height = 1;
        const Frame f = b.draw(view, {.refine = Refine::full});
        const IdBuffer ids = trace_ids(b.bvh, view, view.window());
        EXPECT_TRUE(f.ids == ids);
        // Where nothing is hit, nothing is drawn, unless an edge sample of the pixel hits.
        for (int y = 1; y < 150; ++y)
            for (int x = 1; x < 202; ++x) {
                bool none = true;
                for (int dy = -1; dy <= 1; ++dy)
                    for (int dx = -1; dx <= 1; ++dx) none &= ids.id(x + dx, y + dy) == kNoPart;
                EXPECT_TRUE(!none || same_color(f.color(x, y), {0, 0, 0, 0})) << x << ' ' << y;
            }
    }
}

TEST(Render, EveryValueIsADisplayColor) {
    const Built b(still_life());
    const Frame f = b.draw(look_at({0.4f, 1.2f, 3}, {0, 0.3f, 0}, 160, 120));
    for (const Vec4f& c : f.color.pixels())
        for (const float v : {c.x, c.y, c.z, c.w}) {
            ASSERT_GE(v, 0.0f);
            ASSERT_LE(v, 1.0f + 1e-5f);
        }
}

TEST(Render, MoreSamplesChangeOnlyPixelsAtEdges) {
    Scene s;
    s.materials = {matte({0.8f, 0.8f, 0.8f}), matte({0.1f, 0.2f, 0.7f})};
    add_part(s, quad_mesh({-4, -4, 0}, {8, 0, 0}, {0, 8, 0}, 0), "wall");
    add_part(s, box_mesh({-0.5f, -0.5f, 0.5f}, {0.5f, 0.5f, 0.6f}, 1), "box");
    const Built b(std::move(s));
    View view = look_at({0.02f, 0.05f, 6}, {0, 0, 0}, 128, 128, 0.3f);
    RenderParams one, many;
    one.refine = many.refine = Refine::full;
    one.samples = 1;
    const Frame coarse = b.draw(view, one), fine = b.draw(view, many);
    int changed = 0, partly = 0;
    for (int y = 1; y < 127; ++y)
        for (int x = 1; x < 127; ++x) {
            if (same_color(coarse.color(x, y), fine.color(x, y))) continue;
            ++changed;
            // A neighbour sees another part, or is lit differently.
            float difference = 0;
            bool other = false;
            for (const Vec2i d : {Vec2i{1, 0}, Vec2i{-1, 0}, Vec2i{0, 1}, Vec2i{0, -1}}) {
                other |= coarse.ids.id(x, y) != coarse.ids.id(x + d.x, y + d.y);
                difference = std::max(difference, std::abs(coarse.color(x, y).y - coarse.color(x + d.x, y + d.y).y));
            }
            EXPECT_TRUE(other || difference > 0.01f) << x << ' ' << y;
            partly += other;
        }
    EXPECT_GT(partly, 60); // the box's outline
    EXPECT_LT(changed, 128 * 128 / 8);
    EXPECT_GT(fine.rays.primary, coarse.rays.primary);
    EXPECT_LT(fine.rays.primary, coarse.rays.primary * 2);
}

TEST(Render, EdgeSamplesApproachTheCoverage) {
    // A black-on-nothing half plane through a pixel row at a slope: alpha is the covered share.
    Scene s;
    s.materials = {matte({0.5f, 0.5f, 0.5f})};
    add_part(s, quad_mesh({-5, -5, 0}, {10, 1, 0}, {0, 4.6f, 0}, 0), "half");
    const Built b(std::move(s));
    View view = look_at({0, 0, 5}, {0, 0, 0}, 64, 64);
    view.orthographic = true;
    view.half_height = 1;
    RenderParams params;
    params.samples = 64;
    const Frame f = b.draw(view, params), usual = b.draw(view);
    int partly = 0;
    double squares = 0;
    for (int y = 0; y < 64; ++y)
        for (int x = 0; x < 64; ++x) {
            // The upper edge: world y = -0.4 + (x + 5) / 10.
            double covered = 0;
            const int n = 32;
            for (int i = 0; i < n; ++i)
                for (int j = 0; j < n; ++j) {
                    const double wx = (x + (i + 0.5) / n - 32) / 32, wy = (32 - (y + (j + 0.5) / n)) / 32;
                    covered += wy < -0.4 + (wx + 5) / 10;
                }
            EXPECT_NEAR(double(f.color(x, y).w), covered / (n * n), 0.04) << x << ' ' << y;
            if (!(covered > 0 && covered < n * n)) continue;
            ++partly;
            const double error = double(usual.color(x, y).w) - covered / (n * n);
            squares += error * error;
        }
    EXPECT_GE(partly, 64);
    EXPECT_LT(std::sqrt(squares / partly), 0.04); // with the samples of a picture
}

/// Mean squared difference of what the screen shows, over white.
double squared_error(const Frame& a, const Frame& b) {
    double sum = 0;
    for (std::size_t i = 0; i < a.color.pixels().size(); ++i) {
        const Vec4f p = a.color.pixels()[i], q = b.color.pixels()[i];
        const auto shown = [](float v, float w) { return std::sqrt(std::max(0.0, double(v) + 1 - double(w))); };
        for (const double d :
             {shown(p.x, p.w) - shown(q.x, q.w), shown(p.y, p.w) - shown(q.y, q.w), shown(p.z, p.w) - shown(q.z, q.w)})
            sum += d * d;
    }
    return sum / (3 * double(a.color.pixels().size()));
}

TEST(Render, UniformSamplesAreInEveryPixel) {
    const Built b(still_life());
    const View view = look_at({0.4f, 1.2f, 3}, {0, 0.3f, 0}, 61, 47);
    RenderParams params;
    params.uniform = true;
    for (const int n : {1, 3, 16}) {
        params.samples = n;
        EXPECT_EQ(b.draw(view, params).rays.primary, std::int64_t(n) * 61 * 47);
    }
}

TEST(Render, SamplesAtEdgesAreAsGoodAsSamplesEverywhere) {
    // Without mirrors and glass: what is lit in them depends on the sample, not only on where it lies.
    Scene s = still_life();
    for (const std::size_t m : {2u, 3u, 4u}) s.materials[m] = matte({0.2f, 0.3f, 0.8f});
    const Built b(std::move(s));
    const View view = look_at({0.4f, 1.2f, 3}, {0, 0.3f, 0}, 203, 151);
    RenderParams reference, everywhere, edges;
    reference.samples = 256, everywhere.samples = 16;
    reference.uniform = everywhere.uniform = true;
    edges.refine = Refine::full;
    edges.samples = 32;
    const Frame best = b.draw(view, reference), all = b.draw(view, everywhere), some = b.draw(view, edges);
    // Within half a decibel, for a quarter of the camera rays.
    EXPECT_LT(squared_error(some, best), 1.122 * squared_error(all, best));
    EXPECT_LT(some.rays.primary, all.rays.primary / 4);
    // More samples are better.
    edges.samples = 8;
    EXPECT_GT(squared_error(b.draw(view, edges), best), 2 * squared_error(some, best));
}

TEST(Render, TexturesSeenSmallAreFiltered) {
    // A chequered floor to the horizon, and its image in a wall.
    Scene s;
    s.materials = {matte({1, 1, 1}), matte({1, 1, 1})};
    s.materials[0].unlit = true;
    s.materials[0].base_color_texture.texture = 0;
    s.materials[1].metallic = 1, s.materials[1].roughness = 0;
    Image<Rgba8> image(256, 256);
    for (int y = 0; y < 256; ++y)
        for (int x = 0; x < 256; ++x)
            image(x, y) = (x / 8 + y / 8) % 2 ? Rgba8{240, 240, 240, 255} : Rgba8{20, 20, 60, 255};
    s.images = {image};
    Texture texture;
    texture.image = 0;
    s.textures = {texture};
    add_part(s, quad_mesh({-20, 0, 20}, {40, 0, 0}, {0, 0, -40}, 0), "floor");
    add_part(s, quad_mesh({0.2f, 0, -20}, {0, 0, 40}, {0, 3, 0}, 1), "wall");
    const View view = look_at({-1, 1, 21}, {-0.5f, 0.2f, 0}, 128, 96, 0.4f);
    RenderParams one, many;
    one.samples = 1;
    many.samples = 128, many.uniform = true;
    const Built plain(s);
    build_mips(s);
    const Built filtered(std::move(s));
    const Frame truth = plain.draw(view, many);
    EXPECT_LT(squared_error(filtered.draw(view, one), truth), squared_error(plain.draw(view, one), truth) / 4);
    // It then needs few samples of its own, and the horizon does not swim.
    EXPECT_LT(filtered.draw(view).rays.primary, plain.draw(view).rays.primary);
}

TEST(Render, FilteringDoesNotChangeWhoIsHit) {
    Scene s;
    s.materials = {matte({0.2f, 0.3f, 0.8f}), matte({0.8f, 0.1f, 0.1f})};
    s.materials[0].alpha_mode = AlphaMode::mask;
    s.materials[0].base_color_texture.texture = 0;
    Image<Rgba8> image(256, 256);
    for (int y = 0; y < 256; ++y)
        for (int x = 0; x < 256; ++x) image(x, y) = {200, 200, 200, std::uint8_t((x / 3 + y / 3) % 2 ? 255 : 0)};
    s.images = {image};
    Texture texture;
    texture.image = 0;
    s.textures = {texture};
    add_part(s, quad_mesh({-1, -1, 0}, {2, 0, 0}, {0, 2, 0}, 0), "leaf");
    add_part(s, quad_mesh({-2, -2, -1}, {4, 0, 0}, {0, 4, 0}, 1), "wall");
    const View view = look_at({0, 0, 4}, {0, 0, 0}, 96, 64, 0.3f);
    const Built plain(s);
    build_mips(s);
    const Built filtered(std::move(s));
    EXPECT_EQ(filtered.draw(view).ids, plain.draw(view).ids);
}

TEST(Render, AMirrorShowsWhatStandsBeforeIt) {
    // A mirror at 45 degrees in front of the camera shows a red panel that stands to the side.
    Scene s;
    s.materials = {matte({1, 1, 1}), matte({0.85f, 0.03f, 0.03f})};
    s.materials[0].metallic = 1, s.materials[0].roughness = 0;
    add_part(s, quad_mesh({-1, -1, 1}, {2, 0, -2}, {0, 2, 0}, 0), "mirror"); // in the plane x + z = 0
    add_part(s, quad_mesh({6, -0.5f, -0.5f}, {0, 0, 1}, {0, 1, 0}, 1), "panel");
    const Built b(std::move(s));
    const View view = look_at({0, 0, 4}, {0, 0, 0}, 96, 96, 0.3f);
    const Frame f = b.draw(view);
    int red = 0, wrong = 0;
    for (int y = 0; y < 96; ++y)
        for (int x = 0; x < 96; ++x) {
            if (f.ids.id(x, y) != PartId{0}) continue;
            const Ray ray = view.ray(float(x) + 0.5f, float(y) + 0.5f);
            const float t = -(ray.origin.x + ray.origin.z) / (ray.direction.x + ray.direction.z);
            const Vec3f p = ray.origin + ray.direction * t;
            const Vec3f mirrored{-ray.direction.z, ray.direction.y, -ray.direction.x};
            const Vec3f q = p + mirrored * ((6 - p.x) / mirrored.x);
            const bool inside = std::abs(q.y) < 0.45f && std::abs(q.z) < 0.45f;
            const bool outside = std::abs(q.y) > 0.55f || std::abs(q.z) > 0.55f;
            const bool looks_red = f.color(x, y).x > 3 * f.color(x, y).y;
            red += looks_red;
            wrong += (inside && !looks_red) || (outside && looks_red);
        }
    EXPECT_EQ(wrong, 0);
    EXPECT_GT(red, 100);
    EXPECT_GT(f.rays.reflection, 1000);
}

TEST(Render, BlendedSurfacesAreLaidOverWhatIsBehind) {
    const auto picture = [](float alpha, bool behind, bool film) {
        Scene s;
        s.materials = {matte({0.2f, 0.3f, 0.8f}), matte({0.8f, 0.1f, 0.1f})};
        s.materials[0].alpha_mode = AlphaMode::blend;
        s.materials[0].base_color.w = alpha;
        // Unlit, so that the numbers can be written down.
        s.materials[0].unlit = s.materials[1].unlit = true;
        if (film) add_part(s, quad_mesh({-1, -1, 0}, {2, 0, 0}, {0, 2, 0}, 0), "film");
        if (behind) add_part(s, quad_mesh({-2, -2, -1}, {4, 0, 0}, {0, 4, 0}, 1), "wall");
        return Built(std::move(s)).draw(look_at({0, 0, 4}, {0, 0, 0}, 16, 16, 0.1f)).color(8, 8);
    };
    const Vec4f over = picture(0.25f, true, true);
    EXPECT_NEAR(over.x, 0.25f * 0.2f + 0.75f * 0.8f, 1e-5f);
    EXPECT_NEAR(over.z, 0.25f * 0.8f + 0.75f * 0.1f, 1e-5f);
    EXPECT_NEAR(over.w, 1.0f, 1e-6f);
    const Vec4f alone = picture(0.25f, false, true);
    EXPECT_NEAR(alone.x, 0.25f * 0.2f, 1e-5f);
    EXPECT_NEAR(alone.w, 0.25f, 1e-6f);
}

TEST(Render, ColouredGlassCastsAColouredShadow) {
    const auto floor_color = [](int kind) {
        Scene s;
        s.materials = {matte({0.8f, 0.8f, 0.8f}), matte({1, 0.1f, 0.1f})};
        if (kind == 2) s.materials[1].transmission = 1;
        add_part(s, quad_mesh({-20, 0, 20}, {40, 0, 0}, {0, 0, -40}, 0), "floor");
        // A pane large enough for the key, out of the camera's sight, above the point looked at.
        if (kind > 0) add_part(s, quad_mesh({-8, 6, 8}, {16, 0, 0}, {0, 0, -16}, 1), "pane");
        RenderParams params;
        params.ao_samples = 0;
        return Built(std::move(s)).draw(look_at({0, 2, 3}, {0, 0, 0}, 16, 16, 0.05f), params).color(8, 8);
    };
    const Vec4f open = floor_color(0), shadow = floor_color(1), tinted = floor_color(2);
    EXPECT_LT(shadow.x, 0.8f * open.x);
    EXPECT_NEAR(shadow.x, shadow.y, 0.02f);
    // Red passes, green does not.
    EXPECT_GT(tinted.x, shadow.x + 0.8f * (open.x - shadow.x));
    EXPECT_LT(tinted.y, shadow.y + 0.2f * (open.y - shadow.y));
}

TEST(Render, AmbientOcclusionReachesNoFartherThanItsRadius) {
    // A plate above a floor, twice; the scene's size, which sets the radius, stays the same.
    const auto brightness = [](float height) {
        Scene s;
        s.materials = {matte({0.8f, 0.8f, 0.8f})};
        add_part(s, quad_mesh({-10, 0, 10}, {20, 0, 0}, {0, 0, -20}, 0), "floor");
        add_part(s, box_mesh({-2, height, -2}, {2, height + 0.01f, 2}, 0), "plate");
        RenderParams params;
        params.shadows = false;
        return Built(std::move(s)).draw(look_at({0, 0.2f, 1.9f}, {0, 0, 0}, 16, 16, 0.05f), params).color(8, 8).y;
    };
    // Radius 12 % of 14.1 = 1.7.
    EXPECT_LT(brightness(0.5f), 0.9f * brightness(6.0f));
    EXPECT_EQ(brightness(3.0f), brightness(6.0f));
}

TEST(Render, AFlatPictureHasNeitherShadowNorLight) {
    const Built b(still_life());
    RenderParams params;
    params.shading = Shading::flat;
    params.samples = 1;
    const View view = look_at({0, 0.3f, 4}, {0, 0.3f, 0}, 64, 64);
    const Frame f = b.draw(view, params);
    EXPECT_EQ(f.rays.shadow + f.rays.ambient + f.rays.reflection + f.rays.refraction, 0);
    int film = 0;
    for (int y = 0; y < 64; ++y)
        for (int x = 0; x < 64; ++x) {
            if (f.ids.id(x, y) != PartId{4}) continue;
            ++film;
            // It faces +z: colour times the cosine to the viewer, opaque as ids are.
            const float facing = -view.ray(float(x) + 0.5f, float(y) + 0.5f).direction.z;
            EXPECT_NEAR(f.color(x, y).x, 0.2f * facing, 1e-4f);
            EXPECT_NEAR(f.color(x, y).z, 0.8f * facing, 1e-4f);
            EXPECT_EQ(f.color(x, y).w, 1.0f);
        }
    EXPECT_GT(film, 50);
}

TEST(Render, AWhiteWallFacingTheViewerStaysBelowClipping) {
    Scene s;
    s.materials = {matte({1, 1, 1})};
    add_part(s, quad_mesh({-2, -2, 0}, {4, 0, 0}, {0, 4, 0}, 0), "wall");
    const Vec4f c = Built(std::move(s)).draw(look_at({0, 0, 4}, {0, 0, 0}, 16, 16, 0.1f)).color(8, 8);
    EXPECT_GT(c.y, 0.75f);
    EXPECT_LT(c.y, 0.95f);
}

TEST(Render, BadParametersAreNamed) {
    const Built b(still_life());
    const View view = look_at({0, 0, 4}, {0, 0, 0}, 8, 8);
    RenderParams params;
    params.samples = 0;
    try {
        (void)b.draw(view, params);
        FAIL();
    } catch (const Error& e) {
        EXPECT_EQ(e.code, "E0140");
        EXPECT_EQ(e.where, "samples");
        EXPECT_EQ(e.kind, ErrorKind::usage);
    }
}

TEST(Render, StopsWhenAsked) {
    const Built b(still_life());
    std::stop_source source;
    Control control;
    control.stop = source.get_token();
    control.threads = 2;
    double last = 0;
    control.progress = [&](std::string_view stage, double share) {
        EXPECT_EQ(stage, "render");
        last = share;
        source.request_stop();
    };
    control.threads = 1;
    EXPECT_THROW((void)render(b.bvh, nullptr, look_at({0, 1, 4}, {0, 0, 0}, 512, 512), {.refine = Refine::full},
                              nullptr, nullptr, control),
                 Cancelled);
    EXPECT_LT(last, 0.3);
}

TEST(Render, AnEmptySceneGivesAnEmptyPicture) {
    const Built b(Scene{});
    const Frame f = b.draw(look_at({0, 0, 4}, {0, 0, 0}, 20, 10));
    ASSERT_EQ(f.color.pixels().size(), 200u);
    for (const Vec4f& c : f.color.pixels()) EXPECT_TRUE(same_color(c, {0, 0, 0, 0}));
    for (const PartId id : f.ids.id.pixels()) EXPECT_EQ(id, kNoPart);
}

TEST(Render, MaskedTexelsArePassedThrough) {
    Scene s;
    s.materials = {matte({0.2f, 0.3f, 0.8f}), matte({0.8f, 0.1f, 0.1f})};
    s.materials[0].unlit = s.materials[1].unlit = true;
    s.materials[0].alpha_mode = AlphaMode::mask;
    s.materials[0].base_color_texture.texture = 0;
    Image<Rgba8> holes(2, 1, Rgba8{255, 255, 255, 255});
    holes(1, 0).a = 0;
    s.images = {holes};
    Texture texture;
    texture.image = 0, texture.nearest = true;
    s.textures = {texture};
    add_part(s, quad_mesh({-1, -1, 0}, {2, 0, 0}, {0, 2, 0}, 0), "leaf");
    add_part(s, quad_mesh({-2, -2, -1}, {4, 0, 0}, {0, 4, 0}, 1), "wall");
    const Frame f = Built(std::move(s)).draw(look_at({0, 0, 4}, {0, 0, 0}, 32, 32, 0.1f));
    EXPECT_EQ(f.ids.id(8, 16), PartId{0});
    EXPECT_EQ(f.ids.id(24, 16), PartId{1});
    EXPECT_NEAR(f.color(8, 16).z, 0.8f, 1e-5f);
    EXPECT_NEAR(f.color(24, 16).x, 0.8f, 1e-5f);
}

TEST(Render, TheFilesLightsReplaceTheKeyAtTheSameBrightness) {
    const auto wall = [](float intensity, Vec3f from) {
        Scene s;
        s.materials = {matte({0.6f, 0.6f, 0.6f})};
        add_part(s, quad_mesh({-2, -2, 0}, {4, 0, 0}, {0, 4, 0}, 0), "wall");
        if (intensity > 0) {
            Light light;
            light.kind = Light::Kind::point;
            light.position = from;
            light.intensity = intensity;
            s.lights = {light};
        }
        RenderParams params;
        params.ao_samples = 0;
        return Built(std::move(s)).draw(look_at({0, 0, 4}, {0, 0, 0}, 33, 33, 0.4f), params).color;
    };
    const auto rig = wall(0, {}), dim = wall(1e-3f, {0, 0, 3}), bright = wall(1e6f, {0, 0, 3});
    // Whatever its strength, and about as bright as the rig.
    EXPECT_NEAR(dim(16, 16).y, bright(16, 16).y, 1e-4f);
    EXPECT_NEAR(dim(16, 16).y, rig(16, 16).y, 0.12f);
    // It falls off to the sides, which the rig does not.
    EXPECT_GT(dim(16, 16).y, dim(1, 16).y + 0.02f);
    // From one side, that side is brighter.
    const auto left = wall(5, {-1.5f, 0, 1});
    EXPECT_GT(left(4, 16).y, left(28, 16).y + 0.05f);
}

TEST(Render, AMirroredPartIsLitAsItsTwinIsInAMirror) {
    // A bump whose normals matter: a sphere in a mirrored and in a plain placement.
    Scene s;
    s.materials = {matte({0.7f, 0.7f, 0.7f})};
    s.materials[0].roughness = 0.4f;
    const PartId plain = add_part(s, sphere_mesh({0, 0, 0}, 0.5f, 32, 0), "plain");
    Part twin = s.parts[index(plain)];
    twin.path = "twin";
    twin.world_from_mesh = {{-1, 0, 0}, {0, 1, 0}, {0, 0, 1}, {0, 0, 0}};
    Scene mirrored = s;
    mirrored.parts[0] = twin;
    const View view = look_at({0, 0, 4}, {0, 0, 0}, 64, 64, 0.15f);
    const Frame a = Built(std::move(s)).draw(view), b = Built(std::move(mirrored)).draw(view);
    // The sphere is symmetric, so both pictures show the same, lit from the same side.
    for (int y = 0; y < 64; ++y)
        for (int x = 0; x < 64; ++x) EXPECT_NEAR(a.color(x, y).y, b.color(x, y).y, 0.03f) << x << ' ' << y;
    EXPECT_GT(a.color(20, 16).y, a.color(44, 48).y + 0.1f);
}

TEST(Render, GlassBendsWhatIsSeenThroughIt) {
    // A slab of glass seen aslant shifts what stands behind it by what Snell's law says.
    const auto edge = [](float thickness) {
        Scene s;
        s.materials = {matte({1, 1, 1}), matte({0.8f, 0.1f, 0.1f}), matte({0.1f, 0.1f, 0.8f})};
        s.materials[0].transmission = 1, s.materials[0].roughness = 0, s.materials[0].ior = 1.5f;
        s.materials[0].thickness = thickness;
        s.materials[1].unlit = s.materials[2].unlit = true;
        add_part(s, box_mesh({-3, -3, 0}, {3, 3, 0.5f}, 0), "slab");
        add_part(s, quad_mesh({-9, -9, -1}, {9, 0, 0}, {0, 18, 0}, 1), "left");
        add_part(s, quad_mesh({0, -9, -1}, {9, 0, 0}, {0, 18, 0}, 2), "right");
        // 45 degrees, orthographic: every ray has the same angle.
        View view = look_at({3, 0, 3}, {0, 0, 0}, 400, 8);
        view.orthographic = true;
        view.half_height = 0.02f;
        RenderParams params;
        params.samples = 1;
        const Frame f = Built(std::move(s)).draw(view, params);
        for (int x = 0; x < 400; ++x)
            if (f.color(x, 4).z > f.color(x, 4).x) return (float(x) - 200) * view.pixel_scale();
        return -1.0f;
    };
    // With a thickness the slab refracts; the border x = 0 at z = -1 is seen sideways by 1 / sqrt 2, less
    // the slab's shift d sin(a) (1 - cos(a) / sqrt(n^2 - sin(a)^2)).
    const float sin_a = std::sqrt(0.5f);
    const float shift = 0.5f * sin_a * (1 - sin_a / std::sqrt(2.25f - 0.5f));
    const float straight = 1 / std::sqrt(2.0f);
    EXPECT_NEAR(edge(0.5f), straight - shift, 0.006f);
    EXPECT_NEAR(edge(0.0f), straight, 0.006f); // without one glTF means a thin sheet
}

} // namespace
} // namespace porthole
