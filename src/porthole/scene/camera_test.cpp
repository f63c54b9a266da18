#include "porthole/scene/camera.h"

#include <cmath>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace porthole {
namespace {

using ::testing::HasSubstr;

Mesh box_mesh(Vec3f lower, Vec3f upper) {
    Mesh mesh;
    const Bounds3f b{lower, upper};
    for (int i = 0; i < 8; ++i) mesh.positions.push_back(b.corner(i));
    mesh.bounds = b;
    return mesh;
}

void add_part(Scene& scene, Mesh mesh) {
    Part part;
    part.mesh = std::uint32_t(scene.meshes.size());
    scene.meshes.push_back(std::move(mesh));
    scene.parts.push_back(part);
}

/// A wide box; part 1 is a small one inside, off the centre.
Scene nested() {
    Scene scene;
    add_part(scene, box_mesh({-2, -1, -1.5f}, {2, 1, 1.5f}));
    add_part(scene, box_mesh({1.0f, 0.2f, 0.1f}, {1.1f, 0.25f, 0.3f}));
    return scene;
}

const std::vector<PartId> kInner{PartId{1}};

struct Seen {
    float x0 = kInfinity, x1 = -kInfinity, y0 = kInfinity, y1 = -kInfinity, nearest = kInfinity;
};

Seen seen(const View& view, const std::vector<Vec3f>& points) {
    Seen s;
    for (const Vec3f p : points) {
        const PixelPoint q = view.project(p);
        s.x0 = std::min(s.x0, q.x), s.x1 = std::max(s.x1, q.x);
        s.y0 = std::min(s.y0, q.y), s.y1 = std::max(s.y1, q.y);
        s.nearest = std::min(s.nearest, q.depth);
    }
    return s;
}

void expect_sound(const View& v, const std::string& what) {
    const Affine3f& m = v.world_from_camera;
    EXPECT_TRUE(is_finite(m.p)) << what;
    EXPECT_TRUE(std::isfinite(v.half_height) && v.half_height > 0) << what;
    EXPECT_NEAR(dot(m.x, m.x), 1, 1e-5) << what;
    EXPECT_NEAR(dot(m.y, m.y), 1, 1e-5) << what;
    EXPECT_NEAR(dot(m.z, m.z), 1, 1e-5) << what;
    EXPECT_NEAR(m.determinant(), 1, 1e-5) << what;
}

TEST(Camera, NamedSidesLookAsTheySay) {
    const Scene scene = nested();
    const FrameSubject subject = frame_subject(scene, {});
    const struct {
        const char* name;
        Vec3f right, up;
    } sides[] = {{"front", {1, 0, 0}, {0, 1, 0}},  {"back", {-1, 0, 0}, {0, 1, 0}}, {"left", {0, 0, 1}, {0, 1, 0}},
                 {"right", {0, 0, -1}, {0, 1, 0}}, {"top", {1, 0, 0}, {0, 0, -1}},  {"bottom", {1, 0, 0}, {0, 0, 1}}};
    for (const auto& side : sides) {
        const View v = make_view(scene, subject, {.name = side.name}, 640, 360);
        expect_sound(v, side.name);
        EXPECT_NEAR(dot(v.world_from_camera.x, side.right), 1, 1e-6) << side.name;
        EXPECT_NEAR(dot(v.world_from_camera.y, side.up), 1, 1e-6) << side.name;
    }
    const View a = make_view(scene, subject, {.name = "auto"}, 64, 64);
    const View iso = make_view(scene, subject, {.name = "iso"}, 64, 64);
    EXPECT_EQ(a.world_from_camera, iso.world_from_camera);
}

TEST(Camera, WholeModelTouchesTheBorderOnOneAxis) {
    const Scene scene = nested();
    const FrameSubject subject = frame_subject(scene, {});
    for (const bool orthographic : {false, true})
        for (const Vec2i size : {Vec2i{1920, 1080}, Vec2i{300, 900}, Vec2i{64, 64}, Vec2i{1, 1}})
            for (const Vec3f direction : candidate_directions()) {
                const CameraParams params{.orthographic = orthographic};
                const View v = view_from_direction(subject, direction, params, size.x, size.y);
                const Seen s = seen(v, scene.meshes[0].positions);
                const float w = float(size.x), h = float(size.y);
                const float used_x = std::max(w / 2 - s.x0, s.x1 - w / 2) / (w / 2);
                const float used_y = std::max(h / 2 - s.y0, s.y1 - h / 2) / (h / 2);
                EXPECT_NEAR(std::max(used_x, used_y), 0.91f, 2e-3f) << size.x << 'x' << size.y;
                EXPECT_GT(s.nearest, 0);
                EXPECT_NEAR(s.x0 / w, 1 - s.x1 / w, 2e-3f) << "the same border left and right";
                EXPECT_NEAR(s.y0 / h, 1 - s.y1 / h, 2e-3f) << "the same border above and below";
            }
}

TEST(Camera, TightensUntilTargetsSpanFifteenPercent) {
    const Scene scene = nested();
    const FrameSubject subject = frame_subject(scene, kInner);
    for (const bool orthographic : {false, true})
        for (const Vec3f direction : candidate_directions()) {
            CameraParams params{.orthographic = orthographic, .frame = Framing::all};
            const View all = view_from_direction(subject, direction, params, 1920, 1080);
            params.frame = Framing::automatic;
            const View near = view_from_direction(subject, direction, params, 1920, 1080);
            const Seen s = seen(near, scene.meshes[1].positions);
            EXPECT_NEAR(std::max(s.x1 - s.x0, s.y1 - s.y0), 0.15f * 1080, 2.0f);
            EXPECT_TRUE(s.x0 >= 0 && s.y0 >= 0 && s.x1 <= 1920 && s.y1 <= 1080);
            EXPECT_LT(near.half_height, all.half_height);
            EXPECT_EQ(near.world_from_camera.z, all.world_from_camera.z) << "the same direction";
            const Vec3f moved = near.eye() - all.eye();
            EXPECT_NEAR(dot(moved, near.world_from_camera.z), 0, 1e-5) << "only sideways, not into the model";
        }
}

TEST(Camera, LargeTargetsChangeNothing) {
    const Scene scene = nested();
    const FrameSubject plain = frame_subject(scene, {});
    const FrameSubject with = frame_subject(scene, std::vector<PartId>{PartId{0}});
    const View a = view_from_direction(plain, {1, 1, 1}, {}, 640, 480);
    const View b = view_from_direction(with, {1, 1, 1}, {}, 640, 480);
    EXPECT_NEAR(length(a.eye() - b.eye()), 0, 1e-5);
    EXPECT_EQ(a.half_height, b.half_height);
}

TEST(Camera, LongTargetsStayInsideNarrowPictures) {
    Scene scene = nested();
    add_part(scene, box_mesh({-1.9f, 0.5f, 0}, {1.9f, 0.501f, 0.001f}));
    const FrameSubject subject = frame_subject(scene, std::vector<PartId>{PartId{2}});
    for (const Vec2i size : {Vec2i{1920, 1080}, Vec2i{60, 1000}}) {
        const View v = view_from_direction(subject, {0, 0, 1}, {}, size.x, size.y);
        const Seen s = seen(v, scene.meshes[2].positions);
        EXPECT_GE(s.x0, 0);
        EXPECT_LE(s.x1, float(size.x));
        EXPECT_GE(s.y0, 0);
        EXPECT_LE(s.y1, float(size.y));
    }
}

TEST(Camera, AnySizeFlatOrPointLikeStaysFinite) {
    for (const float scale : {1e-6f, 1e-3f, 1.0f, 1e4f, 1e7f})
        for (const Vec3f extent : {Vec3f{1, 1, 1}, Vec3f{1, 0, 1}, Vec3f{0, 0, 1}, Vec3f{0, 0, 0}, Vec3f{1, 1e-4f, 0}})
            for (const Vec3f offset : {Vec3f{0, 0, 0}, Vec3f{3, -2, 1}}) {
                Scene scene;
                add_part(scene, box_mesh(offset * scale, (offset + extent) * scale));
                add_part(scene, box_mesh(offset * scale, offset * scale));
                const FrameSubject subject = frame_subject(scene, kInner);
                for (const bool orthographic : {false, true})
                    for (const Vec3f direction : candidate_directions()) {
                        const View v =
                            view_from_direction(subject, direction, {.orthographic = orthographic}, 320, 200);
                        const std::string what = "scale " + std::to_string(scale);
                        expect_sound(v, what);
                        const Seen s = seen(v, scene.meshes[1].positions);
                        ASSERT_GT(s.nearest, 0) << what;
                        ASSERT_TRUE(s.x0 >= -1 && s.x1 <= 321 && s.y0 >= -1 && s.y1 <= 201)
                            << what << " extent " << extent.x << extent.y << extent.z << " at " << offset.x << ": "
                            << s.x0 << " " << s.x1 << " " << s.y0 << " " << s.y1;
                        const Ray r = v.ray(0.5f, 0.5f);
                        ASSERT_TRUE(is_finite(r.origin) && is_finite(r.direction)) << what;
                    }
            }
    const View empty = make_view(Scene{}, {}, {}, 10, 10);
    expect_sound(empty, "no parts");
}

TEST(Camera, HullOfARoundMeshIsCloseEnoughForTheBorder) {
    Scene scene;
    Mesh ball;
    std::vector<PartId> parts;
    for (int i = 0; i <= 100; ++i)
        for (int j = 0; j < 200; ++j) {
            const float a = kPi * float(i) / 100, b = 2 * kPi * float(j) / 200;
            ball.positions.push_back({5 + std::sin(a) * std::cos(b), std::cos(a), std::sin(a) * std::sin(b)});
        }
    add_part(scene, ball);
    const FrameSubject subject = frame_subject(scene, {});
    EXPECT_LE(subject.whole.size(), 200u);
    for (const Vec3f direction : candidate_directions()) {
        const View v = view_from_direction(subject, direction, {}, 500, 500);
        const Seen s = seen(v, ball.positions);
        EXPECT_TRUE(s.x0 > 0 && s.x1 < 500 && s.y0 > 0 && s.y1 < 500);
        EXPECT_GT(s.y1 - s.y0, 430);
    }
}

TEST(Camera, OrderAndRepetitionOfPartsDoNotMatter) {
    Scene scene;
    std::uint32_t state = 1;
    for (int i = 0; i < 300; ++i) {
        const auto next = [&] {
            state = state * 1664525u + 1013904223u;
            return float(state >> 8) / float(1 << 24) * 10 - 5;
        };
        const Vec3f p{next(), next(), next()};
        add_part(scene, box_mesh(p, p + Vec3f{1, 1, 1}));
    }
    Scene shuffled = scene;
    std::reverse(shuffled.parts.begin(), shuffled.parts.end());
    shuffled.parts.push_back(shuffled.parts[7]);
    EXPECT_EQ(frame_subject(scene, {}).whole, frame_subject(shuffled, {}).whole);
}

TEST(Camera, F3dOptions) {
    Scene scene = nested();
    scene.origin = {100, 0, 0};
    const FrameSubject subject = frame_subject(scene, {});
    {
        const View v =
            make_view(scene, subject, {.position = Vec3d{100, 0, 7}, .focal_point = Vec3d{100, 0, 0}}, 64, 64);
        EXPECT_NEAR(length(v.eye() - Vec3f{0, 0, 7}), 0, 1e-5) << "file coordinates less the origin";
        EXPECT_NEAR(length(v.forward() - Vec3f{0, 0, -1}), 0, 1e-6);
        EXPECT_NEAR(v.half_height, std::tan(15 * kPi / 180), 1e-6);
    }
    {
        const View v = make_view(scene, subject, {.direction = Vec3d{-2, 0, 0}}, 64, 64);
        EXPECT_NEAR(length(v.forward() - Vec3f{-1, 0, 0}), 0, 1e-6);
    }
    {
        const View v = make_view(scene, subject, {.name = "front", .azimuth_deg = 90}, 64, 64);
        EXPECT_NEAR(length(v.forward() - Vec3f{-1, 0, 0}), 0, 1e-6) << "azimuth carries the eye to the right";
    }
    {
        const View v = make_view(scene, subject, {.name = "front", .elevation_deg = 30}, 64, 64);
        EXPECT_NEAR(v.forward().y, -0.5f, 1e-6) << "elevation carries it up";
    }
    {
        const View a = make_view(scene, subject, {.name = "front"}, 64, 64);
        const View b = make_view(scene, subject, {.name = "front", .zoom = 2}, 64, 64);
        EXPECT_NEAR(b.half_height, a.half_height / 2, 1e-6);
        EXPECT_EQ(a.eye(), b.eye());
    }
    {
        const View v = make_view(scene, subject, {.name = "front", .focal_point = Vec3d{101, 0.5, 0}}, 64, 64);
        const PixelPoint p = v.project({1, 0.5f, 0});
        EXPECT_NEAR(p.x, 32, 1e-3);
        EXPECT_NEAR(p.y, 32, 1e-3);
        const Seen s = seen(v, subject.whole);
        EXPECT_TRUE(s.x0 >= 0 && s.x1 <= 64 && s.y0 >= 0 && s.y1 <= 64);
    }
    EXPECT_TRUE(is_auto({}));
    EXPECT_FALSE(is_auto({.direction = Vec3d{1, 0, 0}}));
}

TEST(Camera, CamerasOfTheFile) {
    Scene scene = nested();
    FileCamera good;
    good.name = "Shot";
    good.world_from_camera.p = {0.5, 1, 9};
    good.fov_y = 0.5f;
    FileCamera flat = good;
    flat.name = "Flat";
    flat.world_from_camera.x = {0, 0, 0};
    scene.cameras = {good, flat};
    const FrameSubject subject = frame_subject(scene, kInner);
    for (const char* name : {"Shot", "#0"}) {
        const View v = make_view(scene, subject, {.name = name}, 64, 48);
        EXPECT_NEAR(length(v.eye() - Vec3f{0.5f, 1, 9}), 0, 1e-6);
        EXPECT_NEAR(length(v.world_from_camera.y - Vec3f{0, 1, 0}), 0, 1e-6);
        EXPECT_NEAR(v.half_height, std::tan(0.25f), 1e-6);
    }
    const auto code_and_reason = [&](const CameraParams& params) {
        try {
            (void)make_view(scene, subject, params, 64, 48);
        } catch (const Error& e) {
            return e.code + ' ' + e.what();
        }
        return std::string("no error");
    };
    EXPECT_THAT(code_and_reason({.name = "Shoot"}), HasSubstr("E0112"));
    EXPECT_THAT(code_and_reason({.name = "Shoot"}), HasSubstr("\"Shot\""));
    EXPECT_THAT(code_and_reason({.name = "Flat"}), HasSubstr("E0113"));
    EXPECT_THAT(code_and_reason({.zoom = 0}), HasSubstr("E0113"));
    EXPECT_THAT(code_and_reason({.view_angle_deg = 180}), HasSubstr("E0113"));
    EXPECT_THAT(code_and_reason({.direction = Vec3d{0, 0, 0}}), HasSubstr("E0113"));
    EXPECT_THAT(code_and_reason({.position = Vec3d{NAN, 0, 0}}), HasSubstr("E0113"));
    EXPECT_THAT(code_and_reason({.position = Vec3d{0, 1e16, 0}}), HasSubstr("E0113"));
}

TEST(Camera, CandidatesAreUnitAndSpread) {
    const std::vector<Vec3f> directions = candidate_directions();
    ASSERT_EQ(directions.size(), 71u);
    for (std::size_t i = 0; i < directions.size(); ++i) {
        EXPECT_NEAR(length(directions[i]), 1, 1e-6);
        if (i >= 64) continue;
        EXPECT_GE(directions[i].y, -0.5f);
        EXPECT_LE(directions[i].y, 0.966f);
        float nearest = 2;
        for (std::size_t k = 0; k < 64; ++k)
            if (k != i) nearest = std::min(nearest, length(directions[i] - directions[k]));
        EXPECT_GT(nearest, 0.2f);
        EXPECT_LT(nearest, 0.5f);
    }
}

} // namespace
} // namespace porthole
