#include "porthole/scene/closed.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

namespace porthole {
namespace {

/// A box with eight corners and twelve triangles, outward.
Mesh box() {
    Mesh mesh;
    for (int i = 0; i < 8; ++i) mesh.positions.push_back({float(i & 1), float(i >> 1 & 1), float(i >> 2 & 1)});
    mesh.triangles = {{0, 2, 3}, {0, 3, 1}, {4, 5, 7}, {4, 7, 6}, {0, 1, 5}, {0, 5, 4},
                      {2, 6, 7}, {2, 7, 3}, {0, 4, 6}, {0, 6, 2}, {1, 3, 7}, {1, 7, 5}};
    return mesh;
}

/// Every triangle with vertices of its own, as STL has them.
Mesh unshared(const Mesh& mesh) {
    Mesh out;
    for (const Vec3u& t : mesh.triangles) {
        const auto n = std::uint32_t(out.positions.size());
        out.triangles.push_back({n, n + 1, n + 2});
        for (const std::uint32_t v : {t.x, t.y, t.z}) out.positions.push_back(mesh.positions[v]);
    }
    return out;
}

TEST(Closed, BoxIsClosedHoweverItsVerticesAreShared) {
    for (const Mesh& mesh : {box(), unshared(box())}) {
        const Closedness c = closedness(mesh);
        EXPECT_TRUE(c.closed);
        EXPECT_EQ(c.edges, 18u);
        EXPECT_EQ(c.open_edges + c.odd_edges, 0u);
    }
}

TEST(Closed, MinusZeroWelds) {
    Mesh mesh = unshared(box());
    for (std::size_t i = 0; i < mesh.positions.size(); i += 2)
        for (int k = 0; k < 3; ++k)
            if (mesh.positions[i][k] == 0) mesh.positions[i][k] = -0.0f;
    EXPECT_TRUE(closedness(mesh).closed);
}

TEST(Closed, MissingTriangleOpensThreeEdges) {
    Mesh mesh = box();
    mesh.triangles.pop_back();
    const Closedness c = closedness(mesh);
    EXPECT_FALSE(c.closed);
    EXPECT_EQ(c.open_edges, 3u);
    EXPECT_EQ(c.odd_edges, 0u);
}

TEST(Closed, TurnedTriangleMakesThreeOddEdges) {
    Mesh mesh = box();
    std::swap(mesh.triangles[0].x, mesh.triangles[0].y);
    const Closedness c = closedness(mesh);
    EXPECT_FALSE(c.closed);
    EXPECT_EQ(c.odd_edges, 3u);
    EXPECT_EQ(c.open_edges, 0u);
}

TEST(Closed, FinOnAnEdgeIsOdd) {
    Mesh mesh = box();
    mesh.positions.push_back({5, 5, 5});
    mesh.triangles.push_back({0, 1, 8});
    const Closedness c = closedness(mesh);
    EXPECT_FALSE(c.closed);
    EXPECT_EQ(c.odd_edges, 1u);
    EXPECT_EQ(c.open_edges, 2u);
}

TEST(Closed, TriangleThatWeldingFlattensDoesNotCount) {
    Mesh mesh = box();
    mesh.positions.push_back(mesh.positions[0]);
    mesh.triangles.push_back({0, 8, 1});
    EXPECT_TRUE(closedness(mesh).closed);
}

TEST(Closed, NothingIsNotClosed) {
    EXPECT_FALSE(closedness(Mesh{}).closed);
    Mesh points;
    points.positions = {{0, 0, 0}};
    EXPECT_FALSE(closedness(points).closed);
}

TEST(Closed, ScenesInOrderOnAnyThreads) {
    Scene scene;
    for (int i = 0; i < 20; ++i) {
        scene.meshes.push_back(box());
        if (i % 3 == 0) scene.meshes.back().triangles.pop_back();
    }
    const std::vector<Closedness> out = closedness(scene, {.stop = {}, .progress = {}, .threads = 3});
    for (std::size_t i = 0; i < out.size(); ++i) EXPECT_EQ(out[i].closed, i % 3 != 0) << i;
}

/// Adds the triangles of `other`, moved and perhaps turned around.
void add(Mesh& mesh, const Mesh& other, Vec3f by = {}, bool turned = false) {
    const auto n = std::uint32_t(mesh.positions.size());
    for (const Vec3f& p : other.positions) mesh.positions.push_back(p + by);
    for (Vec3u t : other.triangles) {
        if (turned) std::swap(t.y, t.z);
        mesh.triangles.push_back({t.x + n, t.y + n, t.z + n});
    }
}

std::vector<int> counts(const Pieces& pieces) {
    std::vector<int> out(3, 0);
    for (const PieceKind kind : pieces.kind) ++out[std::size_t(kind)];
    return out;
}

TEST(Pieces, SolidsThatTouchInAVertexAnEdgeOrAFaceStayApart) {
    for (const Vec3f by : {Vec3f{1, 1, 1}, Vec3f{1, 1, 0}, Vec3f{1, 0, 0}, Vec3f{0, 0, -1}, Vec3f{0, 1, 0}})
        for (const bool turned : {false, true}) {
            Mesh mesh = box();
            add(mesh, box(), by, turned);
            const Pieces pieces = find_pieces(mesh);
            EXPECT_EQ(counts(pieces), (std::vector{2, 0, 0})) << by.x << by.y << by.z << turned;
            for (std::size_t t = 0; t < mesh.triangles.size(); ++t) EXPECT_EQ(pieces.of_triangle[t], t / 12) << t;
        }
}

TEST(Pieces, ACopyIsAPieceOfItsOwnWhateverWayItFaces) {
    for (const bool turned : {false, true}) {
        Mesh mesh = box();
        add(mesh, box(), {}, turned);
        EXPECT_EQ(counts(find_pieces(mesh)), (std::vector{2, 0, 0})) << turned;
    }
}

TEST(Pieces, CopiesOfSomeTrianglesAreDuplicates) {
    for (const bool turned : {false, true})
        for (const std::size_t count : {1u, 2u, 6u}) {
            Mesh mesh = box();
            for (std::size_t i = 0; i < count; ++i) {
                Vec3u t = mesh.triangles[i];
                if (turned) std::swap(t.x, t.y);
                mesh.triangles.push_back(t);
            }
            const Pieces pieces = find_pieces(mesh);
            EXPECT_EQ(counts(pieces)[std::size_t(PieceKind::closed)], 1) << turned << count;
            EXPECT_EQ(counts(pieces)[std::size_t(PieceKind::open)], 0) << turned << count;
            EXPECT_FALSE(pieces.edges.closed);
        }
}

TEST(Pieces, FinsLeaveABoxClosed) {
    // On the edge from (0,0,0) to (1,0,0), all around it, either way up.
    for (int i = 0; i < 24; ++i)
        for (const bool turned : {false, true}) {
            Mesh mesh = box();
            const float angle = 0.1f + 2 * kPi * float(i) / 24;
            mesh.positions.push_back({0.5f, 0.3f * std::sin(angle), 0.3f * std::cos(angle)});
            mesh.triangles.push_back(turned ? Vec3u{0, 1, 8} : Vec3u{1, 0, 8});
            const Pieces pieces = find_pieces(mesh);
            EXPECT_EQ(counts(pieces), (std::vector{1, 1, 0})) << i << turned;
            EXPECT_EQ(pieces.kind[pieces.of_triangle.back()], PieceKind::open);
        }
}

TEST(Pieces, AMissingFaceOpensTheWholeBox) {
    Mesh mesh = box();
    mesh.triangles.resize(10);
    EXPECT_EQ(counts(find_pieces(mesh)), (std::vector{0, 1, 0}));
}

TEST(Pieces, DegenerateTrianglesBelongToNone) {
    Mesh mesh = box();
    mesh.triangles.push_back({3, 3, 5});
    const Pieces pieces = find_pieces(mesh);
    EXPECT_EQ(pieces.of_triangle.back(), kNoPiece);
    EXPECT_EQ(counts(pieces), (std::vector{1, 0, 0}));
}

TEST(Pieces, ManyTrianglesOnOneEdgeAreNoProblem) {
    // Quadratic work would take minutes.
    Mesh fan, copies;
    fan.positions = {{0, 0, 0}, {1, 0, 0}};
    copies.positions = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
    for (std::uint32_t i = 0; i < 200'000; ++i) {
        const float angle = 2 * kPi * float(i) / 200'000;
        fan.positions.push_back({0.5f, std::sin(angle), std::cos(angle)});
        fan.triangles.push_back(i % 2 ? Vec3u{0, 1, i + 2} : Vec3u{1, 0, i + 2});
        copies.triangles.push_back({0, 1, 2});
    }
    EXPECT_EQ(counts(find_pieces(fan))[std::size_t(PieceKind::closed)], 0);
    EXPECT_EQ(counts(find_pieces(copies))[std::size_t(PieceKind::closed)], 0);
}

} // namespace
} // namespace porthole
