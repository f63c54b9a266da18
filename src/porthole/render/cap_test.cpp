// Light in the hole: the picture of a cut against the picture of the mesh that the cut leaves.
#include <gtest/gtest.h>

#include <cmath>

#include "porthole/render/cap.h"
#include "porthole/render/render.h"
#include "porthole/render/test_scene.h"

namespace porthole {
namespace {

using test::add_part;
using test::box_mesh;
using test::look_at;
using test::matte;

/// A block with a square pocket, made twice: cut out by a hole, and as a mesh. Seen straight
/// from above, so that its walls stand upright and run between pixels.
struct Pocket {
    static constexpr int kSize = 1200;
    static constexpr float kPixel = 4.0f / kSize;                   // the picture is 4 m wide
    static constexpr float kHalf = 1.2f;                            // of the block's width
    static constexpr float kTop = 4, kFloor = 4.9f, kBottom = 5.8f; // depths
    static constexpr int kRadius = 345;                             ///< half the width of the opening, pixels
    int chamfer = 0;                                                ///< width, pixels
    float slope = 0.008f;
    Vec3f color{0.7f, 0.68f, 0.66f};
    View view;
    Scene cut_scene, mesh_scene;
    PartId block, target;

    explicit Pocket(int chamfer_px) : chamfer(chamfer_px) {
        view = look_at({0, 0, 5}, {0, 0, 0}, kSize, kSize, kPixel * kSize / 2);
        view.orthographic = true;
        for (Scene* scene : {&cut_scene, &mesh_scene}) {
            scene->materials = {matte(color), matte({0.2f, 0.5f, 0.3f}), cut_face()};
            // The target's size makes ambient occlusion reach as far in the hole as elsewhere.
            const Mesh inner = box_mesh({-0.6165f, -0.6165f, z(5.2f)}, {0.6165f, 0.6165f, z(4.6f)}, 1);
            block = add_part(*scene,
                             scene == &cut_scene ? box_mesh({-kHalf, -kHalf, z(kBottom)}, {kHalf, kHalf, z(kTop)})
                                                 : pocketed(),
                             "block");
            target = add_part(*scene, inner, "target");
        }
    }
    static float z(float depth) { return 5 - depth; }
    /// What caps are made of, as a material.
    [[nodiscard]] Material cut_face() const {
        Material m;
        const Vec3f c = color * 0.62f;
        m.base_color = {c.x, c.y, c.z, 1};
        m.specular_workflow = true;
        m.specular_color = {0, 0, 0};
        m.roughness = 1;
        m.emissive = c * 0.12f;
        return m;
    }

    /// The block without the pocket's top, and the pocket.
    [[nodiscard]] Mesh pocketed() const {
        Mesh mesh = box_mesh({-kHalf, -kHalf, z(kBottom)}, {kHalf, kHalf, z(kTop)});
        // The face at the largest z goes; a frame takes its place.
        std::erase_if(mesh.triangles, [&](Vec3u t) {
            return mesh.positions[t.x].z == z(kTop) && mesh.positions[t.y].z == z(kTop) &&
                   mesh.positions[t.z].z == z(kTop);
        });
        const auto ring = [&](float r, float depth) {
            const auto n = std::uint32_t(mesh.positions.size());
            for (const Vec2f p : {Vec2f{-r, -r}, Vec2f{r, -r}, Vec2f{r, r}, Vec2f{-r, r}})
                mesh.positions.push_back({p.x, p.y, z(depth)});
            return n;
        };
        const auto join = [&](std::uint32_t outer, std::uint32_t inner) {
            for (std::uint32_t i = 0; i < 4; ++i) {
                const std::uint32_t j = (i + 1) % 4;
                mesh.triangles.push_back({outer + i, outer + j, inner + j});
                mesh.triangles.push_back({outer + i, inner + j, inner + i});
            }
        };
        std::uint32_t edge = ring(kRadius * kPixel, kTop);
        join(ring(kHalf, kTop), edge);
        const auto outside = std::uint32_t(mesh.triangles.size());
        if (chamfer > 0) {
            const std::uint32_t lower = ring(float(kRadius - chamfer) * kPixel, kTop + slope * float(chamfer));
            join(edge, lower);
            edge = lower;
        }
        const std::uint32_t bottom = ring(float(kRadius - chamfer) * kPixel, kFloor);
        join(edge, bottom);
        mesh.triangles.push_back({bottom, bottom + 1, bottom + 2});
        mesh.triangles.push_back({bottom, bottom + 2, bottom + 3});
        mesh.submeshes = {{0, outside, 0}, {outside, std::uint32_t(mesh.triangles.size()) - outside, 2}};
        return mesh;
    }

