#include "porthole/render/lines.h"

#include <gtest/gtest.h>

#include <numbers>

#include "porthole/render/render.h"
#include "porthole/render/test_scene.h"

namespace porthole {
namespace {

using test::add_part;
using test::box_mesh;
using test::look_at;
using test::matte;
using test::quad_mesh;
using test::sphere_mesh;

constexpr double kPiD = std::numbers::pi;

/// Ink over a whole picture, tile by tile as draw_lines() does it.
Image<float> line_picture(const Scene& scene, const View& view, const LineRules& rules, int tile_px = 64) {
    const MeshBvhs meshes = build_mesh_bvhs(scene);
    const Bvh bvh = build_bvh(meshes, all_parts(scene));
    const std::vector<Placement> placements = make_placements(scene);
    RayCounts rays;
    const LineTrace trace = plain_trace(bvh, view, placements, rays);
    Image<float> picture(view.window());
    for (int y0 = 0; y0 < view.height; y0 += tile_px)
        for (int x0 = 0; x0 < view.width; x0 += tile_px) {
            const Rect tile = Rect{x0, y0, x0 + tile_px, y0 + tile_px}.intersected(view.window());
            LineInk ink(tile);
            find_lines(
                view, tile, [](int, int) { return true; }, trace, rules, ink);
            for (int y = tile.y0; y < tile.y1; ++y)
                for (int x = tile.x0; x < tile.x1; ++x) picture(x, y) = ink.open.darkness(x, y);
        }
    return picture;
}

LineRules rules_of(float half_width, float outline, float crease, float step = 0, float part = 0) {
    LineRules rules;
    rules.half_width = half_width;
    rules.outline = outline, rules.crease = crease, rules.step = step, rules.part = part;
    return rules;
}

// Ink of a row: how much, and its centre of gravity.
struct RowInk {
    double sum = 0, at = 0;
};
RowInk row_ink(const Image<float>& picture, int y, int x0, int x1) {
    RowInk ink;
    for (int x = x0; x < x1; ++x) {
        ink.sum += double(picture(x, y));
        ink.at += double(picture(x, y)) * (x + 0.5);
    }
    ink.at /= ink.sum;
    return ink;
}

/// A vertical band of constant ink as pixels see it. Their centre of gravity is not the band's
/// unless it is whole pixels wide.
RowInk band_ink(double middle, double half_width) {
    RowInk ink;
    for (int x = int(middle - half_width) - 1; x <= int(middle + half_width) + 1; ++x) {
        const double covered = std::min(x + 1.0, middle + half_width) - std::max(double(x), middle - half_width);
        ink.sum += std::max(covered, 0.0);
        ink.at += std::max(covered, 0.0) * (x + 0.5);
    }
    ink.at /= ink.sum;
    return ink;
}

TEST(Ink, AStraightStrokeIsAsWideAsAskedInEveryRow) {
    for (const double degrees : {90.0, 89.0, 80.0, 63.0, 50.0})
        for (const float width : {0.75f, 1.0f, 1.5f, 3.0f}) {
            const double angle = degrees * kPiD / 180;
            const Vec2f middle{32.3f, 32.1f}, along{float(std::cos(angle)), float(std::sin(angle))};
            Ink ink(Rect{0, 0, 64, 64});
            ink.add({middle - along * 60.0f, middle + along * 60.0f, 0.5f * width});
            for (int y = 16; y < 48; ++y) {
                double sum = 0;
                for (int x = 0; x < 64; ++x) sum += double(ink.darkness(x, y));
                EXPECT_NEAR(sum, double(width) / std::sin(angle), 0.025 * double(width))
                    << degrees << ' ' << width << ' ' << y;
            }
        }
}

TEST(Ink, AChainOfStrokesIsOneLine) {
    Ink whole(Rect{0, 0, 64, 64}), chain(Rect{0, 0, 64, 64});
    const Vec2f a{3.2f, 7.7f}, b{60.1f, 41.3f};
    whole.add({a, b, 0.6f, 0.8f, 0.8f});
    for (int i = 0; i < 100; ++i)
        chain.add({a + (b - a) * (float(i) / 100), a + (b - a) * (float(i + 1) / 100), 0.6f, 0.8f, 0.8f});
    for (int y = 0; y < 64; ++y)
        for (int x = 0; x < 64; ++x) EXPECT_NEAR(whole.darkness(x, y), chain.darkness(x, y), 1e-4f) << x << ' ' << y;
}

TEST(Ink, DashesGoOnFromPieceToPiece) {
    Ink whole(Rect{0, 0, 128, 64}), chain(Rect{0, 0, 128, 64});
    const Vec2f a{5, 7}, b{120, 51};
    whole.add_dashed({a, b, 0.5f}, 6);
    for (int i = 0; i < 50; ++i)
        chain.add_dashed({a + (b - a) * (float(i) / 50), a + (b - a) * (float(i + 1) / 50), 0.5f}, 6);
    double inked = 0, different = 0;
    for (int y = 0; y < 64; ++y)
        for (int x = 0; x < 128; ++x) {
            inked += double(whole.darkness(x, y));
            different += double(std::abs(whole.darkness(x, y) - chain.darkness(x, y)));
        }
    // Three fifths of the length, and the round ends of some twelve dashes.
    const double length = double(std::hypot(b.x - a.x, b.y - a.y));
    EXPECT_NEAR(inked, 0.6 * length + 12 * kPiD / 4, 0.06 * length);
    EXPECT_LT(different, 0.02 * inked);
}

// A cube that stands on an edge towards the viewer.
struct Cube {
    Scene scene;
    View view;
    explicit Cube(float tilt) {
        scene.materials = {matte({0.7f, 0.7f, 0.7f})};
        add_part(scene, box_mesh({-1, -1, -1}, {1, 1, 1}), "cube");
        view = look_at({4, tilt, 3.1f}, {0, 0, 0}, 200, 160, 0.45f);
    }
};

TEST(Lines, ACreaseLiesWhereTheEdgeIsAndIsEven) {
    for (const float tilt : {0.0f, 0.9f, 1.7f}) {
        const Cube cube(tilt);
        const PixelPoint top = cube.view.project({1, 1, 1}), bottom = cube.view.project({1, -1, 1});
        ASSERT_LT(top.y + 8, bottom.y - 8);
        const double slope = double((bottom.x - top.x) / (bottom.y - top.y));
        for (const float half_width : {0.5f, 0.75f, 1.5f}) {
            const Image<float> picture = line_picture(cube.scene, cube.view, rules_of(half_width, 0, 0.8f));
            for (int y = int(top.y) + 8; y < int(bottom.y) - 8; ++y) {
                const double x = double(top.x) + slope * (y + 0.5 - double(top.y));
                const RowInk ink = row_ink(picture, y, int(x) - 10, int(x) + 10);
                const double width = 2 * double(half_width) * std::sqrt(1 + slope * slope);
                EXPECT_NEAR(ink.at, band_ink(x, 0.5 * width).at, 0.05) << y;
                EXPECT_NEAR(ink.sum, 0.8 * width, 0.03 * 0.8 * width) << y;
            }
        }
    }
}

TEST(Lines, AnOutlineIsEvenAllAround) {
    Scene scene;
    scene.materials = {matte({0.7f, 0.7f, 0.7f})};
    add_part(scene, sphere_mesh({0, 0, 0}, 1, 96), "ball");
    const View view = look_at({0, 0, 6}, {0, 0, 0}, 160, 160, 0.25f);
    const Image<float> picture = line_picture(scene, view, rules_of(0.75f, 1, 0));
    // Ink of a ring by direction: no beads, no gaps.
    constexpr int kSectors = 72;
    std::array<double, kSectors> ink{};
    double radius = 0, sum = 0;
    for (int y = 0; y < 160; ++y)
        for (int x = 0; x < 160; ++x) {
            const double dx = x + 0.5 - 80, dy = y + 0.5 - 80, d = double(picture(x, y));
            if (d == 0) continue;
            // Spread over neighbouring sectors as the pixel does.
            const double r = std::hypot(dx, dy);
            radius += r * d, sum += d;
            for (int i = 0; i < 64; ++i) {
                const double px = dx + (i % 8 - 3.5) / 8, py = dy + (i / 8 - 3.5) / 8;
                const double turn = (std::atan2(py, px) + kPiD) / (2 * kPiD);
                ink[std::size_t(std::min(kSectors - 1, int(turn * kSectors)))] += d / 64;
            }
        }
    radius /= sum;
    // The ball's outline: tan of half its angle, over that of half the view.
    EXPECT_NEAR(radius, 80 * std::tan(std::asin(1.0 / 6)) / 0.25, 0.2);
    for (const double d : ink) EXPECT_NEAR(d, 1.5 * 2 * kPiD * radius / kSectors, 0.06 * sum / kSectors);
}

TEST(Lines, TilesFitTogetherBitForBit) {
    Cube cube(1.3f);
    add_part(cube.scene, sphere_mesh({1, 1, 1}, 0.5f, 24), "ball");
    const LineRules rules = rules_of(0.75f, 0.8f, 0.6f, 0.5f, 0.4f);
    const Image<float> a = line_picture(cube.scene, cube.view, rules, 64);
    const Image<float> b = line_picture(cube.scene, cube.view, rules, 23);
    EXPECT_EQ(a, b);
}

TEST(Lines, ACreaseFadesWithItsAngle) {
    // Two sheets that meet at x = 0, bent by some degrees.
    double last = -1;
    for (const double bend : {5.0, 15.0, 25.0, 32.0, 45.0, 70.0}) {
        Scene scene;
        scene.materials = {matte({0.7f, 0.7f, 0.7f})};
        Mesh mesh;
        const float away = float(std::tan(bend / 2 * kPiD / 180));
        mesh.positions = {{-1, -1, -away}, {0, -1, 0}, {0, 1, 0}, {-1, 1, -away}, {1, -1, -away}, {1, 1, -away}};
        mesh.triangles = {{0, 1, 2}, {0, 2, 3}, {1, 4, 5}, {1, 5, 2}};
        mesh.submeshes = {{0, 4, 0}};
        add_part(scene, std::move(mesh), "sheet");
        const View view = look_at({0, 0, 4}, {0, 0, 0}, 64, 64, 0.1f);
        const double ink = row_ink(line_picture(scene, view, rules_of(0.5f, 0, 1)), 32, 0, 64).sum;
        EXPECT_GE(ink, last);
        if (bend <= 15) {
            EXPECT_EQ(ink, 0);
        }
        if (bend >= 45) {
            EXPECT_NEAR(ink, 1, 0.03);
        }
        last = ink;
    }
}

TEST(Lines, ASmoothBallHasNoneButItsOutlineAndFacetsHideBehindNormals) {
    Scene scene;
    scene.materials = {matte({0.7f, 0.7f, 0.7f})};
    add_part(scene, sphere_mesh({0, 0, 0}, 1, 12), "ball"); // facets of 15 degrees
    const View view = look_at({0.3f, 0.4f, 6}, {0, 0, 0}, 160, 160, 0.2f);
    const Image<float> picture = line_picture(scene, view, rules_of(0.5f, 0, 1, 1, 1));
    double sum = 0;
    for (int y = 40; y < 120; ++y) sum += row_ink(picture, y, 40, 120).sum;
    EXPECT_EQ(sum, 0);
}

TEST(Lines, StepsAreDrawnWhereOneSheetHidesAnotherAndOnlyIfTheyAreDeep) {
    for (const float height : {0.0005f, 0.4f}) { // a pixel is .0062 wide
        Scene scene;
        scene.materials = {matte({0.7f, 0.7f, 0.7f})};
        Mesh low = quad_mesh({-2, -2, 0}, {4, 0, 0}, {0, 4, 0}),
             high = quad_mesh({0, -2, height}, {4, 0, 0}, {0, 4, 0});
        const auto n = std::uint32_t(low.positions.size());
        low.positions.insert(low.positions.end(), high.positions.begin(), high.positions.end());
        for (const Vec3u t : high.triangles) low.triangles.push_back({t.x + n, t.y + n, t.z + n});
        low.uv[0].clear();
        low.submeshes = {{0, 4, 0}};
        add_part(scene, std::move(low), "sheets");
        const View view = look_at({0.2f, 0, 4}, {0, 0, 0}, 64, 64, 0.05f);
        const RowInk ink = row_ink(line_picture(scene, view, rules_of(0.5f, 0, 0, 1)), 30, 0, 64);
        if (height > 0.1f) {
            EXPECT_NEAR(ink.sum, 1, 0.03);
            EXPECT_NEAR(ink.at, double(view.project({0, 0, height}).x), 0.05);
        } else {
            EXPECT_EQ(ink.sum, 0);
        }
    }
}

TEST(Lines, CoincidingPartsDoNotFillWithInk) {
    Scene scene;
    scene.materials = {matte({0.7f, 0.7f, 0.7f}), matte({0.2f, 0.7f, 0.7f})};
    // Two balls of the same place and size, meshed differently: their facets cross at random.
    add_part(scene, sphere_mesh({0, 0, 0}, 1, 151), "ball");
    add_part(scene, sphere_mesh({0, 0, 0}, 1, 160), "twin");
    const View view = look_at({0.3f, 0.4f, 6}, {0, 0, 0}, 160, 160, 0.2f);
    const Image<float> picture = line_picture(scene, view, rules_of(0.5f, 0, 0, 0, 1));
    double sum = 0;
    for (int y = 50; y < 110; ++y) sum += row_ink(picture, y, 50, 110).sum;
    EXPECT_LT(sum, 0.25 * 60 * 60);
}

// A voxel-like wall in front of a ball: its front jumps to and fro by half a pixel to three.
struct VoxelWall {
    static constexpr float kRadius = 40;
    Scene scene;
    PartId wall, ball;
    View view;
    Cut cut;

