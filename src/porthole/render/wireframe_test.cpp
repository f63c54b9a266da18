#include "porthole/render/wireframe.h"

#include <gtest/gtest.h>

#include "porthole/render/test_scene.h"

namespace porthole {
namespace {

using test::add_part;
using test::box_mesh;
using test::look_at;
using test::matte;
using test::quad_mesh;
using test::sphere_mesh;

Frame wires(const Scene& scene, const View& view, const WireParams& params, Vec3f background = {1, 1, 1}) {
    const MeshBvhs meshes = build_mesh_bvhs(scene);
    return render_wireframe(meshes, all_parts(scene), view, params, background);
}

/// Share of an edge's length, without its ends, that is drawn; and how dark the darkest is.
struct EdgeInk {
    double share = 0;
    float darkest = 0;
};
struct CubeEdge {
    Vec3f a, b;
    bool hidden;
};
/// @param others  lines that are looked away from where they come near.
EdgeInk ink_along(const Frame& frame, const View& view, Vec3f a, Vec3f b, const std::vector<CubeEdge>& others = {}) {
    const PixelPoint p = view.project(a), q = view.project(b);
    EdgeInk ink;
    int n = 0, drawn = 0;
    const double length = std::hypot(double(q.x - p.x), double(q.y - p.y));
    for (double s = 5; s < length - 5; s += 0.25) {
        const float t = float(s / length);
        const Vec2f at{p.x + (q.x - p.x) * t, p.y + (q.y - p.y) * t};
        bool near_other = false;
        for (const CubeEdge& e : others) {
            const PixelPoint u = view.project(e.a), v = view.project(e.b);
            const Vec2f from{u.x, u.y}, along = Vec2f{v.x, v.y} - from;
            const Vec2f off = at - (from + along * clamp01(dot(at - from, along) / dot(along, along)));
            near_other |= (e.a != a || e.b != b) && dot(off, off) < 9;
        }
        if (near_other) continue;
        const float alpha = frame.color(int(std::floor(at.x)), int(std::floor(at.y))).w;
        ink.darkest = std::max(ink.darkest, alpha);
        drawn += alpha > 0.12f;
        ++n;
    }
    ink.share = double(drawn) / n;
    return ink;
}

/// Edges of the cube [-1, 1]^3 seen from the octant of `eye`: those at the far corner are hidden.
std::vector<CubeEdge> cube_edges(Vec3f eye) {
    std::vector<CubeEdge> edges;
    for (int i = 0; i < 8; ++i)
        for (int axis = 0; axis < 3; ++axis) {
            if (i >> axis & 1) continue;
            const auto corner = [](int k) { return Vec3f{k & 1 ? 1.f : -1.f, k & 2 ? 1.f : -1.f, k & 4 ? 1.f : -1.f}; };
            const Vec3f a = corner(i), b = corner(i | 1 << axis);
            bool hidden = true;
            for (int other = 0; other < 3; ++other)
                if (other != axis && a[other] * eye[other] > 0) hidden = false;
            edges.push_back({a, b, hidden});
        }
    return edges;
}

struct Cube {
    Scene scene;
    Vec3f eye{3.1f, 2.3f, 4};
    View view;
    Cube() {
        scene.materials = {matte({0.7f, 0.7f, 0.7f})};
        add_part(scene, box_mesh({-1, -1, -1}, {1, 1, 1}), "cube");
        view = look_at(eye, {0, 0, 0}, 240, 200, 0.42f);
    }
};

TEST(Wireframe, AllVisibleEdgesOfACubeAreDrawnAndNoHiddenOne) {
    Cube c;
    for (const bool orthographic : {false, true}) {
        c.view.orthographic = orthographic;
        if (orthographic) c.view.half_height = 2;
        const Frame frame = wires(c.scene, c.view, {.wire = Wire::feature});
        int hidden = 0;
        for (const CubeEdge& e : cube_edges(c.eye)) {
            const EdgeInk ink = ink_along(frame, c.view, e.a, e.b, cube_edges(c.eye));
            hidden += e.hidden;
            EXPECT_EQ(ink.share, e.hidden ? 0 : 1) << orthographic;
            if (!e.hidden) {
                EXPECT_GT(ink.darkest, 0.6f);
            }
        }
        EXPECT_EQ(hidden, 3);
        // Nothing but edges: the diagonals of the faces are no features, and there is no fill.
        EXPECT_EQ(ink_along(frame, c.view, {-0.8f, -0.9f, 1}, {0.8f, 0.7f, 1}).share, 0);
    }
}

TEST(Wireframe, HiddenEdgesAreDashedAndFainter) {
    const Cube c;
    const Frame frame = wires(c.scene, c.view, {.wire = Wire::feature, .hidden = HiddenLines::dashed});
    for (const CubeEdge& e : cube_edges(c.eye)) {
        const EdgeInk ink = ink_along(frame, c.view, e.a, e.b, cube_edges(c.eye));
        if (e.hidden) {
            EXPECT_GT(ink.share, 0.5);
            EXPECT_LT(ink.share, 0.85);
            EXPECT_GT(ink.darkest, 0.2f);
            EXPECT_LT(ink.darkest, 0.55f);
        } else {
            EXPECT_EQ(ink.share, 1);
        }
    }
}

TEST(Wireframe, ATetrahedronShowsItsEdgesWhateverItsWinding) {
    const Vec3f corner[4] = {{1, 1, 1}, {-1, -1, 1}, {-1, 1, -1}, {1, -1, -1}};
    for (const bool inside_out : {false, true}) {
        Scene scene;
        scene.materials = {matte({0.7f, 0.7f, 0.7f})};
        Mesh mesh;
        mesh.positions.assign(corner, corner + 4);
        mesh.triangles = {{0, 2, 1}, {0, 1, 3}, {0, 3, 2}, {1, 2, 3}};
        if (inside_out)
            for (Vec3u& t : mesh.triangles) std::swap(t.y, t.z);
        mesh.submeshes = {{0, 4, 0}};
        add_part(scene, std::move(mesh), "tetrahedron");
        // Straight at the middle of one edge: the opposite one lies behind.
        const View view = look_at({0, 0, 6}, {0, 0, 0}, 200, 200, 0.3f);
        for (const HiddenLines hidden : {HiddenLines::none, HiddenLines::dashed}) {
            const Frame frame = wires(scene, view, {.wire = Wire::mesh, .hidden = hidden});
            for (int i = 0; i < 4; ++i)
                for (int j = i + 1; j < 4; ++j) {
                    if (i == 2 && j == 3) continue;
                    const EdgeInk ink = ink_along(frame, view, corner[i], corner[j]);
                    EXPECT_EQ(ink.share, 1) << i << j;
                }
            // The edge behind, apart from where it crosses the one in front.
            const Vec3f a = corner[2], b = corner[3];
            for (const auto& [from, to] : {std::pair{a, lerp(a, b, 0.47f)}, std::pair{lerp(a, b, 0.53f), b}}) {
                const EdgeInk ink = ink_along(frame, view, from, to);
                if (hidden == HiddenLines::none) {
                    EXPECT_EQ(ink.share, 0);
                } else {
                    EXPECT_NEAR(ink.share, 0.65, 0.2);
                }
            }
        }
    }
}

TEST(Wireframe, MeshMeansEveryEdgeAndAutomaticGoesByTheirLength) {
    Cube c;
    const auto diagonal = [&](const WireParams& params) {
        // Of the face z = 1: from (-1, -1) to (1, 1).
        return ink_along(wires(c.scene, c.view, params), c.view, {-1, -1, 1}, {1, 1, 1}, cube_edges(c.eye)).share;
    };
    EXPECT_EQ(diagonal({.wire = Wire::mesh}), 1);
    EXPECT_EQ(diagonal({.wire = Wire::feature}), 0);
    EXPECT_EQ(diagonal({.wire = Wire::automatic}), 1);
    EXPECT_EQ(diagonal({.wire = Wire::automatic, .hidden = HiddenLines::dashed}), 0);

    // A ball of 130 rows: its edges are two pixels long.
    Scene ball;
    ball.materials = {matte({0.7f, 0.7f, 0.7f})};
    add_part(ball, sphere_mesh({0, 0, 0}, 1, 130), "ball");
    const View view = look_at({0, 0, 6}, {0, 0, 0}, 160, 160, 0.25f);
    const Frame frame = wires(ball, view, {.wire = Wire::automatic});
    EXPECT_EQ(frame.color, wires(ball, view, {.wire = Wire::feature}).color);
    for (int y = 45; y < 115; ++y)
        for (int x = 45; x < 115; ++x) EXPECT_EQ(frame.color(x, y).w, 0) << x << ' ' << y;
    double outline = 0;
    for (const Vec4f& p : frame.color.pixels()) outline += double(p.w);
    // The outline's circle, a quarter wider than a pixel and nine tenths dark.
    const double radius = 80 * std::tan(std::asin(1.0 / 6)) / 0.25;
    EXPECT_NEAR(outline, 2 * 3.14159 * radius * 1.25 * 0.9, 0.1 * outline);
}

TEST(Wireframe, EdgesBehindOtherPartsAreHiddenAndThoseOnAnOpenSheetAreNot) {
    Scene scene;
    scene.materials = {matte({0.7f, 0.7f, 0.7f})};
    add_part(scene, quad_mesh({-1, -1, 0}, {2, 0, 0}, {0, 2, 0}), "sheet");
    add_part(scene, quad_mesh({-0.2f, -1.5f, 1}, {0.4f, 0, 0}, {0, 3, 0}), "strip");
    const View view = look_at({0, 0, 6}, {0, 0, 0}, 200, 200, 0.3f);
    const Frame frame = wires(scene, view, {.wire = Wire::feature});
    for (const float y : {-1.0f, 1.0f}) {
        EXPECT_EQ(ink_along(frame, view, {-1, y, 0}, {-0.3f, y, 0}).share, 1);
        EXPECT_EQ(ink_along(frame, view, {-0.2f, y, 0}, {0.2f, y, 0}).share, 0);
        EXPECT_EQ(ink_along(frame, view, {0.3f, y, 0}, {1, y, 0}).share, 1);
    }
    EXPECT_EQ(frame.ids.id(100, 100), PartId{1});
}

TEST(Wireframe, LinesAreLightOnADarkBackgroundAndThreadsDoNotMatter) {
    const Cube c;
    const MeshBvhs meshes = build_mesh_bvhs(c.scene);
    const auto draw = [&](Vec3f background, int threads) {
        Control control;
        control.threads = threads;
        return render_wireframe(meshes, all_parts(c.scene), c.view, {.wire = Wire::mesh, .hidden = HiddenLines::dashed},
                                background, control);
    };
    const auto brightest = [](const Frame& frame) {
        float b = 0;
        for (const Vec4f& p : frame.color.pixels()) b = std::max(b, p.x);
        return b;
    };
    EXPECT_GT(brightest(draw({0, 0, 0}, 1)), 0.5f);
    EXPECT_LT(brightest(draw({1, 1, 1}, 1)), 0.05f);
    EXPECT_EQ(draw({1, 1, 1}, 1).color, draw({1, 1, 1}, 3).color);
}

TEST(Wireframe, TheNearPlaneAndBadWidthsDoNotHurt) {
    // The eye inside a large box: edges run past it.
    Scene scene;
    scene.materials = {matte({0.7f, 0.7f, 0.7f})};
    add_part(scene, box_mesh({-1, -1, -1}, {1, 1, 1}), "room");
    const View view = look_at({0, 0, 0.5f}, {0, 0, 0}, 160, 120, 0.9f);
    const Frame frame = wires(scene, view, {.wire = Wire::feature});
    EXPECT_EQ(ink_along(frame, view, {-1, -1, -1}, {1, -1, -1}).share, 1);
    for (const Vec4f& p : frame.color.pixels()) {
        EXPECT_GE(p.w, 0);
        EXPECT_LE(p.w, 0.91f);
    }
    for (const float width : {0.0f, -1.0f, 101.0f, std::numeric_limits<float>::quiet_NaN()})
        EXPECT_THROW(wires(scene, view, {.wire = Wire::mesh, .width_px = width}), Error);
}

} // namespace
} // namespace porthole
