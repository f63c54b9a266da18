// The pictures that show a model in another way than its surfaces: wireframe, ghost, dim and line.
#include <gtest/gtest.h>

#include <algorithm>

#include "porthole/render/restyle.h"
#include "porthole/render/test_frame.h"
#include "porthole/render/test_scene.h"
#include "porthole/render/wireframe.h"
#include "porthole/trace/visibility.h"

namespace porthole {
namespace {

using test::add_part;
using test::box_mesh;
using test::look_at;
using test::matte;
using test::quad_mesh;
using test::same_color;
using test::sphere_mesh;

/// A line on the picture.
struct Segment {
    Vec2f a, b;
    [[nodiscard]] float length() const { return std::sqrt(dot(b - a, b - a)); }
    [[nodiscard]] float distance(Vec2f p) const {
        const Vec2f d = b - a, off = p - (a + d * clamp01(dot(p - a, d) / dot(d, d)));
        return std::sqrt(dot(off, off));
    }
};

float nearest(const std::vector<Segment>& segments, Vec2f p) {
    float least = kInfinity;
    for (const Segment& s : segments) least = std::min(least, s.distance(p));
    return least;
}

/// The twelve edges of a box on the picture; hidden ones join two faces that look away.
struct BoxEdges {
    std::vector<Segment> visible, hidden;
    BoxEdges(const View& view, Vec3f lower, Vec3f upper) {
        const float lo[3] = {lower.x, lower.y, lower.z}, hi[3] = {upper.x, upper.y, upper.z};
        const Vec3f eye = view.eye(), back = view.world_from_camera.z;
        const float at[3] = {eye.x, eye.y, eye.z}, towards[3] = {back.x, back.y, back.z};
        const auto faces_eye = [&](int axis, bool high) {
            const float sign = high ? 1.0f : -1.0f;
            return (view.orthographic ? towards[axis] : at[axis] - (high ? hi : lo)[axis]) * sign > 0;
        };
        for (int axis = 0; axis < 3; ++axis)
            for (int side = 0; side < 4; ++side) {
                const int u = (axis + 1) % 3, v = (axis + 2) % 3;
                const bool high_u = side & 1, high_v = side & 2;
                float from[3], to[3];
                from[axis] = lo[axis], to[axis] = hi[axis];
                from[u] = to[u] = (high_u ? hi : lo)[u];
                from[v] = to[v] = (high_v ? hi : lo)[v];
                const PixelPoint p = view.project({from[0], from[1], from[2]});
                const PixelPoint q = view.project({to[0], to[1], to[2]});
                (faces_eye(u, high_u) || faces_eye(v, high_v) ? visible : hidden).push_back({{p.x, p.y}, {q.x, q.y}});
            }
    }
};

/// How much of some segments has ink across them, without what lies near their ends or `others`.
struct Coverage {
    int points = 0, inked = 0;
    [[nodiscard]] double share() const { return double(inked) / points; }
};
Coverage coverage(const Image<Vec4f>& color, const std::vector<Segment>& segments, const std::vector<Segment>& others,
                  float dark) {
    Coverage out;
    for (const Segment& s : segments) {
        const float n = s.length();
        const Vec2f along = (s.b - s.a) * (1.0f / n), across{-along.y, along.x};
        for (float t = 6; t < n - 6; t += 1) {
            const Vec2f p = s.a + along * t;
            if (nearest(others, p) < 5) continue;
            ++out.points;
            float most = 0;
            for (const float off : {-1.0f, 0.0f, 1.0f}) {
                const Vec2f q = p + across * off;
                most = std::max(most, color(int(std::floor(q.x)), int(std::floor(q.y))).w);
            }
            out.inked += most > dark;
        }
    }
    return out;
}

/// Pixels with ink that are farther than `reach` from all of some segments.
int strays(const Image<Vec4f>& color, const std::vector<Segment>& segments, float reach) {
    const Rect w = color.window();
    int n = 0;
    for (int y = w.y0; y < w.y1; ++y)
        for (int x = w.x0; x < w.x1; ++x)
            n += color(x, y).w != 0 && nearest(segments, {float(x) + 0.5f, float(y) + 0.5f}) > reach;
    return n;
}

std::vector<Segment> joined(std::vector<Segment> a, const std::vector<Segment>& b) {
    a.insert(a.end(), b.begin(), b.end());
    return a;
}

constexpr Vec3f kLow{-1, -1, -1}, kHigh{1, 1, 1};

/// A cube seen obliquely, in perspective or not.
struct WireCube {
    Scene scene;
    View view;
    MeshBvhs meshes;
    std::vector<PartId> parts;
    explicit WireCube(bool orthographic)
        : scene(cube()), view(look_at({4, 2.3f, 3.1f}, {0, 0, 0}, 240, 200, 0.4f)), meshes(build_mesh_bvhs(scene)),
          parts(all_parts(scene)) {
        view.orthographic = orthographic;
        if (orthographic) view.half_height = 2.1f;
    }
    static Scene cube() {
        Scene s;
        s.materials = {matte({0.7f, 0.7f, 0.7f})};
        add_part(s, box_mesh(kLow, kHigh), "cube");
        return s;
    }
    [[nodiscard]] Frame draw(Wire wire, HiddenLines hidden) const {
        return render_wireframe(meshes, parts, view, WireParams{wire, hidden, 1});
    }
};

TEST(Wireframe, DrawsTheVisibleEdgesOfACubeAndNothingElse) {
    for (const bool orthographic : {false, true}) {
        const WireCube cube(orthographic);
        const BoxEdges edges(cube.view, kLow, kHigh);
        ASSERT_EQ(edges.visible.size(), 9u);
        ASSERT_EQ(edges.hidden.size(), 3u);
        const Frame frame = cube.draw(Wire::feature, HiddenLines::none);
        for (const Segment& edge : edges.visible) {
            const Coverage c = coverage(frame.color, {edge}, {}, 0.4f);
            EXPECT_GT(c.points, 30);
            EXPECT_GE(c.share(), 0.95);
        }
        const Coverage hidden = coverage(frame.color, edges.hidden, edges.visible, 0.1f);
        EXPECT_GT(hidden.points, 80);
        EXPECT_LT(hidden.share(), 0.05);
        EXPECT_EQ(strays(frame.color, edges.visible, 2), 0);
        const PixelPoint face = cube.view.project({1, -0.2f, 0.4f});
        EXPECT_EQ(frame.ids.id(int(face.x), int(face.y)), cube.parts[0]);
    }
}

TEST(Wireframe, DashesTheHiddenEdgesOfACube) {
    for (const bool orthographic : {false, true}) {
        const WireCube cube(orthographic);
        const BoxEdges edges(cube.view, kLow, kHigh);
        const Frame frame = cube.draw(Wire::feature, HiddenLines::dashed);
        EXPECT_GE(coverage(frame.color, edges.visible, {}, 0.4f).share(), 0.95);
        for (const Segment& edge : edges.hidden) {
            // An edge has room for a few dashes only, so its own share varies.
            const Coverage c = coverage(frame.color, {edge}, edges.visible, 0.1f);
            EXPECT_GT(c.points, 20);
            EXPECT_GT(c.share(), 0.3);
            EXPECT_LT(c.share(), 0.9);
        }
        const Coverage all = coverage(frame.color, edges.hidden, edges.visible, 0.1f);
        EXPECT_GT(all.share(), 0.3);
        EXPECT_LT(all.share(), 0.8);
        EXPECT_EQ(strays(frame.color, joined(edges.visible, edges.hidden), 2), 0);
    }
}

TEST(Wireframe, DrawsDiagonalsOfTheMeshOnly) {
    const WireCube cube(false);
    const auto at = [&](Vec3f p) {
        const PixelPoint q = cube.view.project(p);
        return Vec2f{q.x, q.y};
    };
    // As box_mesh() splits the three faces towards the eye.
    const std::vector<Segment> diagonals = {
        {at({1, -1, -1}), at({1, 1, 1})}, {at({-1, 1, -1}), at({1, 1, 1})}, {at({-1, -1, 1}), at({1, 1, 1})}};
    const BoxEdges edges(cube.view, kLow, kHigh);
    const Frame mesh = cube.draw(Wire::mesh, HiddenLines::none);
    const Frame feature = cube.draw(Wire::feature, HiddenLines::none);
    // Thinner than features: where one runs through the corner of four pixels each has a third of it.
    EXPECT_GE(coverage(mesh.color, diagonals, edges.visible, 0.3f).share(), 0.95);
    EXPECT_EQ(coverage(feature.color, diagonals, edges.visible, 0).inked, 0);
    EXPECT_EQ(strays(mesh.color, joined(edges.visible, diagonals), 2), 0);
}

/// Whether a test holds for a pixel and all within `reach` of it that the picture has.
template <typename Test> bool all_near(const IdBuffer& ids, int x, int y, int reach, const Test& test) {
    for (int dy = -reach; dy <= reach; ++dy)
        for (int dx = -reach; dx <= reach; ++dx)
            if (ids.id.contains(x + dx, y + dy) && !test(ids.id(x + dx, y + dy))) return false;
    return true;
}

float greatest_change(Vec4f a, Vec4f b) {
    return std::max({std::abs(a.x - b.x), std::abs(a.y - b.y), std::abs(a.z - b.z), std::abs(a.w - b.w)});
}

/// A target in a shell, right behind its nearest edge, a post in front of it, a wall behind it that does not reach
/// everywhere.
struct Shelled {
    Scene scene;
    PartId target, shell, post, wall;
    View view = look_at({2.2f, 1.7f, 4.4f}, {0, 0, 0}, 240, 200, 0.45f);
    RenderParams params;
    explicit Shelled(bool round) {
        scene.materials = {matte({0.8f, 0.3f, 0.1f}), matte({0.3f, 0.4f, 0.7f}), matte({0.5f, 0.5f, 0.5f})};
        target = add_part(scene, box_mesh({0.1f, -0.4f, 0}, {0.8f, 0.4f, 0.6f}, 0), "target");
        shell = add_part(scene, round ? sphere_mesh({0, 0, 0}, 1.1f, 32, 1) : box_mesh(kLow, kHigh, 1), "shell");
        post = add_part(scene, box_mesh({1.25f, -2, 1.2f}, {1.4f, 2, 1.35f}, 2), "post");
        wall = add_part(scene, quad_mesh({-4, -3, -2}, {3, 0, 0}, {0, 6, 0}, 2), "wall");
    }
};

/// The picture before and after its shell is laid over it, and what of the shell would be seen alone.
struct Ghosted {
    Shelled model;
    MeshBvhs meshes;
    IdBuffer shell_alone;
    Frame before, after;
    Ghosted(bool round, Lines lines) : model(round), meshes(build_mesh_bvhs(model.scene)) {
        model.params.lines = lines;
        const std::vector<PartId> solids = {model.target, model.post, model.wall};
        const Bvh solid = build_bvh(meshes, solids);
        const Bvh targets = build_bvh(meshes, std::span(&model.target, 1));
        const Bvh shell = build_bvh(meshes, std::span(&model.shell, 1));
        shell_alone = trace_ids(shell, model.view, model.view.window());
        before = render(solid, nullptr, model.view, model.params, nullptr, nullptr);
        after = before;
        lay_shell(after, {solid, &targets, nullptr, nullptr, model.view, model.params}, shell);
    }
};

constexpr float kShellMost = 0.62f; ///< greatest alpha of the veil

TEST(Ghost, LeavesTargetsWhatIsInFrontAndWhatIsBeside) {
    for (const bool round : {false, true}) {
        const Ghosted g(round, Lines::all);
        const Shelled& m = g.model;
        int on_target = 0, in_front = 0, beside = 0, veiled = 0, over_wall = 0;
        for (int y = 0; y < m.view.height; ++y)
            for (int x = 0; x < m.view.width; ++x) {
                const Vec4f was = g.before.color(x, y), is = g.after.color(x, y);
                const PartId id = g.before.ids.id(x, y);
                const bool only_this = all_near(g.before.ids, x, y, 1, [&](PartId p) { return p == id; });
                const bool covered = g.shell_alone.id(x, y) == m.shell;
                EXPECT_EQ(g.after.ids.id(x, y), id == kNoPart && covered ? m.shell : id) << x << ' ' << y;
                if (id == m.target) {
                    EXPECT_LT(greatest_change(was, is), kShellMost) << x << ' ' << y;
                    if (!only_this) continue;
                    ++on_target;
                    EXPECT_TRUE(same_color(was, is)) << x << ' ' << y;
                } else if (id == m.post) {
                    // The shell's lines are laid half a pixel to either side of where it ends.
                    if (!all_near(g.before.ids, x, y, 2, [&](PartId p) { return p == id; })) continue;
                    ++in_front;
                    EXPECT_TRUE(same_color(was, is)) << x << ' ' << y;
                } else if (all_near(g.shell_alone, x, y, 2, [](PartId p) { return p == kNoPart; })) {
                    ++beside;
                    EXPECT_TRUE(same_color(was, is)) << x << ' ' << y;
                } else if (covered && only_this) {
                    (id == m.wall ? over_wall : veiled) += 1;
                    EXPECT_FALSE(same_color(was, is)) << x << ' ' << y;
                }
            }
        EXPECT_GT(on_target, 300);
        EXPECT_GT(in_front, 300);
        EXPECT_GT(beside, 5000);
        EXPECT_GT(veiled, 1000);
        EXPECT_GT(over_wall, 300);
    }
}

/// Mean alpha of what the shell covers alone: within 3 px of its outline, and farther than 15.
struct Opacity {
    double edge = 0, middle = 0;
    int edge_pixels = 0, middle_pixels = 0;
};
Opacity opacity(const Ghosted& g) {
    Opacity o;
    const Shelled& m = g.model;
    const auto is_shell = [&](PartId p) { return p == m.shell; };
    for (int y = 0; y < m.view.height; ++y)
        for (int x = 0; x < m.view.width; ++x) {
            if (g.shell_alone.id(x, y) != m.shell) continue;
            if (!all_near(g.before.ids, x, y, 3, [](PartId p) { return p == kNoPart; })) continue;
            const double alpha = double(g.after.color(x, y).w);
            if (all_near(g.shell_alone, x, y, 15, is_shell))
                o.middle += alpha, ++o.middle_pixels;
            else if (!all_near(g.shell_alone, x, y, 3, is_shell))
                o.edge += alpha, ++o.edge_pixels;
        }
    o.edge /= o.edge_pixels, o.middle /= o.middle_pixels;
    return o;
}

TEST(Ghost, IsDenserAtItsOutlineThanInItsMiddle) {
    // With lines whatever its form; without them where it turns away from the eye.
    for (const bool round : {false, true}) {
        const Opacity o = opacity(Ghosted(round, Lines::all));
        EXPECT_GT(o.edge_pixels, 100);
        EXPECT_GT(o.middle_pixels, 100);
        EXPECT_GT(o.edge, o.middle + 0.1) << round;
        EXPECT_LT(o.middle, 0.4) << round;
    }
    const Opacity veil = opacity(Ghosted(true, Lines::none));
    EXPECT_GT(veil.edge, veil.middle + 0.1);
    EXPECT_LT(veil.edge, double(kShellMost));
    EXPECT_GT(veil.middle, 0.05);
}

/// A part at rest; a target and a part that is kept in front of it, a target and a wall behind it.
struct Resting {
    static constexpr Vec3f kRestLow{-1.2f, -0.8f, -1}, kRestHigh{1.2f, 0.8f, 0.2f};
    Scene scene;
    PartId target{0}, behind{1}, kept{2}, rest{3};
    View view = look_at({2.4f, 1.8f, 4.4f}, {0, 0, 0}, 240, 200, 0.45f);
    RenderParams params;
    MeshBvhs meshes;
    Bvh all, targets;
    Frame before;
    std::vector<std::uint8_t> is_rest;
    Resting()
        : scene(build()), meshes(build_mesh_bvhs(scene)), all(build_bvh(meshes, all_parts(scene))),
          targets(build_bvh(meshes, std::vector{target, behind})) {
        params.lines = Lines::none;
        before = render(all, nullptr, view, params, nullptr, nullptr);
        is_rest.assign(scene.parts.size(), 0);
        is_rest[index(rest)] = 1;
    }
    static Scene build() {
        Scene s;
        s.materials = {matte({0.8f, 0.3f, 0.1f}), matte({0.2f, 0.6f, 0.3f}), matte({0.2f, 0.3f, 0.8f}),
                       matte({0.5f, 0.5f, 0.5f})};
        add_part(s, box_mesh({-0.9f, -0.3f, 0.5f}, {-0.3f, 0.3f, 1}, 0), "target");
        add_part(s, box_mesh({-0.6f, 0, -1.8f}, {0.3f, 1.3f, -1.3f}, 0), "behind");
        add_part(s, box_mesh({0.6f, -1.4f, 0.5f}, {0.9f, 0.3f, 0.8f}, 1), "kept");
        add_part(s, box_mesh(kRestLow, kRestHigh, 2), "rest");
        add_part(s, quad_mesh({-4, -3, -2}, {4, 0, 0}, {0, 6, 0}, 3), "wall");
        return s;
    }
    [[nodiscard]] Frame restyled(Rest style) const {
        Frame frame = before;
        restyle(frame, {all, &targets, nullptr, nullptr, view, params}, is_rest, style);
        return frame;
    }
};

TEST(Restyle, DimMakesTheRestPalerAndLeavesAllElse) {
    const Resting m;
    const Frame dim = m.restyled(Rest::dim);
    EXPECT_EQ(dim.ids.id, m.before.ids.id);
    const auto is_rest = [&](PartId p) { return p == m.rest; };
    int inside = 0, elsewhere = 0;
    for (int y = 0; y < m.view.height; ++y)
        for (int x = 0; x < m.view.width; ++x) {
            const Vec4f was = m.before.color(x, y), is = dim.color(x, y);
            if (all_near(dim.ids, x, y, 1, is_rest)) {
                ++inside;
                const float grey = 0.2126f * was.x + 0.7152f * was.y + 0.0722f * was.z;
                const auto dimmed = [&](float c, float pale) {
                    return 0.75f * (grey + 0.55f * (c - grey)) + 0.25f * pale;
                };
                EXPECT_NEAR(is.x, dimmed(was.x, 0.72f), 1e-5f) << x << ' ' << y;
                EXPECT_NEAR(is.y, dimmed(was.y, 0.72f), 1e-5f) << x << ' ' << y;
                EXPECT_NEAR(is.z, dimmed(was.z, 0.74f), 1e-5f) << x << ' ' << y;
                EXPECT_NEAR(is.w, was.w, 1e-6f);
            } else if (all_near(dim.ids, x, y, 1, [&](PartId p) { return !is_rest(p); })) {
                ++elsewhere;
                EXPECT_TRUE(same_color(was, is)) << x << ' ' << y;
            }
        }
    EXPECT_GT(inside, 3000);
    EXPECT_GT(elsewhere, 10000);
}

TEST(Restyle, LineLeavesTheOutlinesOfTheRestAlone) {
    const Resting m;
    const Frame line = m.restyled(Rest::line);
    EXPECT_EQ(line.ids.id, m.before.ids.id);
    const std::vector<Segment> edges = BoxEdges(m.view, Resting::kRestLow, Resting::kRestHigh).visible;
    const auto is_rest = [&](PartId p) { return p == m.rest; };
    // Lines reach a pixel beyond the rest, of which pixel centres miss the tips.
    constexpr int kFine = 4;
    View fine_view = m.view;
    fine_view.width *= kFine, fine_view.height *= kFine;
    const IdBuffer fine = trace_ids(m.all, fine_view, fine_view.window());
    int inside = 0, elsewhere = 0, target_beside = 0, points = 0, inked = 0;
    for (int y = 0; y < m.view.height; ++y)
        for (int x = 0; x < m.view.width; ++x) {
            const Vec4f was = m.before.color(x, y), is = line.color(x, y);
            if (all_near(line.ids, x, y, 1, is_rest)) {
                const float from_edge = nearest(edges, {float(x) + 0.5f, float(y) + 0.5f});
                if (from_edge > 2) {
                    ++inside;
                    EXPECT_TRUE(same_color(is, Vec4f{})) << x << ' ' << y;
                } else if (from_edge < 0.5f) {
                    ++points;
                    inked += is.w > 0.1f;
                    // Nothing of the surface is left under a line.
                    EXPECT_LE(is.x + is.y + is.z, 1e-6f) << x << ' ' << y;
                }
            } else if (all_near(fine, kFine * x + kFine / 2, kFine * y + kFine / 2, 2 * kFine,
                                [&](PartId p) { return !is_rest(p); })) {
                ++elsewhere;
                EXPECT_TRUE(same_color(was, is)) << x << ' ' << y;
            } else if (all_near(fine, kFine * x + kFine / 2, kFine * y + kFine / 2, 3,
                                [&](PartId p) { return p == m.target || p == m.behind; })) {
                ++target_beside;
                EXPECT_TRUE(same_color(was, is)) << x << ' ' << y;
            }
        }
    EXPECT_GT(inside, 2500);
    EXPECT_GT(elsewhere, 10000);
    EXPECT_GT(target_beside, 20);
    EXPECT_GT(points, 100);
    EXPECT_GE(inked, points * 95 / 100);
}

TEST(Restyle, KeepAndGhostChangeNothing) {
    const Resting m;
    for (const Rest style : {Rest::keep, Rest::ghost}) EXPECT_EQ(m.restyled(style).color, m.before.color);
}

} // namespace
} // namespace porthole
