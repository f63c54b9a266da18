// From primitives to pictures: the same as from fine meshes of the same bodies.
#include <gtest/gtest.h>

#include <array>
#include <random>

#include "porthole/io/load.h"
#include "porthole/render/surface.h"
#include "porthole/reveal.h"
#include "support/shapes.h"

namespace porthole {
namespace {

using test::Builder;

Affine3d sized(Vec3d half, Vec3d at = {}) { return {{half.x, 0, 0}, {0, half.y, 0}, {0, 0, half.z}, at}; }

PartId add(Scene& scene, const std::string& name, PrimitiveTree tree, const Affine3d& world = {}) {
    Mesh mesh;
    mesh.primitives = std::move(tree);
    finish_mesh(mesh);
    scene.parts.push_back({name, name, std::uint32_t(scene.meshes.size()), world});
    scene.meshes.push_back(std::move(mesh));
    return PartId{std::uint32_t(scene.parts.size() - 1)};
}

TEST(PrimitiveFlow, SurfacePointsAreWhereTheRayMet) {
    std::mt19937 random(7);
    std::uniform_real_distribution<float> u(-1, 1);
    const PrimitiveTree solids[] = {make_primitive(PrimitiveKind::box, 0, sized({1, 0.7, 0.9})),
                                    make_primitive(PrimitiveKind::sphere, 0, sized({0.8, 0.8, 1.4})),
                                    make_primitive(PrimitiveKind::frustum, 0.3, sized({0.4, 2, 0.4})),
                                    make_primitive(PrimitiveKind::torus, 0.15, sized({0.8, 0.8, 0.8}, {0, 0.7, 0}))};
    const Affine3d placements[] = {{},
                                   {{0, 3, 0}, {0.5, 0, 0}, {0, 0, -2}, {20, 5, -7}}, // mirrored
                                   {{0.01, 0.002, 0}, {0, 0.01, 0}, {0, 0.003, 0.02}, {1, 0, 0}}};
    for (const Affine3d& world : placements) {
        Builder b;
        const PartId part = add(b.scene, "p", combine(CsgOperation::subtract, solids), world);
        const MeshBvhs meshes = build_mesh_bvhs(b.scene);
        const Bvh bvh = build_bvh(meshes, std::array{part});
        const std::vector<Placement> placed = make_placements(b.scene);
        const Bounds3d box = part_bounds(b.scene, part);
        const auto size = float(box.diagonal());
        int met = 0, front = 0;
        for (int k = 0; k < 300; ++k) {
            RayHit16 rays;
            for (int i = 0; i < kLanes; ++i) {
                const Vec3f through = Vec3f(box.center()) + Vec3f{u(random), u(random), u(random)} * (0.3f * size);
                const Vec3f direction = normalize(Vec3f{u(random), u(random), u(random)});
                // Half of them from inside its box, so that backs are met, too.
                rays.set(i, through - direction * (i % 2 ? 0 : 2 * size), direction, 0, kInfinity);
            }
            intersect(bvh, rays, Coherence::incoherent);
            for (int i = 0; i < kLanes; ++i) {
                if (!rays.hit(i)) continue;
                ++met;
                const Hit hit{part, rays.triangle[i], rays.u[i], rays.v[i]};
                const SurfacePoint s = surface_point(placed[index(part)], hit, rays.direction(i));
                const Vec3f expected = rays.origin(i) + rays.direction(i) * rays.tfar[i];
                const float far = length(rays.origin(i)) + rays.tfar[i];
                EXPECT_LT(length(s.position - expected), 1e-5f * (size + far));
                EXPECT_LE(dot(s.flat_normal, rays.direction(i)), 0.0f);
                EXPECT_LT(length(s.normal - s.flat_normal), 0.05f);
                const Vec3f ng{rays.ng_x[i], rays.ng_y[i], rays.ng_z[i]};
                const Vec3f outward =
                    normalize(transform_normal(Affine3f(world), ng) * (world.determinant() < 0 ? -1.0f : 1.0f));
                EXPECT_NEAR(std::abs(dot(outward, s.flat_normal)), 1, 1e-4);
                if (std::abs(dot(outward, rays.direction(i))) > 1e-3f) {
                    EXPECT_EQ(s.front, dot(outward, rays.direction(i)) < 0);
                }
                front += s.front;
            }
        }
        EXPECT_GT(met, 1500);
        EXPECT_GT(front, met / 3);
        EXPECT_LT(front, met);
    }
}

/// A ball in a hollow ball in a block, as primitives and as fine meshes.
struct Housing {
    Builder scene;
    PartId core{}, shell{}, block{};

