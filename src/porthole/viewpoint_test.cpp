// The camera of --camera auto, against weighing every candidate in full.
#include "porthole/viewpoint.h"

#include <gtest/gtest.h>

#include <array>
#include <random>

#include "support/direction.h"
#include "support/shapes.h"

namespace porthole {
namespace {

using test::Builder;

void expect_weighed(const MeshBvhs& meshes, std::span<const PartId> targets, std::span<const PartId> keep,
                    const PlanParams& params, const char* what) {
    const Subject subject = make_subject(meshes, targets, keep);
    const FrameSubject frame = frame_subject(meshes.scene(), targets);
    const Vec3f weighed = test::weighed_direction(subject, frame, {}, 320, 180, params);
    for (const int threads : {1, 3})
        EXPECT_EQ(best_direction(subject, frame, {}, 320, 180, params, test::with_threads(threads)), weighed)
            << what << ", " << threads << " threads";
}

/// Balls and boxes in a shell, some of them outside it.
Builder clutter(std::vector<PartId>& parts) {
    Builder b(12);
    std::mt19937 random(1);
    std::uniform_real_distribution<double> u(-0.8, 0.8);
    for (int i = 0; i < 20; ++i) {
        const Vec3d c{u(random), u(random), u(random)};
        const double size = 0.05 + 0.1 * std::abs(u(random));
        parts.push_back(i % 2 == 0 ? b.add_sphere("ball" + std::to_string(i), c, size)
                                   : b.add_box("box" + std::to_string(i), c, {size, 2 * size, size / 2}));
    }
    b.add_sphere("shell", {0, 0, 0}, 1);
    return b;
}

TEST(BestDirection, IsThatOfWeighingEveryCandidate) {
    std::vector<PartId> parts;
    const Builder b = clutter(parts);
    const MeshBvhs meshes = build_mesh_bvhs(b.scene);
    expect_weighed(meshes, std::array{parts[0]}, {}, {}, "one target");
    expect_weighed(meshes, std::array{parts[1], parts[2]}, std::array{parts[5], parts[6], parts[7], parts[8]}, {},
                   "two targets, kept parts");
}

TEST(BestDirection, IsThatOfWeighingEveryCandidateWhereTargetsAreRefused) {
    // From many sides there is no room between the ball and its shell's outline; nothing hides the far box.
    Builder b(24);
    const PartId inner = b.add_sphere("inner", {0.55, 0, 0}, 0.4);
    b.add_sphere("outer", {0, 0, 0}, 1);
    const PartId far = b.add_box("far", {3, 0.2, 0}, {0.2, 0.3, 0.1});
    const MeshBvhs meshes = build_mesh_bvhs(b.scene);
    expect_weighed(meshes, std::array{inner}, {}, {.style = HoleStyle::paper}, "tangent");
    expect_weighed(meshes, std::array{inner, far}, {}, {.style = HoleStyle::paper}, "tangent and far");
}

} // namespace
} // namespace porthole
