// Caps against what the geometry says: boxes whose inside is known to the last coordinate.
#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <optional>

#include "porthole/trace/caps.h"
#include "support/shapes.h"

namespace porthole {
namespace {

/// An axis-aligned box in world coordinates, or a cavity in one.
struct Block {
    Vec3d lower, upper;
    /// Where the ray goes in and out.
    [[nodiscard]] std::optional<Vec2d> span(Vec3d origin, Vec3d direction) const {
        double in = -1e300, out = 1e300;
        for (int i = 0; i < 3; ++i) {
            const double a = (lower[i] - origin[i]) / direction[i], b = (upper[i] - origin[i]) / direction[i];
            in = std::max(in, std::min(a, b));
            out = std::min(out, std::max(a, b));
        }
        if (!(in < out)) return std::nullopt;
        return Vec2d{in, out};
    }
};

void add_block(Mesh& mesh, const Block& b, bool inside_out = false) {
    const Mesh cube = test::cube();
    const auto n = std::uint32_t(mesh.positions.size());
    for (const Vec3f p : cube.positions)
        mesh.positions.push_back(Vec3f(b.lower + (b.upper - b.lower) * (Vec3d(p) * 0.5 + Vec3d{0.5, 0.5, 0.5})));
    for (const Vec3u t : cube.triangles)
        mesh.triangles.push_back(inside_out ? Vec3u{t.x + n, t.z + n, t.y + n} : Vec3u{t.x + n, t.y + n, t.z + n});
}

/// A part made of blocks, with what it takes to know its inside.
struct Body {
    std::vector<Block> blocks;
    std::vector<Block> cavities;
    CapRule rule = CapRule::solid;
    std::size_t level = 0;
    bool wound_inside_out = false, cavity_wound_outward = false, mirrored = false;

    [[nodiscard]] bool holds(Vec3d origin, Vec3d direction, double t) const {
        const auto in = [&](const Block& b) {
            const auto s = b.span(origin, direction);
            return s && s->x < t && t < s->y;
        };
        for (const Block& c : cavities)
            if (in(c)) return false;
        for (const Block& b : blocks)
            if (in(b)) return true;
        return false;
    }
    /// Where on the way to t, inside, the ray went into the part for the last time.
    [[nodiscard]] double entered(Vec3d origin, Vec3d direction, double t) const {
        // Inside several blocks it counts as entered with the first of the unbroken run.
        double entry = t;
        for (bool moved = true; moved;) {
            moved = false;
            for (const Block& b : blocks)
                if (const auto s = b.span(origin, direction); s && s->x < entry && s->y >= entry) {
                    double in = s->x;
                    for (const Block& c : cavities)
                        if (const auto k = c.span(origin, direction); k && k->y < entry) in = std::max(in, k->y);
                    if (in < entry) entry = in, moved = true;
                }
        }
        return entry;
    }
};

struct Bench {
    Scene scene;
    std::vector<Body> bodies;
    std::vector<MeshSolid> solids;
    Cut cut;

    explicit Bench(std::vector<Body> all) : bodies(std::move(all)) {
        scene.materials.emplace_back();
        for (const Body& body : bodies) {
            Mesh mesh;
            Affine3d placement;
            if (body.mirrored) placement.x.x = -1;
            const auto placed = [&](Block b) {
                if (body.mirrored) {
                    std::swap(b.lower.x, b.upper.x);
                    b.lower.x = -b.lower.x, b.upper.x = -b.upper.x;
                }
                return b;
            };
            for (const Block& b : body.blocks) add_block(mesh, placed(b), body.wound_inside_out);
            for (const Block& c : body.cavities) add_block(mesh, placed(c), !body.cavity_wound_outward);
            scene.meshes.push_back(test::finished(std::move(mesh)));
            scene.parts.push_back({"body", "body" + std::to_string(scene.parts.size()),
                                   std::uint32_t(scene.meshes.size() - 1), placement});
            cut.role.push_back(CutRole::cut_set);
            cut.cap.push_back(body.rule);
            cut.level.push_back(std::uint8_t(body.level));
        }
        solids = find_solids(scene);
        cut.view = test::look({2.1f, 1.7f, 6.3f}, {0.05f, -0.03f, 0}, 160, 120, 0.32f);
        // A disc-shaped hole; its depth rises and falls, so that caps lie everywhere.
        const Rect window{20, 10, 140, 110};
        cut.distance = Image<float>(window);
        cut.loose_depth = Image<float>(window, -kInfinity);
        cut.levels.assign(2, CutLevel(window));
        for (int y = window.y0; y < window.y1; ++y)
            for (int x = window.x0; x < window.x1; ++x) {
                const float d = std::hypot(float(x) - 80, float(y) - 60) - 48;
                cut.distance(x, y) = d;
                if (d > 0) continue;
                const float depth = 6.6f + 0.9f * std::sin(0.11f * float(x)) + 0.4f * std::cos(0.07f * float(y));
                cut.levels[0](x, y) = {0, depth - 0.5f, 0.05f, 12, depth};
                cut.levels[1](x, y) = {10, depth - 0.2f, 0.02f, 6, depth + 0.3f};
            }
    }

