#include "porthole/render/filter.h"

#include <gtest/gtest.h>

#include "porthole/render/emphasis.h"
#include "porthole/render/test_scene.h"

namespace porthole {
namespace {

/// Pixels that look straight at a plane 2 m away; each has traced its own part of the pattern.
struct Wall {
    View view = test::look_at({0, 0, 2}, {0, 0, 0}, 64, 64);
    GBuffer buffer{Rect{0, 0, 64, 64}};

    Wall() {
        for (int y = 0; y < 64; ++y)
            for (int x = 0; x < 64; ++x) {
                Pixel& pixel = buffer.pixels(x, y);
                pixel.flags = Pixel::traced;
                pixel.normal = pack_normal({0, 0, 1});
                // As different as can be from pixel to pixel; means: .5 of the ambient, 119.5 of 255.
                pixel.ambient_all = 1000;
                pixel.ambient_open = std::uint16_t(cell_rank(x, y) % 2 * 1000);
                for (auto& lamp : pixel.lamps) lamp = std::uint8_t(cell_rank(x, y) * 16 - (cell_rank(x, y) > 0));
                buffer.ids.id(x, y) = PartId{0};
                buffer.ids.depth(x, y) = 2;
            }
    }
    [[nodiscard]] std::unique_ptr<FilteredTile> filtered() const {
        auto tile = std::make_unique<FilteredTile>();
        filter_tile(buffer, view, buffer.window(), *tile);
        return tile;
    }
};

TEST(PackedNormal, KeepsItsDirection) {
    for (int i = 0; i < 500; ++i) {
        const float z = -1 + 2 * (float(i) + 0.5f) / 500, phi = float(i) * 2.4f, r = std::sqrt(1 - z * z);
        const Vec3f n{r * std::cos(phi), r * std::sin(phi), z};
        EXPECT_GT(dot(unpack_normal(pack_normal(n)), n), 0.99999f);
    }
    for (const Vec3f n : {Vec3f{0, 0, 1}, Vec3f{0, 0, -1}, Vec3f{1, 0, 0}, Vec3f{0, -1, 0}})
        EXPECT_NEAR(length(unpack_normal(pack_normal(n)) - n), 0.0f, 1e-4f);
}

TEST(Filter, LeavesNoGrainOnASurfaceWithoutEdges) {
    const Wall wall;
    const auto tile = wall.filtered();
    const Reach middle = tile->reach(30, 30);
    EXPECT_NEAR(middle.ambient, 0.5f, 1e-5f);
    for (int y = 2; y < 62; ++y)
        for (int x = 2; x < 62; ++x) {
            EXPECT_NEAR(tile->reach(x, y).ambient, middle.ambient, 1e-5f);
            EXPECT_NEAR(tile->reach(x, y).lamps.y, middle.lamps.y, 1e-5f);
        }
}

TEST(Filter, DoesNotCrossPartsRimsCreasesOrSteps) {
    enum Kind { part, rim, crease, step };
    for (const Kind kind : {part, rim, crease, step}) {
        Wall wall;
        for (int y = 0; y < 64; ++y)
            for (int x = 0; x < 64; ++x) {
                Pixel& pixel = wall.buffer.pixels(x, y);
                pixel.ambient_open = x < 32 ? 0 : 1000;
                if (x < 32) continue;
                if (kind == part) wall.buffer.ids.id(x, y) = PartId{1};
                if (kind == rim) pixel.flags |= Pixel::in_hole;
                if (kind == crease) pixel.normal = pack_normal(normalize(Vec3f{1, 0, 1}));
                if (kind == step) wall.buffer.ids.depth(x, y) = 2.2f;
            }
        const auto tile = wall.filtered();
        EXPECT_EQ(tile->reach(31, 30).ambient, 0.0f) << kind;
        EXPECT_EQ(tile->reach(32, 30).ambient, 1.0f) << kind;
    }
}

TEST(Filter, KeepsColouredShadows) {
    Wall wall;
    const Rect w = wall.buffer.window();
    for (int y = w.y0; y < w.y1; ++y)
        for (int x = w.x0; x < w.x1; ++x) {
            Pixel& pixel = wall.buffer.pixels(x, y);
            pixel.lamps[0] = 255, pixel.lamps[1] = 51, pixel.lamps[2] = 0;
        }
    const Vec3f lamps = wall.filtered()->reach(20, 20).lamps;
    EXPECT_NEAR(lamps.x, 1.0f, 1e-5f);
    EXPECT_NEAR(lamps.y, 0.2f, 1e-5f);
    EXPECT_NEAR(lamps.z, 0.0f, 1e-5f);
}

/// A wall of one colour with a target in its middle.
struct Window {
    Scene scene;
    GBuffer buffer{Rect{0, 0, 64, 64}};

    Window(Vec3f around, Vec3f target, int target_width) {
        scene.materials = {test::matte(around), test::matte(target)};
        test::add_part(scene, test::quad_mesh({0, 0, 0}, {1, 0, 0}, {0, 1, 0}, 0));
        test::add_part(scene, test::quad_mesh({0, 0, 0}, {1, 0, 0}, {0, 1, 0}, 1));
        for (int y = 0; y < 64; ++y)
            for (int x = 0; x < 64; ++x) {
                const bool on_target = x >= 30 && x < 30 + target_width;
                buffer.ids.id(x, y) = PartId{on_target ? 1u : 0u};
                buffer.pixels(x, y).flags = std::uint8_t(on_target ? Pixel::on_target | Pixel::in_hole : 0);
            }
    }
    [[nodiscard]] Tint tint() const { return target_tints(scene, make_placements(scene), buffer, Emphasis::accent)[1]; }
};

TEST(Emphasis, ADistinctTargetKeepsItsColour) {
    EXPECT_EQ(Window({0.6f, 0.6f, 0.6f}, {0.1f, 0.7f, 0.7f}, 10).tint().kind, Tint::Kind::saturate);
}

TEST(Emphasis, GreyInGreyGetsTheAccent) {
    const Tint tint = Window({0.7f, 0.7f, 0.7f}, {0.5f, 0.5f, 0.5f}, 10).tint();
    EXPECT_EQ(tint.kind, Tint::Kind::accent);
    EXPECT_GT(tint.accent.x, tint.accent.z); // orange
}

TEST(Emphasis, OrangeInOrangeGetsAzure) {
    const Tint tint = Window({0.8f, 0.3f, 0.05f}, {0.7f, 0.3f, 0.08f}, 10).tint();
    EXPECT_EQ(tint.kind, Tint::Kind::accent);
    EXPECT_GT(tint.accent.z, tint.accent.x);
}

TEST(Emphasis, AThinTargetGetsTheAccentWhateverItsColour) {
    EXPECT_EQ(Window({0.6f, 0.6f, 0.6f}, {0.1f, 0.7f, 0.7f}, 2).tint().kind, Tint::Kind::accent);
}

} // namespace
} // namespace porthole
