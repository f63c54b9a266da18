// Solids with known insides: what the sides of triangles say of a point must be what the
// construction says.
#include "porthole/scene/solid.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <functional>
#include <random>

#include "porthole/scene/pierce.h"
#include "support/shapes.h"

namespace porthole {
namespace {

using test::finished;

struct Box {
    Vec3f lower, upper;
    [[nodiscard]] bool holds(Vec3d p) const {
        for (int i = 0; i < 3; ++i)
            if (p[i] < double(lower[i]) || p[i] > double(upper[i])) return false;
        return true;
    }
};

/// Adds a box. Each face is a grid of its own with `cells[face]` cells a side; faces with
/// different numbers meet in edges that do not pair.
void add_box(Mesh& mesh, Box box, bool turned = false, std::array<int, 6> cells = {1, 1, 1, 1, 1, 1}, int faces = 6) {
    for (int face = 0; face < faces; ++face) {
        const int axis = face / 2, n = cells[std::size_t(face)];
        const bool up = face % 2;
        const auto first = std::uint32_t(mesh.positions.size());
        for (int j = 0; j <= n; ++j)
            for (int i = 0; i <= n; ++i) {
                Vec3f p;
                p[axis] = up ? box.upper[axis] : box.lower[axis];
                for (const auto& [k, step] : {std::pair{(axis + 1) % 3, i}, std::pair{(axis + 2) % 3, j}})
                    p[k] = step == n ? box.upper[k]
                                     : box.lower[k] + (box.upper[k] - box.lower[k]) * float(step) / float(n);
                mesh.positions.push_back(p);
            }
        for (int j = 0; j < n; ++j)
            for (int i = 0; i < n; ++i) {
                const auto at = [&](int x, int y) { return first + std::uint32_t(y * (n + 1) + x); };
                for (Vec3u t : {Vec3u{at(i, j), at(i + 1, j), at(i + 1, j + 1)},
                                Vec3u{at(i, j), at(i + 1, j + 1), at(i, j + 1)}}) {
                    if (up == turned) std::swap(t.y, t.z);
                    mesh.triangles.push_back(t);
                }
            }
    }
}

const std::array<int, 6> kUnequal = {2, 3, 5, 7, 4, 6};

/// How often a point lies in material: every triangle against one ray, without any of the
/// code that is tested but the sides.
int material_at(const Mesh& mesh, const MeshSolid& solid, Vec3d p) {
    const Vec3d d = normalize(Vec3d{0.317, 0.871, -0.5533});
    int left = 0;
    for (std::uint32_t i = 0; i < mesh.triangles.size(); ++i) {
        const Vec3u& t = mesh.triangles[i];
        const Vec3d a(mesh.positions[t.x]), ab = Vec3d(mesh.positions[t.y]) - a, ac = Vec3d(mesh.positions[t.z]) - a;
        const Vec3d h = cross(d, ac), q = cross(p - a, ab);
        const double det = dot(ab, h);
        if (det == 0) continue;
        const double u = dot(p - a, h) / det, v = dot(d, q) / det;
        if (u < 0 || v < 0 || u + v > 1 || dot(ac, q) / det <= 0) continue;
        left += crossing_sign(solid, i, dot(cross(ab, ac), d) < 0);
    }
    return left;
}

/// Compares at random points around the mesh.
void expect_material(const Mesh& mesh, const std::function<int(Vec3d)>& expected, const std::string& what = {}) {
    const MeshSolid solid = find_solid(mesh);
    std::mt19937 random(1);
    std::uniform_real_distribution<double> u(-0.1, 1.1);
    int inside = 0;
    for (int i = 0; i < 1500; ++i) {
        const Vec3d p = Vec3d(mesh.bounds.lower) + Vec3d{u(random), u(random), u(random)} * Vec3d(mesh.bounds.size());
        ASSERT_EQ(material_at(mesh, solid, p), expected(p)) << what << " at " << p.x << ' ' << p.y << ' ' << p.z;
        inside += expected(p) > 0;
    }
    EXPECT_GT(inside, 0) << what;
}

const Box kOuter{{-1, -1, -1}, {1, 1, 1}}, kInner{{-0.7f, -0.7f, -0.7f}, {0.7f, 0.7f, 0.6f}},
    kCore{{-0.3f, -0.3f, -0.3f}, {0.3f, 0.4f, 0.3f}};

TEST(Solid, BoxFacesOutwardAndInsideOutIsTurned) {
    for (const bool turned : {false, true}) {
        Mesh mesh;
        add_box(mesh, kOuter, turned);
        mesh = finished(mesh);
        const MeshSolid solid = find_solid(mesh);
        EXPECT_TRUE(solid.closed);
        EXPECT_EQ(solid.by, ClosedBy::edges);
        EXPECT_TRUE(solid.side.empty());
        EXPECT_EQ(solid.uniform, turned ? TriangleSide::inward : TriangleSide::outward);
        EXPECT_EQ(solid.components, 1u);
        EXPECT_EQ(solid.flipped_components, turned);
        expect_material(mesh, [](Vec3d p) { return int(kOuter.holds(p)); });
        // A ray enters it first, whatever the winding.
        EXPECT_EQ(crossing_sign(solid, 0, !turned), -1);
        EXPECT_EQ(crossing_sign(solid, 0, turned), 1);
    }
}

TEST(Solid, InsideOutSphere) {
    Mesh mesh = test::sphere(12);
    for (Vec3u& t : mesh.triangles) std::swap(t.x, t.y);
    const MeshSolid solid = find_solid(mesh);
    EXPECT_TRUE(solid.closed);
    EXPECT_EQ(solid.uniform, TriangleSide::inward);
    expect_material(mesh, [](Vec3d p) { // between the facets and the sphere nothing is said
        const double r = length(p);
        return r < 0.97 ? 1 : r > 1 ? 0 : material_at(test::sphere(12), {.uniform = TriangleSide::outward}, p);
    });
}

TEST(Solid, NestingDecidesWhateverTheWinding) {
    for (int winding = 0; winding < 8; ++winding) {
        Mesh mesh;
        add_box(mesh, kCore, winding & 1); // the order in the file does not matter either
        add_box(mesh, kOuter, winding & 2);
        add_box(mesh, kInner, winding & 4);
        mesh = finished(mesh);
        const MeshSolid solid = find_solid(mesh);
        EXPECT_TRUE(solid.closed);
        EXPECT_EQ(solid.closed_components, 3u);
        EXPECT_EQ(solid.flipped_components, (winding & 1) + ((winding & 2) >> 1) + ((winding & 4) == 0)) << winding;
        expect_material(mesh, [](Vec3d p) { return kCore.holds(p) || (kOuter.holds(p) && !kInner.holds(p)); });
    }
}

TEST(Solid, HousingWithASkinWoundOutwardIsOneWall) {
    Mesh mesh = test::sphere(16);
    const Mesh skin = mesh;
    const auto n = std::uint32_t(mesh.positions.size());
    for (const Vec3f& p : skin.positions) mesh.positions.push_back(p * 0.8f);
    for (const Vec3u& t : skin.triangles) mesh.triangles.push_back({t.x + n, t.y + n, t.z + n});
    mesh = finished(mesh);
    const MeshSolid solid = find_solid(mesh);
    EXPECT_TRUE(solid.closed);
    EXPECT_EQ(solid.flipped_components, 1u);
    EXPECT_EQ(material_at(mesh, solid, {0.1, 0.2, 0.3}), 0);
    EXPECT_EQ(material_at(mesh, solid, {0, 0.9, 0.01}), 1);
}

TEST(Solid, ShellWoundBothWaysIsSolid) {
    Mesh mesh;
    add_box(mesh, kOuter);
    add_box(mesh, kOuter, true);
    mesh = finished(mesh);
    const MeshSolid solid = find_solid(mesh);
    EXPECT_TRUE(solid.closed);
    EXPECT_EQ(solid.flipped_components, 1u);
    expect_material(mesh, [](Vec3d p) { return 2 * int(kOuter.holds(p)); });
}

TEST(Solid, BodiesThatCrossStayBodies) {
    const Box other{{0.2f, 0.1f, -0.5f}, {1.5f, 0.8f, 0.4f}};
    const Box almost_within{{-0.9f, -0.9f, -0.9f}, {0.9f, 1.01f, 0.9f}};
    for (const Box& second : {other, almost_within})
        for (int winding = 0; winding < 4; ++winding) {
            Mesh mesh;
            add_box(mesh, kOuter, winding & 1);
            add_box(mesh, second, winding & 2);
            mesh = finished(mesh);
            EXPECT_TRUE(find_solid(mesh).closed);
            expect_material(mesh, [&](Vec3d p) { return int(kOuter.holds(p)) + int(second.holds(p)); });
        }
}

TEST(Solid, BodiesThatTouchStayBodies) {
    // Side by side with a whole face in common, in a corner, on the floor inside, and twice the same.
    const Box beside{{1, -1, -1}, {3, 1, 1}}, corner{{1, 1, 1}, {2, 2, 2}}, floor{{-0.5f, -1, -0.5f}, {0.5f, 0, 0.5f}};
    for (const Box& second : {beside, corner, floor, kOuter}) {
        Mesh mesh;
        add_box(mesh, kOuter);
        add_box(mesh, second);
        mesh = finished(mesh);
        const MeshSolid solid = find_solid(mesh);
        EXPECT_TRUE(solid.closed);
        EXPECT_EQ(solid.flipped_components, 0u);
        expect_material(mesh, [&](Vec3d p) { return int(kOuter.holds(p)) + int(second.holds(p)); });
    }
}

TEST(Solid, CopiedTrianglesDoNotCountTwice) {
    for (const bool turned : {false, true}) {
        Mesh mesh;
        add_box(mesh, kOuter, false, {3, 3, 3, 3, 3, 3});
        const std::size_t face = 18;
        for (std::size_t i = 0; i < face; ++i) {
            Vec3u t = mesh.triangles[i];
            if (turned) std::swap(t.x, t.y);
            mesh.triangles.push_back(t);
        }
        mesh = finished(mesh);
        const MeshSolid solid = find_solid(mesh);
        EXPECT_TRUE(solid.closed) << turned;
        EXPECT_FALSE(solid.edges.closed);
        EXPECT_EQ(solid.components, 1u);
        expect_material(mesh, [](Vec3d p) { return int(kOuter.holds(p)); });
    }
}

TEST(Solid, FacesTessellatedByThemselvesCloseByRays) {
    for (const bool turned : {false, true}) {
        Mesh mesh;
        add_box(mesh, kOuter, turned, kUnequal);
        mesh = finished(mesh);
        const MeshSolid solid = find_solid(mesh);
        EXPECT_GT(solid.edges.open_edges, 0u);
        EXPECT_TRUE(solid.closed);
        EXPECT_EQ(solid.by, ClosedBy::rays);
        EXPECT_EQ(solid.lines, 300u);
        EXPECT_EQ(solid.balanced_lines, 300u);
        EXPECT_EQ(solid.components, 6u);
        EXPECT_EQ(solid.flipped_components, turned ? 6u : 0u);
        expect_material(mesh, [](Vec3d p) { return int(kOuter.holds(p)); });
    }
}

TEST(Solid, MissingFaceOrTriangleIsOpen) {
    for (const auto& cells : {std::array{1, 1, 1, 1, 1, 1}, std::array{4, 4, 4, 4, 4, 4}, kUnequal}) {
        Mesh mesh;
        add_box(mesh, kOuter, false, cells, 5);
        mesh = finished(mesh);
        const MeshSolid solid = find_solid(mesh);
        EXPECT_FALSE(solid.closed);
        EXPECT_EQ(solid.by, ClosedBy::nothing);
        EXPECT_FALSE(solid.has_material());
        EXPECT_EQ(crossing_sign(solid, 0, true), 0);
    }
    for (std::size_t gone = 0; gone < 12; ++gone) {
        Mesh mesh;
        add_box(mesh, kOuter);
        mesh.triangles.erase(mesh.triangles.begin() + std::ptrdiff_t(gone));
        EXPECT_FALSE(find_solid(finished(mesh)).has_material()) << gone;
    }
}

TEST(Solid, CavityAndHullOfDifferentKinds) {
    // A hull or a cavity whose edges do not pair, each wound either way. Only when the two
    // together make no sense as the file has them does nesting decide.
    for (int kind = 1; kind < 3; ++kind)
        for (int winding = 0; winding < 4; ++winding) {
            const std::string what = "kind " + std::to_string(kind) + " winding " + std::to_string(winding);
            Mesh mesh;
            add_box(mesh, kOuter, winding & 1, kind & 1 ? kUnequal : std::array{1, 1, 1, 1, 1, 1});
            add_box(mesh, kInner, winding & 2, kind & 2 ? kUnequal : std::array{1, 1, 1, 1, 1, 1});
            mesh = finished(mesh);
            const MeshSolid solid = find_solid(mesh);
            EXPECT_TRUE(solid.closed) << what;
            EXPECT_EQ(solid.by, ClosedBy::rays) << what;
            expect_material(
                mesh, [](Vec3d p) { return kOuter.holds(p) && !kInner.holds(p); }, what);
        }
}

TEST(Solid, CadHullAndCavityMustBeWoundRight) {
    // By rays alone a cavity that faces the wrong way cannot be told from a body that overlaps.
    for (int winding = 0; winding < 4; ++winding) {
        Mesh mesh;
        add_box(mesh, kOuter, winding & 1, kUnequal);
        add_box(mesh, kInner, winding & 2, kUnequal);
        mesh = finished(mesh);
        const bool consistent = bool(winding & 1) != bool(winding & 2);
        EXPECT_EQ(find_solid(mesh).closed, consistent) << winding;
        EXPECT_EQ(find_solid(mesh).has_material(), consistent) << winding;
        if (consistent) expect_material(mesh, [](Vec3d p) { return kOuter.holds(p) && !kInner.holds(p); });
    }
}

TEST(Solid, SkinsWithPinholesNest) {
    for (int winding = 0; winding < 4; ++winding) {
        Mesh mesh;
        add_box(mesh, kOuter, winding & 1, {12, 12, 12, 12, 12, 12});
        add_box(mesh, kInner, winding & 2, {12, 12, 12, 12, 12, 12});
        mesh.triangles.erase(mesh.triangles.begin() + 100); // of 1728 each
        mesh.triangles.erase(mesh.triangles.begin() + 2300);
        mesh = finished(mesh);
        const MeshSolid solid = find_solid(mesh);
        EXPECT_TRUE(solid.closed) << winding;
        EXPECT_EQ(solid.by, ClosedBy::rays) << winding;
        EXPECT_EQ(material_at(mesh, solid, {0.1, 0.2, 0.3}), 0) << winding;
        EXPECT_EQ(material_at(mesh, solid, {0.8, 0.1, 0.2}), 1) << winding;
        EXPECT_EQ(material_at(mesh, solid, {0.8, 1.1, 0.2}), 0) << winding;
    }
}

TEST(Solid, BodiesBesideACadHullKeepTheirSide) {
    const Box screw{{1.2f, 0, 0}, {1.5f, 0.5f, 0.5f}};
    for (int winding = 0; winding < 4; ++winding) {
        Mesh mesh;
        add_box(mesh, kOuter, winding & 1, kUnequal);
        add_box(mesh, screw, winding & 2);
        mesh = finished(mesh);
        EXPECT_TRUE(find_solid(mesh).closed);
        expect_material(mesh, [&](Vec3d p) { return kOuter.holds(p) || screw.holds(p); });
    }
}

TEST(Solid, NothingIsSaidOfWhatMayBeTheWallOfAnOpenHull) {
    Mesh mesh;
    add_box(mesh, kOuter, false, {4, 4, 4, 4, 4, 4}, 5);
    add_box(mesh, kInner);
    EXPECT_FALSE(find_solid(finished(mesh)).has_material());

    // A body beside it is none.
    const Box beside{{2, 0, 0}, {3, 1, 1}};
    add_box(mesh, beside);
    mesh = finished(mesh);
    const MeshSolid solid = find_solid(mesh);
    EXPECT_FALSE(solid.closed);
    EXPECT_EQ(solid.closed_components, 1u);
    expect_material(mesh, [&](Vec3d p) { return int(beside.holds(p)); });
}

TEST(Solid, FinIsIgnored) {
    Mesh mesh;
    add_box(mesh, kOuter);
    const auto n = std::uint32_t(mesh.positions.size());
    for (const Vec3f p : {Vec3f{-1, -1, -1}, Vec3f{1, -1, -1}, Vec3f{0, -2, -0.5f}}) mesh.positions.push_back(p);
    mesh.triangles.push_back({n, n + 1, n + 2});
    mesh = finished(mesh);
    const MeshSolid solid = find_solid(mesh);
    EXPECT_FALSE(solid.closed);
    EXPECT_TRUE(solid.has_material());
    EXPECT_EQ(solid.side.back(), TriangleSide::open);
    expect_material(mesh, [](Vec3d p) { return int(kOuter.holds(p)); });
}

TEST(Solid, FlatSheetsBoundNothingAndOpenNothing) {
    Mesh sheet;
    sheet.positions = {{2, 0, 0}, {3, 0, 0}, {3, 1, 0}, {2, 1, 0}};
    sheet.triangles = {{0, 1, 2}, {0, 2, 3}, {0, 2, 1}, {0, 3, 2}};
    EXPECT_TRUE(find_pieces(finished(sheet)).edges.odd_edges == 1);
    EXPECT_FALSE(find_solid(finished(sheet)).closed);
    EXPECT_FALSE(find_solid(finished(sheet)).has_material());

    add_box(sheet, kOuter);
    const MeshSolid solid = find_solid(finished(sheet));
    EXPECT_TRUE(solid.closed);
    EXPECT_EQ(solid.components, 1u);
    EXPECT_EQ(solid.side[0], TriangleSide::open);
}

TEST(Solid, EmptyAndThinMeshes) {
    EXPECT_EQ(find_solid(Mesh{}), MeshSolid{});
    Mesh mesh;
    add_box(mesh, {{0, 0, 0}, {1, 1, 1e-4f}});
    EXPECT_TRUE(find_solid(finished(mesh)).closed);
    Mesh far_away; // thinner than a float there can tell
    add_box(far_away, {{1e6f, 0, 0}, {1e6f + 0.0625f, 1, 1}});
    EXPECT_FALSE(find_solid(finished(far_away)).has_material());
}

TEST(Solid, AHundredThousandPieces) {
    Mesh mesh;
    add_box(mesh, {{-1, -1, -1}, {60, 60, 60}});
    for (int i = 0; i < 100'000; ++i) {
        const Vec3f p{float(i % 50), float(i / 50 % 50), float(i / 2500)};
        add_box(mesh, {p, p + Vec3f{0.5f, 0.5f, 0.5f}}, i % 2);
    }
    mesh = finished(mesh);
    const MeshSolid solid = find_solid(mesh);
    EXPECT_TRUE(solid.closed);
    EXPECT_EQ(solid.components, 100'001u);
    EXPECT_EQ(solid.flipped_components, 50'000u); // all are cavities; half of them face the right way
}

TEST(Solid, TooManyShellsInEachOtherComeOutOpenSoon) {
    Mesh mesh;
    for (int i = 1; i <= 20'000; ++i) {
        const auto r = float(i);
        add_box(mesh, {{-r, -r, -r}, {r, r, r}});
    }
    const MeshSolid solid = find_solid(finished(mesh));
    EXPECT_FALSE(solid.closed);
    EXPECT_FALSE(solid.has_material());
}

TEST(Solid, ScenesInOrderOnAnyThreadsOnlyWhereAsked) {
    Scene scene;
    for (int i = 0; i < 12; ++i) {
        Mesh mesh;
        add_box(mesh, kOuter, i % 2, i % 3 ? kUnequal : std::array{1, 1, 1, 1, 1, 1}, i % 5 ? 6 : 5);
        scene.meshes.push_back(finished(mesh));
    }
    std::vector<std::uint8_t> wanted(12, 1);
    wanted[4] = 0;
    const std::vector<MeshSolid> one = find_solids(scene, wanted, test::with_threads(1));
    EXPECT_EQ(one, find_solids(scene, wanted, test::with_threads(3)));
    for (std::size_t i = 0; i < 12; ++i) EXPECT_EQ(one[i], i == 4 ? MeshSolid{} : find_solid(scene.meshes[i])) << i;
}

TEST(Pierce, LinesThroughEdgesAndCornersPierceOnce) {
    Mesh mesh;
    add_box(mesh, kOuter, false, {4, 4, 4, 4, 4, 4});
    mesh = finished(mesh);
    std::vector<Vec3d> points;
    for (int y = -5; y <= 5; ++y)
        for (int x = -5; x <= 5; ++x) points.push_back({x * 0.25, y * 0.25, 0.1});
    const auto count = points.size();
    for (const Vec3d direction : {Vec3d{0, 0, 1}, Vec3d{0, 0, -1}}) {
        const auto piercings = find_piercings(mesh, {}, direction, points, 1'000'000);
        ASSERT_TRUE(piercings);
        std::vector<std::vector<Piercing>> by_line(count);
        for (const Piercing& p : *piercings) by_line[p.line].push_back(p);
        for (std::size_t i = 0; i < count; ++i) {
            const Vec3d p = points[i];
            if (std::max(std::abs(p.x), std::abs(p.y)) > 1) {
                EXPECT_TRUE(by_line[i].empty());
            } else if (std::max(std::abs(p.x), std::abs(p.y)) < 1) {
                ASSERT_EQ(by_line[i].size(), 2u) << p.x << ' ' << p.y;
                EXPECT_TRUE(by_line[i][0].entering);
                EXPECT_FALSE(by_line[i][1].entering);
                EXPECT_DOUBLE_EQ(by_line[i][0].along, -1 - 0.1 * direction.z);
                EXPECT_DOUBLE_EQ(by_line[i][1].along, 1 - 0.1 * direction.z);
            } else {
                EXPECT_TRUE(by_line[i].empty() || by_line[i].size() == 2) << p.x << ' ' << p.y;
            }
        }
    }
    EXPECT_FALSE(find_piercings(mesh, {}, {0, 0, 1}, points, 50));
    const std::vector<std::uint8_t> none(mesh.triangles.size(), 0);
    EXPECT_TRUE(find_piercings(mesh, none, {0, 0, 1}, points, 50)->empty());
}

TEST(Pierce, ClosedSurfacesBalanceOnEveryLine) {
    Mesh mesh;
    add_box(mesh, kOuter, false, {10, 10, 10, 10, 10, 10});
    for (Vec3f& p : mesh.positions) p = normalize(p);
    mesh = finished(mesh);
    ASSERT_TRUE(find_pieces(mesh).edges.closed);
    std::mt19937 random(5);
    std::normal_distribution<double> normal;
    for (int round = 0; round < 20; ++round) {
        const Vec3d direction = normalize(Vec3d{normal(random), normal(random), normal(random)});
        std::vector<Vec3d> points; // exactly at the vertices, where it is hardest
        for (const Vec3f& p : mesh.positions) points.emplace_back(p);
        const auto piercings = find_piercings(mesh, {}, direction, points, 100'000'000);
        ASSERT_TRUE(piercings);
        std::vector<int> balance(points.size(), 0), crossed(points.size(), 0);
        for (const Piercing& p : *piercings) balance[p.line] += p.entering ? 1 : -1, ++crossed[p.line];
        EXPECT_EQ(std::ranges::count(balance, 0), std::ptrdiff_t(points.size()));
        EXPECT_GT(std::ranges::count(crossed, 2), std::ptrdiff_t(points.size() * 9 / 10));
    }
}

} // namespace
} // namespace porthole
