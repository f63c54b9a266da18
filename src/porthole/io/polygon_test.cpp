#include "porthole/io/polygon.h"

#include <cmath>
#include <map>
#include <random>

#include <gtest/gtest.h>

namespace porthole {
namespace {

Vec3d area_vector(const std::vector<Vec3f>& p, Vec3u t) {
    return cross(Vec3d(p[t.y]) - Vec3d(p[t.x]), Vec3d(p[t.z]) - Vec3d(p[t.x])) * 0.5;
}

/// Twice-used inner edges, once-used outline, and no triangle turned over: a triangulation.
void expect_triangulation(const std::vector<Vec3f>& corners) {
    Triangulator triangulator;
    const std::span<const Vec3u> triangles = triangulator.triangulate(corners);
    ASSERT_EQ(triangles.size(), corners.size() - 2);
    Vec3d whole;
    for (std::size_t i = 1; i + 1 < corners.size(); ++i)
        whole += area_vector(corners, {0, std::uint32_t(i), std::uint32_t(i + 1)});
    const Vec3d normal = normalize(whole);
    double sum = 0;
    std::map<std::pair<std::uint32_t, std::uint32_t>, int> edges;
    for (const Vec3u t : triangles) {
        const double area = dot(area_vector(corners, t), normal);
        EXPECT_GE(area, -1e-9 * length(whole));
        sum += area;
        for (const auto& [a, b] : {std::pair{t.x, t.y}, std::pair{t.y, t.z}, std::pair{t.z, t.x}}) ++edges[{a, b}];
    }
    EXPECT_NEAR(sum, length(whole), 1e-6 * length(whole));
    const auto n = std::uint32_t(corners.size());
    for (const auto& [edge, count] : edges) {
        EXPECT_EQ(count, 1);
        const bool outline = edge.second == (edge.first + 1) % n;
        EXPECT_EQ(edges.contains({edge.second, edge.first}), !outline);
    }
}

TEST(Triangulator, ConvexAndConcavePolygons) {
    expect_triangulation({{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}});
    expect_triangulation({{0, 0, 0}, {2, 0, 0}, {2, 2, 0}, {1, 0.2f, 0}, {0, 2, 0}}); // a notch
    expect_triangulation({{0, 0, 0}, {0, 2, 0}, {1, 0.2f, 0}, {2, 2, 0}, {2, 0, 0}}); // clockwise
    expect_triangulation({{0, 0, 0}, {4, 0, 0}, {1, 1, 0}, {0, 4, 0}});               // a concave quad
    expect_triangulation({{5, 0, 0}, {5, 3, 1}, {5, 1, 1}, {5, 1, 3}, {5, 0, 4}});    // facing x
    expect_triangulation({{0, 5, 0}, {1, 5, 3}, {1.2f, 5, 1}, {3, 5, 1}, {4, 5, 0}}); // facing y
}

TEST(Triangulator, RandomStars) {
    std::mt19937 random(1);
    std::uniform_real_distribution<float> radius(0.05f, 1);
    for (int round = 0; round < 200; ++round) {
        const int n = 4 + round;
        std::vector<Vec3f> star;
        for (int i = 0; i < n; ++i) {
            const float a = 2 * kPi * float(i) / float(n), r = radius(random);
            star.push_back({r * std::cos(a), 0.3f * r * std::cos(a) + 0.1f, r * std::sin(a)});
        }
        expect_triangulation(star);
    }
}

TEST(Triangulator, CombWithManyReflexCorners) {
    std::vector<Vec3f> comb;
    for (int i = 0; i < 500; ++i) {
        comb.push_back({float(2 * i), 0, 0});
        comb.push_back({float(2 * i + 1), 10, 0});
    }
    comb.push_back({1000, 20, 0});
    comb.push_back({0, 20, 0});
    expect_triangulation(comb);
}

TEST(Triangulator, NothingMakesItFail) {
    Triangulator t;
    EXPECT_TRUE(t.triangulate({}).empty());
    EXPECT_TRUE(t.triangulate(std::vector<Vec3f>{{0, 0, 0}, {1, 0, 0}}).empty());
    EXPECT_EQ(t.triangulate(std::vector<Vec3f>(6)).size(), 4u);
    const float nan = std::nanf("");
    EXPECT_EQ(t.triangulate(std::vector<Vec3f>{{0, 0, 0}, {nan, 0, 0}, {1, 1, 0}, {0, 1, 0}}).size(), 2u);
    EXPECT_EQ(t.triangulate(std::vector<Vec3f>{{0, 0, 0}, {1, 1, 0}, {1, 0, 0}, {0, 1, 0}}).size(), 2u); // a bow tie
    std::mt19937 random(2);
    std::uniform_int_distribution<int> grid(0, 4); // many coincident and collinear corners
    for (int round = 0; round < 2000; ++round) {
        std::vector<Vec3f> any;
        for (int i = 0; i < 4 + round % 30; ++i) any.push_back({float(grid(random)), float(grid(random)), 0});
        EXPECT_EQ(t.triangulate(any).size(), any.size() - 2);
    }
    EXPECT_EQ(t.gave_up(), 0u);
}

TEST(Triangulator, GivesUpInTimeOnHugeSpirals) {
    // Two long arms wound round each other: every ear test meets many reflex corners.
    std::vector<Vec3f> spiral;
    const int n = 6000;
    for (int i = 0; i < n; ++i) {
        const float a = 0.02f * float(i);
        spiral.push_back({(1 + a) * std::cos(a), (1 + a) * std::sin(a), 0});
    }
    for (int i = n; i-- > 0;) {
        const float a = 0.02f * float(i);
        spiral.push_back({(2 + a) * std::cos(a), (2 + a) * std::sin(a), 0});
    }
    Triangulator t(10'000'000);
    EXPECT_EQ(t.triangulate(spiral).size(), spiral.size() - 2);
    int rounds = 1;
    for (; rounds < 1000 && t.gave_up() == 0; ++rounds) EXPECT_EQ(t.triangulate(spiral).size(), spiral.size() - 2);
    EXPECT_EQ(t.gave_up(), 1u) << rounds << " rounds";
    EXPECT_EQ(t.triangulate(spiral).size(), spiral.size() - 2);
    EXPECT_EQ(t.gave_up(), 2u);
}

} // namespace
} // namespace porthole