    [[nodiscard]] Cut cut() const {
        Cut cut;
        cut.view = view;
        cut.role = {CutRole::cut_set, CutRole::fixed};
        cut.cap = {CapRule::solid, CapRule::none};
        constexpr int kMiddle = kSize / 2, kReach = kRadius + 8;
        const Rect window{kMiddle - kReach, kMiddle - kReach, kMiddle + kReach, kMiddle + kReach};
        cut.distance = Image<float>(window);
        cut.loose_depth = Image<float>(window, -kInfinity);
        CutLevel& level = cut.levels.emplace_back(window);
        for (int y = window.y0; y < window.y1; ++y)
            for (int x = window.x0; x < window.x1; ++x) {
                const float dx = float(x) + 0.5f - kMiddle, dy = float(y) + 0.5f - kMiddle;
                cut.distance(x, y) = std::max(std::abs(dx), std::abs(dy)) - kRadius;
                if (cut.distance(x, y) <= 0) level(x, y) = {0, kTop, slope, float(chamfer), kFloor};
            }
        return cut;
    }
};

RenderParams params() {
    RenderParams p;
    p.refine = Refine::full;
    p.samples = 1;
    p.ao_samples = 8;
    p.emphasis = Emphasis::none;
    p.lines = Lines::none;
    return p;
}

/// Share of the hole's pixels in which the two pictures differ by more than 1/255.
double differing(const Pocket& pocket) {
    const MeshBvhs meshes = build_mesh_bvhs(pocket.cut_scene);
    const Cut cut = pocket.cut();
    Bvh opened = build_bvh(meshes, all_parts(pocket.cut_scene), cut.role);
    const Bvh targets = build_bvh(meshes, std::vector<PartId>{pocket.target});
    const std::vector<MeshSolid> solids = find_solids(pocket.cut_scene);
    const Caps caps = trace_caps(opened, cut, solids);
    add_caps(opened, caps.mesh);
    const Frame plain = render(opened, nullptr, pocket.view, params(), nullptr, nullptr);
    const Frame cut_frame = render(opened, &targets, pocket.view, params(), &cut, &plain, {}, &caps);

    const MeshBvhs real = build_mesh_bvhs(pocket.mesh_scene);
    const Frame mesh_frame =
        render(build_bvh(real, all_parts(pocket.mesh_scene)), nullptr, pocket.view, params(), nullptr, nullptr);
    int different = 0, all = 0;
    for (int y = 0; y < Pocket::kSize; ++y)
        for (int x = 0; x < Pocket::kSize; ++x) {
            if (cut.distance.at_or(x, y, 1.0f) > 0) continue;
            ++all;
            EXPECT_EQ(cut_frame.ids.id(x, y), mesh_frame.ids.id(x, y)) << x << ' ' << y;
            const Vec4f a = cut_frame.color(x, y), b = mesh_frame.color(x, y);
            const float d = std::max({std::abs(a.x - b.x), std::abs(a.y - b.y), std::abs(a.z - b.z)});
            different += d > 1.0f / 255;
        }
    const int left = Pocket::kSize / 2 - Pocket::kRadius + 3;
    EXPECT_EQ(cut_frame.inside(left, Pocket::kSize / 2), Frame::cap);
    return double(different) / double(all);
}

TEST(CapLight, StraightWallsAndFloorAreLitLikeTheMeshTheyAre) { EXPECT_LE(differing(Pocket(0)), 0.001); }

TEST(CapLight, ChamferIsLitLikeTheMeshItIs) { EXPECT_LE(differing(Pocket(16)), 0.001); }

} // namespace
} // namespace porthole
