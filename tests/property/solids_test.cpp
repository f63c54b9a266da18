// Which parts of real models are solid: known counts, and rays that must agree with them.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <random>

#include "porthole/io/load.h"
#include "porthole/scene/select.h"
#include "porthole/scene/solid.h"
#include "porthole/trace/bvh.h"
#include "porthole/trace/solid.h"
#include "support/shared.h"

namespace porthole {
namespace {

/// Counts over parts, as `porthole parts` lists them.
struct Expected {
    const char* file;
    int parts, by_edges, by_rays, partly, open;
    int flipped; ///< parts with a component that faces the wrong way
};

std::ostream& operator<<(std::ostream& out, const Expected& e) { return out << e.file; }

const Expected kExpected[] = {
    {"assembly/2CylinderEngine.glb", 67, 26, 41, 0, 0, 0}, {"assembly/ReciprocatingSaw.glb", 113, 78, 6, 0, 29, 0},
    {"assembly/vh_male_body.glb", 294, 52, 52, 3, 187, 0}, {"assembly/virtual_worm.glb", 631, 578, 39, 4, 10, 42},
    {"medical/head_brain_mri.glb", 24, 24, 0, 0, 0, 0},
};

class Solids : public testing::TestWithParam<Expected> {};

TEST_P(Solids, Counts) {
    PORTHOLE_NEEDS_SHARED(shared);
    const Scene scene = load_scene((shared / "models" / GetParam().file).string());
    const std::vector<MeshSolid> solids = find_solids(scene);
    EXPECT_EQ(solids, find_solids(scene, {}, {{}, {}, 1}));
    Expected found{GetParam().file, int(scene.parts.size())};
    for (const Part& part : scene.parts) {
        const MeshSolid& solid = solids[part.mesh];
        found.by_edges += solid.by == ClosedBy::edges;
        found.by_rays += solid.by == ClosedBy::rays;
        found.partly += !solid.closed && solid.has_material();
        found.open += !solid.has_material();
        found.flipped += solid.flipped_components > 0;
        // Edges that all pair leave nothing open.
        if (solid.edges.closed) {
            EXPECT_EQ(solid.by, ClosedBy::edges) << part.path;
        }
    }
    EXPECT_EQ(found.parts, GetParam().parts);
    EXPECT_EQ(found.by_edges, GetParam().by_edges);
    EXPECT_EQ(found.by_rays, GetParam().by_rays);
    EXPECT_EQ(found.partly, GetParam().partly);
    EXPECT_EQ(found.open, GetParam().open);
    EXPECT_EQ(found.flipped, GetParam().flipped);
}

TEST_P(Solids, EveryRayLeavesWhatItEnters) {
    PORTHOLE_NEEDS_SHARED(shared);
    const Scene scene = load_scene((shared / "models" / GetParam().file).string());
    const std::vector<MeshSolid> solids = find_solids(scene);
    const MeshBvhs meshes = build_mesh_bvhs(scene);
    std::mt19937 random(7);
    const auto unit = [&] { return float(random() >> 8) * 0x1p-24f; };
    std::int64_t rays_hit = 0, wrong = 0;
    for (const PartId id : all_parts(scene)) {
        const Part& part = scene.parts[index(id)];
        const MeshSolid& solid = solids[part.mesh];
        if (solid.by != ClosedBy::edges) continue;
        const Bvh bvh = build_bvh(meshes, std::array{id});
        const Bounds3f& box = scene.meshes[part.mesh].bounds;
        const auto point = [&] {
            const Vec3f at{unit(), unit(), unit()};
            return Vec3f(part.world_from_mesh.point(Vec3d(box.lower + at * box.size())));
        };
        const auto size = float(part_bounds(scene, id).diagonal());
        for (int packet = 0; packet < 8; ++packet) {
            RayHit16 rays;
            for (int i = 0; i < kLanes; ++i) {
                const Vec3f a = point(), direction = normalize(point() - a);
                rays.set(i, a - direction * (2 * size), direction, 0, kInfinity);
            }
            std::array<std::vector<std::pair<float, int>>, kLanes> crossed;
            for_each_crossing(bvh, rays, [&](const Crossing& c) {
                if (const int sign = crossing_sign(solid, c.triangle, c.entering))
                    crossed[std::size_t(c.lane)].emplace_back(c.t, sign);
            });
            for (auto& line : crossed) {
                if (line.empty()) continue;
                std::ranges::sort(line);
                int depth = 0, lowest = 0;
                for (const auto& [t, sign] : line) lowest = std::min(lowest, depth -= sign);
                ++rays_hit;
                wrong += depth != 0 || lowest < 0;
            }
        }
    }
    RecordProperty("rays", int(rays_hit));
    RecordProperty("wrong", int(wrong));
    EXPECT_GT(rays_hit, 500);
    // Two triangles may report one crossing of their common edge, bodies may touch, and the two
    // prostate ducts of the body are turned inside out along some of their length.
    EXPECT_LE(double(wrong), 0.004 * double(rays_hit)) << wrong << " of " << rays_hit;
}

TEST(Holders, ShellsAreWhatEnclosesInItsMaterial) {
    PORTHOLE_NEEDS_SHARED(shared);
    struct Case {
        const char* file;
        std::vector<std::string> targets, shells;
    };
    const Case cases[] = {
        {"medical/head_brain_mri.glb", {"Hippocampus_*"}, {"head_skin", "brain_surface"}},
        {"assembly/vh_male_body.glb", {"VH_M_mitral_valve"}, {"VH_M_skin"}},
        {"assembly/MosquitoInAmber.glb", {"2_mosquito*"}, {"5_amber_lr_PBR_0"}},
        {"assembly/2CylinderEngine.glb", {"*"}, {}}, // parts of machines do not lie in each other's material
        {"assembly/ReciprocatingSaw.glb", {"body_6*", "body_7*"}, {}},
    };
    for (const Case& c : cases) {
        const Scene scene = load_scene((shared / "models" / c.file).string());
        const MeshBvhs meshes = build_mesh_bvhs(scene);
        const std::vector<MeshSolid> solids = find_solids(scene);
        const std::vector<PartId> targets = select_parts(scene, c.targets);
        const auto holders = find_holders(meshes, solids, all_parts(scene), targets);
        EXPECT_EQ(holders, find_holders(meshes, solids, all_parts(scene), targets, {{}, {}, 1}));
        std::vector<std::string> names;
        for (const PartId id : all_parts(scene))
            if (holders[index(id)]) names.push_back(scene.parts[index(id)].name);
        EXPECT_EQ(names, c.shells) << c.file;
    }
}

INSTANTIATE_TEST_SUITE_P(Shared, Solids, testing::ValuesIn(kExpected));

} // namespace
} // namespace porthole
