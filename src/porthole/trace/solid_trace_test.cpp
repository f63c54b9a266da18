// Points inside parts, and the caps that follow, on constructed scenes.
#include <gtest/gtest.h>

#include <algorithm>
#include <functional>
#include <random>

#include "porthole/trace/solid.h"
#include "support/shapes.h"

namespace porthole {
namespace {

using test::Builder;
using test::finished;

/// The cubes of the given half sizes around the origin in one mesh; a negative one is wound
/// inside out.
Mesh cubes(std::initializer_list<float> halves) {
    Mesh mesh;
    const Mesh cube = test::cube();
    for (const float half : halves) {
        const auto n = std::uint32_t(mesh.positions.size());
        for (const Vec3f& p : cube.positions) mesh.positions.push_back(p * std::abs(half));
        for (Vec3u t : cube.triangles) {
            if (half < 0) std::swap(t.y, t.z);
            mesh.triangles.push_back({t.x + n, t.y + n, t.z + n});
        }
    }
    return finished(mesh);
}

struct Model {
    Builder b{32};
    std::vector<MeshSolid> solids;
    std::unique_ptr<MeshBvhs> meshes;

    std::uint32_t add_mesh(Mesh mesh) {
        b.scene.meshes.push_back(std::move(mesh));
        b.scene.meshes.back().positions.reserve(b.scene.meshes.back().positions.size() + 1);
        return std::uint32_t(b.scene.meshes.size() - 1);
    }
    void build() {
        solids = find_solids(b.scene);
        meshes = std::make_unique<MeshBvhs>(build_mesh_bvhs(b.scene));
    }
    [[nodiscard]] bool inside(PartId part, Vec3f p) const {
        return lies_inside(*meshes, solids, part, std::array{p})[0];
    }
    [[nodiscard]] std::vector<std::uint8_t> holders(std::vector<PartId> targets) const {
        return find_holders(*meshes, solids, all_parts(b.scene), targets);
    }
    [[nodiscard]] CapRules rules(std::vector<PartId> targets, const View& view,
                                 const CapOverrides& overrides = {}) const {
        return classify(*meshes, solids, all_parts(b.scene), holders(targets), view, overrides);
    }
};

View outside_view() { return test::look({0, 0, 20}, {}, 64, 64, 0.4f); }

/// Signs of what a ray through the origin along x crosses, by distance.
std::vector<int> signs_along_x(const Model& model, PartId part) {
    const Bvh bvh = build_bvh(*model.meshes, std::array{part});
    RayHit16 rays;
    for (int i = 0; i < kLanes; ++i) rays.clear(i);
    rays.set(3, {-10, 0.03f, 0.011f}, {1, 0, 0}, 0, kInfinity);
    std::vector<std::pair<float, int>> crossed;
    for_each_crossing(bvh, rays, [&](const Crossing& c) {
        const std::uint32_t mesh = model.b.scene.parts[index(part)].mesh;
        EXPECT_EQ(c.lane, 3);
        crossed.emplace_back(c.t, crossing_sign(model.solids[mesh], c.triangle, c.entering));
    });
    std::ranges::sort(crossed);
    std::vector<int> signs;
    for (const auto& [t, sign] : crossed) signs.push_back(sign);
    return signs;
}

TEST(SolidTrace, MirroredInstancesEnterAndLeaveAsTheirMeshDoes) {
    Model m;
    // One wall, its skins wound both outward, both inward, and as they should be.
    for (const auto& halves : {std::initializer_list<float>{1, 0.5f}, {-1, -0.5f}, {1, -0.5f}}) {
        const std::uint32_t mesh = m.add_mesh(cubes(halves));
        m.b.add("plain", mesh, {}, {1, 1, 1});
        m.b.add("mirrored", mesh, {}, {-2, 1, 1});
        m.b.add("point", mesh, {}, {-1, -1, -1});
    }
    m.build();
    for (const PartId part : all_parts(m.b.scene)) {
        EXPECT_EQ(signs_along_x(m, part), (std::vector{-1, 1, -1, 1})) << index(part);
        EXPECT_FALSE(m.inside(part, {0.1f, 0.1f, 0.1f}));
        EXPECT_TRUE(m.inside(part, {0.1f, 0.75f, 0.1f}));
        EXPECT_FALSE(m.inside(part, {0.1f, 1.25f, 0.1f}));
    }
}

TEST(SolidTrace, PointsInsideAWallAreThoseOfTheWall) {
    Model m;
    const std::uint32_t mesh = m.add_mesh(cubes({1, 0.6f, 0.3f}));
    const PartId part = m.b.add("wall", mesh, {5, -2, 1}, {1, 2, 0.5});
    m.build();
    std::mt19937 random(4);
    std::uniform_real_distribution<float> u(-1.2f, 1.2f);
    std::vector<Vec3f> points;
    std::vector<std::uint8_t> expected;
    for (int i = 0; i < 4000; ++i) {
        const Vec3f p{u(random), u(random), u(random)};
        const float r = std::max({std::abs(p.x), std::abs(p.y), std::abs(p.z)});
        points.push_back({5 + p.x, -2 + 2 * p.y, 1 + 0.5f * p.z});
        expected.push_back(r < 0.3f || (r > 0.6f && r < 1));
    }
    EXPECT_EQ(lies_inside(*m.meshes, m.solids, part, points), expected);
}

TEST(SolidTrace, PointsOnSymmetryAxesAreInside) {
    // Rays through vertices and edges, which two triangles or more report.
    Model m;
    const PartId sphere = m.b.add_sphere("sphere", {}, 1), box = m.b.add_box("box", {}, {1, 1, 1});
    m.build();
    for (const PartId part : {sphere, box})
        for (const Vec3f p : {Vec3f{0, 0, 0}, Vec3f{0, 0.5f, 0}, Vec3f{0.5f, 0, 0}, Vec3f{0.25f, 0.25f, 0.25f}})
            EXPECT_TRUE(m.inside(part, p)) << p.x << p.y << p.z;
}

TEST(SolidTrace, WhoHoldsATargetIsAShell) {
    Model m;
    const std::uint32_t wall = m.add_mesh(cubes({1, 0.7f}));
    const PartId skin = m.b.add_sphere("skin", {}, 4), housing = m.b.add("housing", wall, {}, {1, 1, 1}),
                 target = m.b.add_sphere("target", {}, 0.5), beside = m.b.add_sphere("beside", {6, 0, 0}, 1.5);
    m.build();
    const std::vector<std::uint8_t> holders = m.holders({target});
    EXPECT_TRUE(holders[index(skin)]);
    EXPECT_FALSE(holders[index(housing)]); // the target floats in its cavity
    EXPECT_FALSE(holders[index(target)]);
    EXPECT_FALSE(holders[index(beside)]);
    EXPECT_EQ(holders,
              find_holders(*m.meshes, m.solids, all_parts(m.b.scene), std::array{target}, test::with_threads(4)));

    const CapRules rules = m.rules({target}, outside_view());
    EXPECT_EQ(rules.rule, (std::vector{CapRule::shell, CapRule::solid, CapRule::solid, CapRule::solid}));
    EXPECT_TRUE(rules.open.empty() && rules.partly_open.empty() && rules.around_eye.empty());
    // The housing itself as a target lies in the skin; its own part is no holder.
    EXPECT_EQ(m.holders({housing}), (std::vector<std::uint8_t>{1, 0, 0, 0}));
}

TEST(SolidTrace, APressFitIsNoHolderButHalfABodyIs) {
    Model m;
    const std::uint32_t wall = m.add_mesh(cubes({1, 0.5f}));
    const PartId housing = m.b.add("housing", wall, {}, {1, 1, 1});
    const PartId pressed = m.b.add_box("pressed", {}, {0.505, 0.505, 0.505}); // overlaps by 0.3 % of its size
    const PartId stuck = m.b.add_box("stuck", {0.6, 0, 0}, {0.3, 0.3, 0.3});  // two thirds of it in the wall
    m.build();
    EXPECT_FALSE(m.holders({pressed})[index(housing)]);
    EXPECT_TRUE(m.holders({stuck})[index(housing)]);
    EXPECT_TRUE(m.holders({pressed, stuck})[index(housing)]);
}

TEST(SolidTrace, OverridesWinButOpenPartsStayOpen) {
    Model m;
    Mesh lid = test::cube();
    lid.triangles.resize(10);
    const std::uint32_t open_mesh = m.add_mesh(finished(lid));
    Mesh with_fin = test::cube();
    with_fin.positions.push_back({0, -3, 0});
    with_fin.triangles.push_back({0, 1, 8});
    const std::uint32_t fin_mesh = m.add_mesh(finished(with_fin));
    const PartId open = m.b.add("open", open_mesh, {}, {3, 3, 3}), fin = m.b.add("fin", fin_mesh, {}, {2, 2, 2}),
                 ball = m.b.add_sphere("ball", {}, 1.5), target = m.b.add_sphere("target", {}, 0.5);
    m.build();

    CapRules rules = m.rules({target}, outside_view());
    EXPECT_EQ(rules.rule[index(open)], CapRule::none);
    EXPECT_EQ(rules.rule[index(fin)], CapRule::shell);
    EXPECT_EQ(rules.rule[index(ball)], CapRule::shell);
    EXPECT_EQ(rules.open, std::vector{open});
    EXPECT_EQ(rules.partly_open, std::vector{fin});

    rules = m.rules({target}, outside_view(), {.solid = {open, ball}, .shell = {open}});
    EXPECT_EQ(rules.rule[index(open)], CapRule::none);
    EXPECT_EQ(rules.rule[index(ball)], CapRule::solid);
    EXPECT_EQ(rules.rule[index(fin)], CapRule::shell);
    EXPECT_EQ(m.rules({}, outside_view(), {.shell = {ball}}).rule[index(ball)], CapRule::shell);
    EXPECT_EQ(m.rules({}, outside_view(), {.solid = {ball}, .shell = {ball}}).rule[index(ball)], CapRule::solid);
}

TEST(SolidTrace, NoCapAroundTheEye) {
    Model m;
    const std::uint32_t wall = m.add_mesh(cubes({2, 1}));
    const PartId room = m.b.add("room", wall, {}, {1, 1, 1}), ball = m.b.add_sphere("ball", {1.5, 0, 0}, 0.4),
                 target = m.b.add_sphere("target", {0, 0, -0.5}, 0.2);
    m.build();
    // In the cavity of the room, in its wall, and in the ball in its wall.
    const auto rules_from = [&](Vec3f eye) {
        return m.rules({target}, test::look(eye, {0, 0.1f, -0.5f}, 64, 64, 0.4f), {.solid = {room}});
    };
    EXPECT_TRUE(rules_from({0, 0, 0.5f}).around_eye.empty());
    EXPECT_EQ(rules_from({0, 1.5f, 0}).around_eye, std::vector{room});
    EXPECT_EQ(rules_from({0, 1.5f, 0}).rule[index(room)], CapRule::none);
    EXPECT_EQ(rules_from({1.5f, 0, 0}).around_eye, (std::vector{room, ball}));

    // Parallel rays start on a plane that runs through the wall beside the camera.
    const View flat = test::look({0, 0, 0.5f}, {0, 0, -0.5f}, 64, 64, 1.7f, true);
    EXPECT_EQ(find_around_eye(*m.meshes, m.solids, all_parts(m.b.scene), flat), std::vector{room});
}

} // namespace
} // namespace porthole
