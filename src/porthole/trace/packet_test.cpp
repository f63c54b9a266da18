#include "porthole/trace/packet.h"

#include <gtest/gtest.h>

#include <bit>
#include <random>

#include "support/shapes.h"

namespace porthole {
namespace {

std::uint32_t bits(float v) { return std::bit_cast<std::uint32_t>(v); }

/// The lane against View::ray at the same place.
void expect_same_ray(const RayHit16& rays, int lane, float depth_per_t, const Ray& ray) {
    const Vec3f org = rays.origin(lane), dir = rays.direction(lane);
    ASSERT_EQ(bits(org.x), bits(ray.origin.x));
    ASSERT_EQ(bits(org.y), bits(ray.origin.y));
    ASSERT_EQ(bits(org.z), bits(ray.origin.z));
    ASSERT_EQ(bits(dir.x), bits(ray.direction.x));
    ASSERT_EQ(bits(dir.y), bits(ray.direction.y));
    ASSERT_EQ(bits(dir.z), bits(ray.direction.z));
    ASSERT_EQ(bits(depth_per_t), bits(ray.depth_per_t));
}

TEST(Packet, RaysAreThoseOfTheViewBitForBit) {
    std::mt19937 random(11);
    std::uniform_real_distribution<float> place(-300, 2300);
    std::normal_distribution<float> normal;
    for (int k = 0; k < 200; ++k) {
        const Vec3f eye = normalize(Vec3f{normal(random), normal(random), normal(random)}) * (0.1f + float(k));
        const View view = test::look(eye, {0.1f, -0.2f, 0.3f}, 1920, 1080 - k, 0.37f, k % 2 == 0);
        float x[kLanes], y[kLanes], depth_per_t[kLanes];
        for (int i = 0; i < kLanes; ++i) x[i] = place(random), y[i] = place(random);
        RayHit16 rays;
        set_rays(rays, depth_per_t, view, x, y, 5);
        for (int i = 0; i < kLanes; ++i) {
            expect_same_ray(rays, i, depth_per_t[i], view.ray(x[i], y[i]));
            EXPECT_EQ(rays.mask[i], 5u);
            EXPECT_EQ(rays.id[i], std::uint32_t(i));
            EXPECT_TRUE(rays.active(i) && !rays.hit(i) && rays.tnear[i] == 0 && rays.tfar[i] == kInfinity);
        }
    }
}

TEST(Packet, BlocksLeaveOutWhatIsOutsideTheWindow) {
    const View view = test::look({0, 0, 5}, {}, 40, 30, 0.4f);
    RayHit16 rays;
    float depth_per_t[kLanes];
    EXPECT_EQ(set_block_rays(rays, depth_per_t, view, 8, 4, {0, 0, 40, 30}), kLanes);
    EXPECT_EQ(set_block_rays(rays, depth_per_t, view, 8, 4, {10, 5, 40, 30}), 6);
    for (int i = 0; i < kLanes; ++i) {
        const int x = 8 + i % 4, y = 4 + i / 4;
        EXPECT_EQ(rays.active(i), x >= 10 && y >= 5) << i;
        if (rays.active(i)) expect_same_ray(rays, i, depth_per_t[i], view.ray(float(x) + 0.5f, float(y) + 0.5f));
    }
    EXPECT_EQ(set_block_rays(rays, depth_per_t, view, 8, 4, {20, 20, 40, 30}), 0);
}

} // namespace
} // namespace porthole
