// Boxes of scenes against the plain loop over vertices.
#include "porthole/scene/scene.h"

#include <random>

#include <gtest/gtest.h>

#include "porthole/base/parallel.h"
#include "support/shapes.h"

namespace porthole {
namespace {

TEST(Scene, BoundsOfManyPlacementsAreExact) {
    std::mt19937 random(11);
    std::uniform_real_distribution<double> u(-1, 1);
    for (int round = 0; round < 20; ++round) {
        test::Builder b(24);
        // Points in no order at all, and far from their mesh's origin in some rounds.
        Mesh& mesh = b.scene.meshes[b.sphere_mesh];
        const Vec3f far = round % 3 == 0 ? Vec3f{1e6f, -3e5f, 7e6f} : Vec3f{};
        if (round % 2 == 0)
            for (Vec3f& p : mesh.positions) p = Vec3f(Vec3d{u(random), u(random), u(random)}) + far;
        for (int i = 0; i < 30; ++i) {
            const PartId id = b.add_sphere("s", {9 * u(random), 9 * u(random), 9 * u(random)}, 1);
            Affine3d& m = b.scene.parts[index(id)].world_from_mesh;
            for (Vec3d* axis : {&m.x, &m.y, &m.z}) *axis = {u(random), u(random), u(random)};
        }
        Bounds3d expected;
        for (const Part& part : b.scene.parts)
            for (const Vec3f& p : b.scene.meshes[part.mesh].positions)
                expected.extend(part.world_from_mesh.point(Vec3d(p)));
        const Bounds3d found = scene_bounds(b.scene);
        EXPECT_EQ(found.lower, expected.lower) << round;
        EXPECT_EQ(found.upper, expected.upper) << round;
    }
}

} // namespace
} // namespace porthole