    explicit Housing(bool exact) : scene(160) {
        const auto part = [&](const std::string& name, bool ball, Vec3d at, Vec3d half) {
            if (exact)
                return add(scene.scene, name,
                           make_primitive(ball ? PrimitiveKind::sphere : PrimitiveKind::box, 0, sized({1, 1, 1})),
                           sized(half, at));
            return scene.add(name, ball ? scene.sphere_mesh : scene.cube_mesh, at, half);
        };
        core = part("core", true, {0.1, 0.1, 0}, {0.3, 0.3, 0.3});
        // A wall of some thickness: the hollow of the mesh is a second, inner surface.
        const double inner = 0.8;
        if (exact) {
            const PrimitiveTree balls[] = {make_primitive(PrimitiveKind::sphere, 0, sized({1, 1, 1})),
                                           make_primitive(PrimitiveKind::sphere, 0, sized({inner, inner, inner}))};
            shell = add(scene.scene, "shell", combine(CsgOperation::subtract, balls));
        } else {
            Mesh mesh = scene.scene.meshes[scene.sphere_mesh];
            const auto n = std::uint32_t(mesh.positions.size());
            for (std::uint32_t i = 0; i < n; ++i) mesh.positions.push_back(mesh.positions[i] * float(inner));
            const std::size_t triangles = mesh.triangles.size();
            for (std::size_t i = 0; i < triangles; ++i) {
                const Vec3u t = mesh.triangles[i];
                mesh.triangles.push_back({t.x + n, t.z + n, t.y + n});
            }
            scene.scene.meshes.push_back(test::finished(std::move(mesh)));
            shell = scene.add("shell", std::uint32_t(scene.scene.meshes.size() - 1), {}, {1, 1, 1});
        }
        block = part("block", false, {0, 0, 0.65}, {0.5, 1.3, 0.25});
    }
};

/// Intersection over union.
double agreement(const Mask& a, const Mask& b) {
    const Rect w{std::min(a.window().x0, b.window().x0), std::min(a.window().y0, b.window().y0),
                 std::max(a.window().x1, b.window().x1), std::max(a.window().y1, b.window().y1)};
    const auto in = [](const Mask& m, int x, int y) { return m.window().contains(x, y) && m(x, y); };
    int both = 0, any = 0;
    for (int y = w.y0; y < w.y1; ++y)
        for (int x = w.x0; x < w.x1; ++x) both += in(a, x, y) && in(b, x, y), any += in(a, x, y) || in(b, x, y);
    return any == 0 ? 1 : double(both) / any;
}

RevealParams params_for(PartId target, HoleStyle style) {
    RevealParams params;
    params.targets = {target};
    params.view = test::look({1.5f, 1, 6}, {}, 320, 240, 0.4f);
    params.plan.style = style;
    return params;
}

TEST(PrimitiveFlow, HolesAndPicturesAreThoseOfFineMeshes) {
    const Housing exact(true), fine(false);
    const MeshBvhs a = build_mesh_bvhs(exact.scene.scene), b = build_mesh_bvhs(fine.scene.scene);
    for (const HoleStyle style : {HoleStyle::hole, HoleStyle::paper, HoleStyle::cutaway}) {
        const Revealed mine = reveal(a, params_for(exact.core, style)), other = reveal(b, params_for(fine.core, style));
        EXPECT_EQ(mine.plan.cut_set, other.plan.cut_set);
        EXPECT_GT(agreement(mine.plan.hole.mask, other.plan.hole.mask), 0.98) << int(style);
        EXPECT_EQ(mine.plan.cut.cap, other.plan.cut.cap);
        if (!mine.frame.inside.empty()) {
            EXPECT_GT(agreement(mine.frame.inside, other.frame.inside), style == HoleStyle::cutaway ? 0.9 : 0.98);
        }
        double difference = 0;
        int pixels = 0, far_off = 0;
        for (int y = 0; y < 240; ++y)
            for (int x = 0; x < 320; ++x) {
                const Vec4f p = mine.frame.color(x, y), q = other.frame.color(x, y);
                const float d = std::max({std::abs(p.x - q.x), std::abs(p.y - q.y), std::abs(p.z - q.z)});
                if (q.w == 0 && p.w == 0) continue;
                difference += double(d), ++pixels, far_off += d > 0.1f;
            }
        EXPECT_GT(pixels, 9000);
        EXPECT_LT(difference / pixels, 0.01) << int(style);
        EXPECT_LT(far_off, pixels / 50) << int(style);
        EXPECT_GT(mine.report.targets.at(0).visible_after.value_or(0), 0.99);
    }
}

TEST(PrimitiveFlow, CapsFillTheWallsThatTheCutGoesThrough) {
    const Housing exact(true);
    const MeshBvhs meshes = build_mesh_bvhs(exact.scene.scene);
    const Revealed r = reveal(meshes, params_for(exact.core, HoleStyle::cutaway));
    EXPECT_EQ(r.plan.cut.cap_of(exact.block), CapRule::solid);
    EXPECT_NE(r.plan.cut.cap_of(exact.shell), CapRule::none);
    EXPECT_TRUE(r.plan.caps.open.empty());
    std::size_t caps = 0;
    for (const std::uint8_t f : r.frame.inside.pixels()) {
        caps += (f & Frame::cap) != 0;
        EXPECT_FALSE(f & Frame::open_back) << "no part is open";
    }
    EXPECT_GT(caps, 200u);
}

TEST(PrimitiveFlow, ThreadsAndWindowsChangeNothing) {
    const Housing exact(true);
    const MeshBvhs one = build_mesh_bvhs(exact.scene.scene, {}, test::with_threads(1));
    const MeshBvhs three = build_mesh_bvhs(exact.scene.scene, {}, test::with_threads(3));
    const RevealParams params = params_for(exact.core, HoleStyle::cutaway);
    const Revealed a = reveal(one, params, test::with_threads(1)), b = reveal(three, params, test::with_threads(3));
    EXPECT_EQ(a.frame.color, b.frame.color);
    EXPECT_EQ(a.frame.ids, b.frame.ids);
}

TEST(PrimitiveFlow, ThePapersSpheresAreOpenedAsThePaperSays) {
    const Scene scene = load_scene(PORTHOLE_SOURCE_DIR "/examples/primitives/spheres.json");
    const MeshBvhs meshes = build_mesh_bvhs(scene);
    RevealParams params;
    for (std::uint32_t i = 0; i < scene.parts.size(); ++i)
        if (scene.parts[i].name.starts_with("inner")) params.targets.push_back(PartId{i});
    params.camera.name = "paper";
    params.width = 600, params.height = 240;
    params.render.samples = 1;
    params.plan.style = HoleStyle::paper;
    const Revealed paper = reveal(meshes, params);
    ASSERT_EQ(paper.plan.targets.size(), 3u);
    for (const TargetView& t : paper.plan.targets)
        EXPECT_EQ(t.refused, scene.parts[index(t.part)].path == "tangent/inner tangent");
    params.plan.style = HoleStyle::hole;
    const Revealed hole = reveal(meshes, params);
    EXPECT_EQ(hole.plan.opened.size(), 3u) << "the crescent that there is room for";
    for (const auto& t : hole.report.targets) EXPECT_EQ(t.visible_after.value_or(0), 1.0);
}

TEST(PrimitiveFlow, TheHouseOpensAndNothingOutsideTheHoleChanges) {
    const Scene scene = load_scene(PORTHOLE_SOURCE_DIR "/examples/primitives/house.json");
    const MeshBvhs meshes = build_mesh_bvhs(scene);
    RevealParams params;
    for (std::uint32_t i = 0; i < scene.parts.size(); ++i)
        if (scene.parts[i].path.starts_with("furniture/dining/")) params.targets.push_back(PartId{i});
    ASSERT_EQ(params.targets.size(), 7u);
    params.camera.name = "street";
    params.width = 300, params.height = 200;
    params.render.samples = 2;
    const Revealed r = reveal(meshes, params);
    EXPECT_FALSE(r.plan.nothing_to_cut());
    EXPECT_EQ(scene.parts[index(r.plan.cut_set.at(0))].name, "walls");
    EXPECT_TRUE(r.plan.caps.open.empty()) << "primitives are closed";
    const Bvh whole = build_bvh(meshes, all_parts(scene));
    const Frame plain = render(whole, nullptr, r.plan.view, look_of(params), nullptr, nullptr);
    std::size_t same = 0, changed = 0;
    for (int y = 0; y < 200; ++y)
        for (int x = 0; x < 300; ++x) {
            if (r.plan.cut.distance_at(float(x) + 0.5f, float(y) + 0.5f) >= 1) {
                ASSERT_EQ(r.frame.color(x, y), plain.color(x, y)) << x << ", " << y;
                ++same;
            } else {
                changed += !(r.frame.color(x, y) == plain.color(x, y));
            }
        }
    EXPECT_GT(same, 50000u);
    EXPECT_GT(changed, 1000u);
}

} // namespace
} // namespace porthole
