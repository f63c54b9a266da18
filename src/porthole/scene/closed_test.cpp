#include "porthole/scene/closed.h"

#include <gtest/gtest.h>

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

} // namespace
} // namespace porthole
