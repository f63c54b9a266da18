// Ray queries on primitives against the list of crossings and against triangles.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <random>
#include <ranges>

#include "porthole/trace/bvh.h"
#include "porthole/trace/solid.h"
#include "porthole/trace/visibility.h"
#include "support/shapes.h"

namespace porthole {
namespace {

using test::Builder;
using test::with_threads;

Affine3d sized(Vec3d half, Vec3d at = {}) { return {{half.x, 0, 0}, {0, half.y, 0}, {0, 0, half.z}, at}; }

/// A drilled block with a ring let into it and a ball in the bore, turned so that no face lies in an axis.
PrimitiveTree drilled_block() {
    const PrimitiveTree parts[] = {
        make_primitive(PrimitiveKind::box, 0, sized({1, 0.6, 0.8})),
        make_primitive(PrimitiveKind::frustum, 0.5, {{0.5, 0, 0}, {0, 0, 1.5}, {0, -0.5, 0}, {}}),
        make_primitive(PrimitiveKind::torus, 0.2, sized({0.9, 0.9, 0.9}, {0, 0.6, 0}))};
    const PrimitiveTree block[] = {combine(CsgOperation::subtract, parts),
                                   make_primitive(PrimitiveKind::sphere, 0, sized({0.3, 0.3, 0.3}))};
    const double c = std::cos(0.5), s = std::sin(0.5);
    return placed(combine(CsgOperation::unite, block), {{c, s, 0}, {-s, c, 0}, {0, 0, 1}, {0.3, 0.1, 0}});
}

/// Adds a part of primitives to a scene with materials.
PartId add(Scene& scene, const std::string& name, PrimitiveTree tree, const Affine3d& world = {}) {
    Mesh mesh;
    mesh.primitives = std::move(tree);
    finish_mesh(mesh);
    scene.parts.push_back({name, name, std::uint32_t(scene.meshes.size()), world});
    scene.meshes.push_back(std::move(mesh));
    return PartId{std::uint32_t(scene.parts.size() - 1)};
}

/// Placements that turn, stretch and mirror.
const Affine3d kPlacements[] = {{},
                                {{0.6, 0.8, 0}, {-0.8, 0.6, 0}, {0, 0, 1}, {3, -1, 2}},
                                {{2, 0, 0}, {0, 0.5, 0.3}, {0, -0.2, 1}, {0, 5, 0}},
                                {{-1, 0, 0}, {0, 1, 0}, {0, 0, 1}, {1, 1, 1}},
                                {{1e-3, 0, 0}, {0, 1e-3, 0}, {0, 0, -1e-3}, {0, 0, 0}}};

struct Rays {
    RayHit16 packet;
    void aim(std::mt19937& random, const Bounds3d& box) {
        std::uniform_real_distribution<float> u(-1, 1);
        const Vec3f center(box.center());
        const auto r = float(0.6 * box.diagonal());
        for (int i = 0; i < kLanes; ++i) {
            const Vec3f through = center + Vec3f{u(random), u(random), u(random)} * (0.5f * r);
            const Vec3f direction = normalize(Vec3f{u(random), u(random), u(random)});
            packet.set(i, through - direction * (2 * r), direction, 0, kInfinity);
        }
    }
};

TEST(PrimitiveGeometry, EveryCrossingIsVisitedOnce) {
    std::mt19937 random(1);
    std::size_t met = 0;
    for (const Affine3d& world : kPlacements) {
        Builder b;
        const PartId part = add(b.scene, "block", drilled_block(), world);
        const MeshBvhs meshes = build_mesh_bvhs(b.scene);
        const Bvh bvh = build_bvh(meshes, std::array{part});
        // The same solid without an instance in between.
        const PrimitiveTree tree = placed(drilled_block(), world);
        const Bounds3d box = part_bounds(b.scene, part);
        std::vector<PrimitiveCrossing> expected;
        for (int k = 0; k < 200; ++k) {
            Rays rays;
            rays.aim(random, box);
            std::array<std::vector<Crossing>, kLanes> visited;
            for_each_crossing(bvh, rays.packet, [&](const Crossing& c) {
                EXPECT_EQ(c.part, part);
                visited[std::size_t(c.lane)].push_back(c);
            });
            RayHit16 nearest = rays.packet, any = rays.packet;
            intersect(bvh, nearest, Coherence::incoherent);
            occluded_by_any(bvh, any);
            for (int i = 0; i < kLanes; ++i) {
                const Vec3d origin(rays.packet.origin(i)), direction(rays.packet.direction(i));
                find_crossings(tree, origin, direction, expected);
                std::vector<Crossing>& seen = visited[std::size_t(i)];
                std::ranges::sort(seen, {}, &Crossing::t);
                // Float rays may pass an edge on its other side: there one list has a short pair.
                const double touching = 1e-3 * box.diagonal();
                bool grazes = false;
                for (std::size_t n = 1; n < expected.size(); ++n)
                    grazes |= expected[n].t - expected[n - 1].t < touching;
                for (std::size_t n = 1; n < seen.size(); ++n) grazes |= double(seen[n].t - seen[n - 1].t) < touching;
                if (grazes) continue;
                ASSERT_EQ(seen.size(), expected.size());
                met += seen.size();
                for (std::size_t n = 0; n < seen.size(); ++n) {
                    EXPECT_NEAR(double(seen[n].t), expected[n].t, 1e-5 * box.diagonal());
                    EXPECT_EQ(seen[n].entering, expected[n].entering);
                    EXPECT_EQ(seen[n].triangle, expected[n].surface);
                }
                EXPECT_EQ(nearest.hit(i), !seen.empty());
                EXPECT_EQ(any.tfar[i] == -kInfinity, !seen.empty());
                if (seen.empty()) continue;
                EXPECT_EQ(nearest.tfar[i], seen[0].t);
                EXPECT_EQ(nearest.triangle[i], seen[0].triangle);
                EXPECT_EQ(nearest.u[i], seen[0].u);
                EXPECT_EQ(nearest.v[i], seen[0].v);
            }
        }
    }
    EXPECT_GT(met, 20000u);
}

TEST(PrimitiveGeometry, IntervalsAreKept) {
    Builder b;
    const PartId part = add(b.scene, "ball", make_primitive(PrimitiveKind::sphere, 0, sized({1, 1, 1})));
    const MeshBvhs meshes = build_mesh_bvhs(b.scene);
    const Bvh bvh = build_bvh(meshes, std::array{part});
    const auto hit = [&](float t0, float t1) {
        RayHit16 rays;
        for (int i = 0; i < kLanes; ++i) rays.clear(i);
        rays.set(3, {0.1f, 0.2f, 5}, {0, 0, -1}, t0, t1);
        intersect(bvh, rays, Coherence::coherent);
        return rays.hit(3) ? rays.tfar[3] : -1.0f;
    };
    const float first = hit(0, kInfinity), second = hit(first, kInfinity);
    EXPECT_NEAR(first, 5 - std::sqrt(0.95), 1e-6);
    EXPECT_NEAR(second, 5 + std::sqrt(0.95), 1e-6);
    EXPECT_EQ(hit(0, first), first) << "tfar belongs to the interval";
    EXPECT_EQ(hit(0, std::nextafter(first, 0.0f)), -1);
    EXPECT_EQ(hit(second, kInfinity), -1) << "tnear does not";
    EXPECT_EQ(hit(std::nextafter(first, 0.0f), kInfinity), first);
}

/// Both kinds of the same bodies, each in a scene of its own, parts in the same order.
struct Twins {
    Builder primitives, triangles{300};
    Twins() {
        const auto both = [&](const std::string& name, bool ball, Vec3d center, Vec3d half) {
            add(primitives.scene, name,
                make_primitive(ball ? PrimitiveKind::sphere : PrimitiveKind::box, 0, sized({1, 1, 1})),
                sized(half, center));
            triangles.add(name, ball ? triangles.sphere_mesh : triangles.cube_mesh, center, half);
        };
        both("ball", true, {-1.2, 0, 0}, {1, 1, 1});
        both("egg", true, {1.5, 0.3, 0.4}, {0.5, 1.2, 0.7});
        both("block", false, {0.3, -1.1, 0.9}, {0.7, 0.4, 0.6});
        both("inside", false, {-1.2, 0, 0}, {0.3, 0.4, 0.5});
    }
};

TEST(PrimitiveGeometry, PicturesAreThoseOfFineTriangles) {
    const Twins twins;
    const MeshBvhs exact = build_mesh_bvhs(twins.primitives.scene), fine = build_mesh_bvhs(twins.triangles.scene);
    const std::vector<PartId> parts = all_parts(twins.primitives.scene);
    const Bvh a = build_bvh(exact, parts), b = build_bvh(fine, parts);
    for (const Vec3f eye : {Vec3f{4, 3, 7}, Vec3f{-6, -2, 4}, Vec3f{0, 9, 0.1f}}) {
        const View view = test::look(eye, {}, 320, 240, 0.4f);
        const IdBuffer ids = trace_ids(a, view, view.window()), twin = trace_ids(b, view, view.window());
        int different = 0, seen = 0;
        for (int y = 1; y < 239; ++y)
            for (int x = 1; x < 319; ++x) {
                if (ids.id(x, y) == twin.id(x, y)) {
                    if (ids.id(x, y) == kNoPart) continue;
                    ++seen;
                    EXPECT_NEAR(ids.depth(x, y), twin.depth(x, y), 0.03f);
                    continue;
                }
                ++different;
                bool edge = false;
                for (const auto& [dx, dy] : {std::pair{1, 0}, {-1, 0}, {0, 1}, {0, -1}})
                    edge |= ids.id(x + dx, y + dy) != ids.id(x, y) || twin.id(x + dx, y + dy) != twin.id(x, y);
                EXPECT_TRUE(edge) << x << ", " << y;
            }
        EXPECT_GT(seen, 5000);
        EXPECT_LT(different, seen / 500);

        const auto depth_of = [&](const Bvh& bvh) { // what lies in front of the part inside
            const IdBuffer targets =
                trace_ids(build_bvh(&bvh == &a ? exact : fine, std::array{PartId{3}}), view, view.window());
            return trace_spans(bvh, kMaskAll, view, targets, 1e-5f);
        };
        const Spans mine = depth_of(a), other = depth_of(b);
        ASSERT_EQ(mine.parts.size(), other.parts.size());
        for (std::size_t i = 0; i < mine.parts.size(); ++i) {
            EXPECT_EQ(mine.parts[i].part, other.parts[i].part);
            EXPECT_NEAR(double(mine.parts[i].pixels), double(other.parts[i].pixels),
                        0.02 * double(other.parts[i].pixels) + 2);
        }
    }
}

TEST(PrimitiveGeometry, BlocksAndThreadsChangeNothing) {
    Builder b;
    for (const Affine3d& world : kPlacements)
        add(b.scene, "p" + std::to_string(b.scene.parts.size()), drilled_block(), world);
    const MeshBvhs meshes = build_mesh_bvhs(b.scene);
    const std::vector<PartId> parts = all_parts(b.scene);
    const Bvh bvh = build_bvh(meshes, parts);
    const ClusterBoxes boxes = cluster_boxes(b.scene, parts);
    for (const Vec3f eye : {Vec3f{4, 3, 9}, Vec3f{0.3f, 0.1f, 0}, Vec3f{-6, -2, 4}}) {
        const View view = test::look(eye, {1, 1, 1}, 161, 117, 0.4f);
        const Rect window = view.window().grown(9);
        const IdBuffer ids = trace_ids(bvh, view, window, with_threads(1));
        EXPECT_EQ(ids, trace_ids(bvh, view, window, with_threads(3)));
        EXPECT_EQ(ids, trace_ids_in_blocks(bvh, view, window, mark_blocks(b.scene, parts, boxes, view, window)));
    }
}

TEST(PrimitiveGeometry, LightPassesTintedPrimitives) {
    Builder b;
    b.scene.materials.push_back(b.scene.materials[0]);
    b.scene.materials[1].alpha_mode = AlphaMode::blend;
    b.scene.materials[1].base_color = {1, 0, 0, 0.5f};
    // A ball of glass around a hollow whose walls are opaque.
    const PrimitiveTree hollow[] = {make_primitive(PrimitiveKind::sphere, 0, sized({1, 1, 1}), 1),
                                    make_primitive(PrimitiveKind::box, 0, sized({0.5, 0.5, 0.5}), 0)};
    const PartId part = add(b.scene, "ball", combine(CsgOperation::subtract, hollow));
    const MeshBvhs meshes = build_mesh_bvhs(b.scene);
    const Bvh bvh = build_bvh(meshes, std::array{part});
    RayHit16 rays;
    for (int i = 0; i < kLanes; ++i) rays.clear(i);
    rays.set(0, {0.1f, 0.8f, 5}, {0, 0, -1}, 0, kInfinity); // past the opaque hollow
    rays.set(1, {0.1f, 0.1f, 5}, {0, 0, -1}, 0, kInfinity);
    Vec3f light[kLanes];
    for (Vec3f& l : light) l = {1, 1, 1};
    occluded(bvh, rays, nullptr, light);
    EXPECT_NE(rays.tfar[0], -kInfinity);
    EXPECT_NEAR(light[0].x, 0.25f, 1e-6) << "in and out";
    EXPECT_NEAR(light[0].y, 0.0625f, 1e-6);
    EXPECT_EQ(rays.tfar[1], -kInfinity);
    occluded_by_any(bvh, rays);
    EXPECT_EQ(rays.tfar[0], -kInfinity);
}

TEST(PrimitiveGeometry, SolidsHoldWhatIsInThem) {
    Builder b;
    const PrimitiveTree shell[] = {make_primitive(PrimitiveKind::sphere, 0, sized({1, 1, 1})),
                                   make_primitive(PrimitiveKind::sphere, 0, sized({0.9, 0.9, 0.9}))};
    const PartId full = add(b.scene, "full", make_primitive(PrimitiveKind::sphere, 0, sized({1, 1, 1})));
    const PartId hollow = add(b.scene, "hollow", combine(CsgOperation::subtract, shell));
    const PartId core = add(b.scene, "core", make_primitive(PrimitiveKind::torus, 0.3, sized({0.5, 0.5, 0.5})));
    const MeshBvhs meshes = build_mesh_bvhs(b.scene);
    const std::vector<MeshSolid> solids = find_solids(b.scene);
    for (const MeshSolid& s : solids | std::views::drop(2)) EXPECT_TRUE(s.closed);
    const std::vector<std::uint8_t> holders = find_holders(meshes, solids, std::array{full, hollow}, std::array{core});
    EXPECT_EQ(holders[index(full)], 1);
    EXPECT_EQ(holders[index(hollow)], 0) << "the torus lies in its hollow, not in its material";
    const std::vector<Vec3f> points{{0, 0, 0.95f}, {0, 0, 0.5f}, {0, 0, 1.05f}};
    EXPECT_EQ(lies_inside(meshes, solids, hollow, points), (std::vector<std::uint8_t>{1, 0, 0}));
    EXPECT_EQ(lies_inside(meshes, solids, full, points), (std::vector<std::uint8_t>{1, 1, 0}));
}

} // namespace
} // namespace porthole
