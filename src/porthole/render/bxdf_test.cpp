#include "porthole/render/bxdf.h"

#include <gtest/gtest.h>

namespace porthole {
namespace {

Vec3f from_angle(float theta, float phi) {
    return {std::sin(theta) * std::cos(phi), std::sin(theta) * std::sin(phi), std::cos(theta)};
}

TEST(Fresnel, MatchesTheFormulasAtKnownAngles) {
    // Normal incidence: ((n-1)/(n+1))^2, from both sides.
    EXPECT_NEAR(fresnel_dielectric(1.0f, 1.5f), 0.04f, 1e-6f);
    EXPECT_NEAR(fresnel_dielectric(1.0f, 1.0f / 1.5f), 0.04f, 1e-6f);
    EXPECT_NEAR(f0_from_ior(1.5f), 0.04f, 1e-6f);
    EXPECT_NEAR(fresnel_dielectric(0.0f, 1.5f), 1.0f, 1e-6f);
    // The unpolarised mean of both polarisations, by Snell's law, at 60 degrees.
    const double ci = 0.5, st = std::sqrt(0.75) / 1.5, ct = std::sqrt(1 - st * st);
    const double rs = (ci - 1.5 * ct) / (ci + 1.5 * ct), rp = (1.5 * ci - ct) / (1.5 * ci + ct);
    EXPECT_NEAR(fresnel_dielectric(0.5f, 1.5f), float(0.5 * (rs * rs + rp * rp)), 1e-5f);
    // Beyond the critical angle everything is reflected.
    const float critical = std::cos(std::asin(1.0f / 1.5f));
    EXPECT_EQ(fresnel_dielectric(critical * 0.99f, 1.0f / 1.5f), 1.0f);
    EXPECT_LT(fresnel_dielectric(critical * 1.01f, 1.0f / 1.5f), 1.0f);
}

TEST(Refract, ObeysSnellAndReflectsTotallyBeyondTheCriticalAngle) {
    const Vec3f n{0, 0, 1};
    for (const float eta : {1.5f, 1.0f / 1.5f, 1.0f, 2.4f}) {
        for (float theta = 0.0f; theta < 1.55f; theta += 0.05f) {
            const Vec3f d = -from_angle(theta, 0.7f);
            const float sin_t = std::sin(theta) / eta;
            const auto t = refract(d, n, eta);
            ASSERT_EQ(t.has_value(), sin_t < 1.0f) << theta << ' ' << eta;
            if (!t) continue;
            EXPECT_NEAR(length(*t), 1.0f, 1e-5f);
            EXPECT_NEAR(std::hypot(t->x, t->y), sin_t, 2e-5f);
            EXPECT_LT(t->z, 0.0f);
            EXPECT_NEAR(t->x * d.y, t->y * d.x, 1e-5f); // stays in the plane of incidence
        }
    }
}

TEST(Reflect, MirrorsAboutTheNormal) {
    const Vec3f d = normalize(Vec3f{1, -2, 0.5f}), r = reflect(d, {0, 1, 0});
    EXPECT_NEAR(r.x, d.x, 1e-6f);
    EXPECT_NEAR(r.y, -d.y, 1e-6f);
    EXPECT_NEAR(r.z, d.z, 1e-6f);
}

TEST(Ggx, IsReciprocal) {
    const Vec3f n{0, 0, 1}, f0{0.9f, 0.6f, 0.2f};
    for (const float alpha : {0.05f, 0.3f, 1.0f})
        for (float a = 0.1f; a < 1.5f; a += 0.2f)
            for (float b = 0.1f; b < 1.5f; b += 0.2f) {
                const Vec3f i = from_angle(a, 0.3f), o = from_angle(b, 2.5f);
                const Vec3f x = ggx(f0, alpha, n, i, o), y = ggx(f0, alpha, n, o, i);
                EXPECT_NEAR(x.x, y.x, 1e-4f * (1 + x.x));
                EXPECT_NEAR(x.z, y.z, 1e-4f * (1 + x.z));
            }
    EXPECT_EQ(ggx(f0, 0.3f, n, from_angle(1.7f, 0), from_angle(0.3f, 0)), (Vec3f{0, 0, 0}));
}

// Integral of the lobe with cosine over the hemisphere, by quadrature over the sphere of
// incoming directions.
double lobe_integral(float roughness, float theta_o, Vec3f f0) {
    const Vec3f n{0, 0, 1}, o = from_angle(theta_o, 0);
    const int rows = 600, columns = 600;
    double sum = 0;
    for (int i = 0; i < rows; ++i) {
        const double theta = (i + 0.5) / rows * (M_PI / 2);
        for (int j = 0; j < columns; ++j) {
            const double phi = (j + 0.5) / columns * 2 * M_PI;
            const Vec3f v = ggx(f0, roughness * roughness, n, from_angle(float(theta), float(phi)), o);
            sum += double(v.x) * std::cos(theta) * std::sin(theta);
        }
    }
    return sum * (M_PI / 2 / rows) * (2 * M_PI / columns);
}

TEST(Ggx, ReflectsNoMoreThanItGetsAndMatchesTheAlbedoFit) {
    for (const float roughness : {0.3f, 0.5f, 0.8f, 1.0f})
        for (const float theta : {0.1f, 0.6f, 1.1f}) {
            const LobeAlbedo fit = lobe_albedo(roughness, std::cos(theta));
            const double white = lobe_integral(roughness, theta, {1, 1, 1});
            EXPECT_LE(white, 1.001) << roughness << ' ' << theta;
            EXPECT_NEAR(fit.of({1, 1, 1}).x, white, 0.02) << roughness << ' ' << theta;
            const double plastic = lobe_integral(roughness, theta, {0.04f, 0.04f, 0.04f});
            EXPECT_NEAR(fit.of({0.04f, 0, 0}).x, plastic, 0.01) << roughness << ' ' << theta;
            // With what single scattering loses given back, a white metal keeps all light and
            // no more than that.
            const double whole = white * double(fit.compensation({1, 1, 1}).x);
            EXPECT_NEAR(whole, 1.0, 0.02) << roughness << ' ' << theta;
        }
}

} // namespace
} // namespace porthole