    explicit VoxelWall(float bevel) {
        scene.materials = {matte({0.75f, 0.72f, 0.7f}), matte({0.7f, 0.3f, 0.2f})};
        view = look_at({0, 0, 5}, {0, 0, 0}, 160, 140, 0.2f);
        const float voxel = 3 * view.pixel_size(4);
        Mesh mesh;
        std::uint32_t noise = 1;
        for (int j = -40; j < 40; ++j)
            for (int i = -40; i < 40; ++i) {
                noise = noise * 1664525u + 1013904223u;
                // The deepest ones lie apart: where several in a row stay whole, the rim has no line by rule.
                const std::uint32_t height = std::max(noise >> 30, (i + j) % 2 == 0 ? 0u : 1u);
                const float x = float(i) * voxel, y = float(j) * voxel, z = 1 + float(height) * 0.5f * voxel;
                const Mesh box = box_mesh({x, y, 0.8f}, {x + voxel, y + voxel, z});
                const auto n = std::uint32_t(mesh.positions.size());
                mesh.positions.insert(mesh.positions.end(), box.positions.begin(), box.positions.end());
                for (const Vec3u t : box.triangles) mesh.triangles.push_back({t.x + n, t.y + n, t.z + n});
            }
        mesh.submeshes = {{0, std::uint32_t(mesh.triangles.size()), 0}};
        wall = add_part(scene, std::move(mesh), "wall");
        ball = add_part(scene, sphere_mesh({0, 0, 0}, 0.15f, 32, 1), "ball");
        cut.view = view;
        cut.role = {CutRole::cut_set, CutRole::fixed};
        const Rect window{36, 26, 124, 114};
        cut.distance = Image<float>(window);
        // The chamfer starts at the mean of the front: half of the voxels lie behind it at the rim.
        CutProfile profile{.floor = 4.85f};
        if (bevel > 0) profile.front = 4 - 0.75f * voxel, profile.slope = 0.2f * voxel, profile.width = bevel;
        cut.levels.emplace_back(window, profile);
        cut.loose_depth = Image<float>(window, 4.3f);
        for (int y = window.y0; y < window.y1; ++y)
            for (int x = window.x0; x < window.x1; ++x)
                cut.distance(x, y) = std::hypot(float(x) - 79.5f, float(y) - 69.5f) - kRadius;
    }