    /// Caps at pixel centres as the geometry has them.
    [[nodiscard]] Image<PartId> expected(std::size_t level) const {
        Image<PartId> caps(cut.distance.window(), kNoPart);
        const Rect w = caps.window();
        for (int y = w.y0; y < w.y1; ++y)
            for (int x = w.x0; x < w.x1; ++x) {
                if (cut.distance(x, y) > 0) continue;
                const CutDepth d = cut.depth_at(float(x) + 0.5f, float(y) + 0.5f, level);
                if (d.depth == -kInfinity) continue;
                const Ray ray = cut.view.ray(float(x) + 0.5f, float(y) + 0.5f);
                const double t = double(d.depth) / double(ray.depth_per_t);
                double last = -1e300;
                for (std::size_t i = 0; i < bodies.size(); ++i) {
                    const Body& body = bodies[i];
                    if (body.level != level || body.rule == CapRule::none) continue;
                    if (body.rule == CapRule::shell && !d.chamfer) continue;
                    if (!body.holds(Vec3d(ray.origin), Vec3d(ray.direction), t)) continue;
                    const double entered = body.entered(Vec3d(ray.origin), Vec3d(ray.direction), t);
                    if (entered > last) last = entered, caps(x, y) = PartId{std::uint32_t(i)};
                }
            }
        return caps;
    }
};

/// Pixels with a neighbour that the geometry gives another cap.
bool near_edge(const Image<PartId>& caps, int x, int y) {
    for (int dy = -1; dy <= 1; ++dy)
        for (int dx = -1; dx <= 1; ++dx)
            if (caps.at_or(x + dx, y + dy, kNoPart) != caps(x, y)) return true;
    return false;
}

/// @return pixels with a cap.
int expect_caps(const Bench& bench) {
    const MeshBvhs meshes = build_mesh_bvhs(bench.scene);
    const Bvh bvh = build_bvh(meshes, all_parts(bench.scene), bench.cut.role, bench.cut.level);
    const Caps caps = trace_caps(bvh, bench.cut, bench.solids);
    int capped = 0;
    for (std::size_t level = 0; level < 2; ++level) {
        const Image<PartId> expected = bench.expected(level);
        const Rect w = expected.window();
        int wrong = 0;
        for (int y = w.y0; y < w.y1; ++y)
            for (int x = w.x0; x < w.x1; ++x) {
                capped += expected(x, y) != kNoPart;
                if (near_edge(expected, x, y)) continue;
                wrong += caps.at(level, x, y).part != expected(x, y);
            }
        EXPECT_EQ(wrong, 0) << "level " << level;
    }
    return capped;
}

const Block kLarge{{-1.5, -1.2, -1.1}, {1.4, 1.3, 1.2}};
const Block kSmall{{-0.6, -0.5, -0.4}, {0.7, 0.4, 0.5}};

TEST(Caps, OfASolidBlock) { EXPECT_GT(expect_caps(Bench({{.blocks = {kLarge}}})), 3000); }

TEST(Caps, TheInnerOfTwoNestedSolidsWins) {
    const Bench bench({{.blocks = {kLarge}}, {.blocks = {kSmall}}});
    EXPECT_GT(expect_caps(bench), 3000);
    const Image<PartId> caps = bench.expected(0);
    EXPECT_GT(std::count(caps.pixels().begin(), caps.pixels().end(), PartId{1}), 300);
}

TEST(Caps, OfADoubleShell) {
    // A wall of its own material around a cavity, whichever way the file winds the two skins.
    for (const bool outward : {false, true})
        for (const bool inside_out : {false, true})
            EXPECT_GT(expect_caps(Bench({{.blocks = {kLarge},
                                          .cavities = {kSmall},
                                          .wound_inside_out = inside_out,
                                          .cavity_wound_outward = outward}})),
                      3000)
                << outward << inside_out;
}

TEST(Caps, OfAMirroredPart) {
    EXPECT_GT(expect_caps(Bench({{.blocks = {kLarge}, .cavities = {kSmall}, .mirrored = true}})), 3000);
}

TEST(Caps, OfSolidsThatInterpenetrate) {
    const Block other{{-0.2, -1.5, -0.9}, {1.9, 0.3, 1.6}};
    EXPECT_GT(expect_caps(Bench({{.blocks = {kLarge}}, {.blocks = {other}}})), 3000);
    // The same as one mesh: inside both is inside.
    EXPECT_GT(expect_caps(Bench({{.blocks = {kLarge, other}}})), 3000);
}

TEST(Caps, OfSolidsThatShareAFace) {
    const Block left{{-1.5, -1.2, -1.1}, {0.1, 1.3, 1.2}}, right{{0.1, -1.2, -1.1}, {1.4, 1.3, 1.2}};
    EXPECT_GT(expect_caps(Bench({{.blocks = {left}}, {.blocks = {right}}})), 3000);
}

TEST(Caps, OfAShellOnTheChamferOnly) {
    const Bench bench({{.blocks = {kLarge}, .rule = CapRule::shell}});
    const int capped = expect_caps(bench);
    EXPECT_GT(capped, 500);
    EXPECT_LT(capped, 4000);
}

TEST(Caps, NoneOfAnOpenPart) { EXPECT_EQ(expect_caps(Bench({{.blocks = {kLarge}, .rule = CapRule::none}})), 0); }

TEST(Caps, NoneBehindAGapOfAPartThatIsClosedByMostRays) {
    Bench bench({{.blocks = {kLarge}}});
    // The face away from the eye is gone: no ray that goes in comes out again.
    Mesh& mesh = bench.scene.meshes[0];
    std::erase_if(mesh.triangles, [&](Vec3u t) {
        const auto far = [&](std::uint32_t v) { return mesh.positions[v].z == float(kLarge.lower.z); };
        return far(t.x) && far(t.y) && far(t.z);
    });
    mesh.submeshes[0].triangle_count = std::uint32_t(mesh.triangles.size());
    MeshSolid& solid = bench.solids[0];
    solid.by = ClosedBy::rays;
    solid.lines = 300, solid.balanced_lines = 290;
    const MeshBvhs meshes = build_mesh_bvhs(bench.scene);
    const Bvh bvh = build_bvh(meshes, all_parts(bench.scene), bench.cut.role, bench.cut.level);
    const auto capped = [&] {
        int n = 0;
        const Caps caps = trace_caps(bvh, bench.cut, bench.solids);
        for (const SurfaceRef& s : caps.levels[0].pixels()) n += s.part != kNoPart;
        return n;
    };
    const int guarded = capped();
    solid.balanced_lines = 300; // as if no ray had found the gap
    EXPECT_LT(guarded, capped() / 4);
}

TEST(Caps, OfTwoLevels) {
    const Bench bench(
        {{.blocks = {kLarge}, .cavities = {kSmall}}, {.blocks = {{{-0.5, -0.4, -0.3}, {0.6, 0.3, 0.4}}}, .level = 1}});
    EXPECT_GT(expect_caps(bench), 1000);
}

TEST(Caps, AreTheSameForAnyNumberOfThreads) {
    const Bench bench({{.blocks = {kLarge}}, {.blocks = {kSmall}}});
    const MeshBvhs meshes = build_mesh_bvhs(bench.scene);
    const Bvh bvh = build_bvh(meshes, all_parts(bench.scene), bench.cut.role, bench.cut.level);
    const Caps one = trace_caps(bvh, bench.cut, bench.solids, {}, test::with_threads(1));
    const Caps many = trace_caps(bvh, bench.cut, bench.solids, {}, test::with_threads(7));
    EXPECT_EQ(one.levels, many.levels);
    EXPECT_EQ(one.mesh.positions, many.mesh.positions);
    EXPECT_EQ(one.mesh.triangles, many.mesh.triangles);
}

TEST(Caps, AtSamplesAreThoseAtTheirPixelCentres) {
    const Bench bench({{.blocks = {kLarge}}, {.blocks = {kSmall}}});
    const MeshBvhs meshes = build_mesh_bvhs(bench.scene);
    const Bvh bvh = build_bvh(meshes, all_parts(bench.scene), bench.cut.role, bench.cut.level);
    const Caps caps = trace_caps(bvh, bench.cut, bench.solids);
    for (int x = 60; x < 100; ++x) {
        RayHit16 rays;
        CutLanes lanes;
        for (int i = 0; i < kLanes; ++i) {
            const float px = float(x) + 0.5f, py = 50.5f + float(i);
            const Ray ray = bench.cut.view.ray(px, py);
            rays.set(i, ray.origin, ray.direction, 0, kInfinity);
            for (std::size_t k = 0; k < 2; ++k) {
                const CutDepth d = bench.cut.depth_at(px, py, k);
                lanes.t[k][i] = d.depth > 0 ? d.depth / ray.depth_per_t : kInfinity;
                lanes.chamfer[k][i] = d.chamfer;
            }
        }
        const CapLanes found = find_caps(bvh, bench.cut, caps, rays, lanes);
        for (int i = 0; i < kLanes; ++i) EXPECT_EQ(found.cap[0][i], caps.at(0, x, 50 + i)) << x << ' ' << i;
    }
}

} // namespace
} // namespace porthole