    struct Pictures {
        Frame plain, without, with;
    };
    [[nodiscard]] Pictures draw(Lines lines = Lines::rim) const {
        const MeshBvhs meshes = build_mesh_bvhs(scene);
        const Bvh whole = build_bvh(meshes, all_parts(scene), cut.role);
        const Bvh targets = build_bvh(meshes, std::vector<PartId>{ball});
        RenderParams params;
        params.lines = Lines::none;
        Pictures p;
        p.plain = render(whole, nullptr, view, params, nullptr, nullptr);
        p.without = render(whole, &targets, view, params, &cut, &p.plain);
        params.lines = lines;
        const Frame under = render(whole, nullptr, view, params, nullptr, nullptr);
        p.with = render(whole, &targets, view, params, &cut, &under);
        return p;
    }
};

/// Light of a premultiplied pixel before white: ink darkens what is behind the model, too.
double on_white(Vec4f color) { return double(color.y) + 1 - double(color.w); }

TEST(Rim, IsEvenOnAVoxelMesh) {
    for (const float bevel : {0.0f, 12.0f}) {
        const VoxelWall w(bevel);
        const VoxelWall::Pictures p = w.draw();
        // Share of the light that the line takes, by direction.
        constexpr int kSectors = 72;
        std::array<double, kSectors> ink{};
        int whole = 0;
        for (int y = 0; y < w.view.height; ++y)
            for (int x = 0; x < w.view.width; ++x) {
                const double taken = 1 - on_white(p.with.color(x, y)) / on_white(p.without.color(x, y));
                if (taken == 0) continue;
                whole += taken > 0.7 && p.without.ids.depth(x, y) == p.plain.ids.depth(x, y);
                const double dx = x + 0.5 - 80, dy = y + 0.5 - 70;
                EXPECT_NEAR(std::hypot(dx, dy), double(VoxelWall::kRadius) - 0.75, 1.6) << x << ' ' << y;
                for (int i = 0; i < 64; ++i) {
                    const double px = dx + (i % 8 - 3.5) / 8, py = dy + (i / 8 - 3.5) / 8;
                    const double turn = (std::atan2(py, px) + kPiD) / (2 * kPiD);
                    ink[std::size_t(std::min(kSectors - 1, int(turn * kSectors)))] += taken / 64;
                }
            }
        // 1.5 pixels wide and three quarters dark.
        const double expected = 0.75 * 1.5 * 2 * kPiD * (double(VoxelWall::kRadius) - 0.75) / kSectors;
        for (const double d : ink) EXPECT_NEAR(d, expected, 0.08 * expected) << bevel;
        // The line runs over voxels that the chamfer does not reach.
        if (bevel > 0) {
            EXPECT_GT(whole, 15);
        } else {
            EXPECT_EQ(whole, 0);
        }
    }
}

TEST(Rim, ChangesNothingOutsideTheHoleNorOnTargets) {
    const VoxelWall w(12);
    const VoxelWall::Pictures p = w.draw();
    int targets = 0;
    for (int y = 0; y < w.view.height; ++y)
        for (int x = 0; x < w.view.width; ++x) {
            const float d = std::hypot(float(x) - 79.5f, float(y) - 69.5f) - VoxelWall::kRadius;
            if (d > 0.8f) {
                EXPECT_EQ(p.with.color(x, y), p.plain.color(x, y)) << x << ' ' << y;
            }
            if (p.with.ids.id(x, y) != w.ball) continue;
            ++targets;
            EXPECT_EQ(p.with.color(x, y), p.without.color(x, y)) << x << ' ' << y;
        }
    EXPECT_GT(targets, 300); // a disc of 10.5 pixels' radius
    EXPECT_EQ(p.with.ids, p.without.ids);
}

TEST(Rim, DoesNotCoverATargetThatReachesIt) {
    // A rod across the whole hole and beyond.
    VoxelWall w(12);
    add_part(w.scene, box_mesh({-3, -0.05f, -0.05f}, {3, 0.05f, 0.05f}, 1), "rod");
    std::swap(w.scene.parts[1].mesh, w.scene.parts[2].mesh); // the target
    w.cut.role.push_back(CutRole::fixed);
    const Rect window = w.cut.distance.window();
    const VoxelWall::Pictures p = w.draw();
    int at_rim = 0;
    for (int y = window.y0; y < window.y1; ++y)
        for (int x = window.x0; x < window.x1; ++x) {
            bool all = true;
            for (int dy = -1; dy <= 1; ++dy)
                for (int dx = -1; dx <= 1; ++dx) all &= p.with.ids.id(x + dx, y + dy) == w.ball;
            if (!all) continue;
            EXPECT_EQ(p.with.color(x, y), p.without.color(x, y)) << x << ' ' << y;
            at_rim += std::abs(w.cut.distance(x, y) + 0.75f) < 1;
        }
    EXPECT_GT(at_rim, 4);
}

TEST(Rim, DoesNotRunWhereNothingIsCut) {
    // The wall ends at x = 0; on the right the ball is seen without a cut, before a far plane.
    VoxelWall w(0);
    Mesh& mesh = w.scene.meshes[0];
    std::erase_if(mesh.triangles, [&](Vec3u t) { return mesh.positions[t.x].x > 0.001f; });
    mesh.submeshes = {{0, std::uint32_t(mesh.triangles.size()), 0}};
    add_part(w.scene, quad_mesh({-9, -9, -2}, {18, 0, 0}, {0, 18, 0}), "far");
    w.cut.role.push_back(CutRole::fixed);
    const VoxelWall::Pictures p = w.draw();
    int left = 0;
    for (int y = 0; y < w.view.height; ++y)
        for (int x = 0; x < w.view.width; ++x) {
            if (p.with.color(x, y) == p.without.color(x, y)) continue;
            left += x < 76;
            EXPECT_LT(x, 86) << y;
        }
    EXPECT_GT(left, 150);
}

TEST(Lines, AllOfThemAreTheSameOutsideAHole) {
    const VoxelWall w(12);
    const VoxelWall::Pictures p = w.draw(Lines::all);
    const MeshBvhs meshes = build_mesh_bvhs(w.scene);
    const Bvh whole = build_bvh(meshes, all_parts(w.scene));
    RenderParams params;
    params.lines = Lines::all;
    const Frame plain = render(whole, nullptr, w.view, params, nullptr, nullptr);
    int differ = 0;
    for (int y = 0; y < w.view.height; ++y)
        for (int x = 0; x < w.view.width; ++x) {
            const float d = std::hypot(float(x) - 79.5f, float(y) - 69.5f) - VoxelWall::kRadius;
            if (d > 0.8f) {
                EXPECT_EQ(p.with.color(x, y), plain.color(x, y));
            }
            differ += d > 0.8f && plain.color(x, y) != p.plain.color(x, y);
        }
    EXPECT_GT(differ, 1000);
}

} // namespace
} // namespace porthole
