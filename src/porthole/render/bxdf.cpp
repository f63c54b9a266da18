#include "porthole/render/bxdf.h"

namespace porthole {

std::optional<Vec3f> refract(Vec3f d, Vec3f n, float eta) {
    const float cos_i = -dot(d, n);
    const float r = 1.0f / eta;
    const float sin2_t = r * r * std::max(0.0f, 1.0f - cos_i * cos_i);
    if (sin2_t >= 1.0f) return std::nullopt;
    return normalize(d * r + n * (r * cos_i - std::sqrt(1.0f - sin2_t)), d);
}

float fresnel_dielectric(float cosine, float eta) {
    const float c = clamp01(cosine);
    const float g2 = eta * eta - 1.0f + c * c;
    if (g2 <= 0) return 1.0f;
    const float g = std::sqrt(g2);
    const float a = (g - c) / (g + c);
    const float b = (c * (g + c) - 1.0f) / (c * (g - c) + 1.0f);
    return std::min(1.0f, 0.5f * a * a * (1.0f + b * b));
}

Vec3f fresnel_schlick(Vec3f f0, float cosine) {
    const float m = 1.0f - clamp01(cosine);
    const float m2 = m * m, m5 = m2 * m2 * m;
    return f0 + (Vec3f{1, 1, 1} - f0) * m5;
}

Vec3f ggx(Vec3f f0, float alpha, Vec3f n, Vec3f wi, Vec3f wo) {
    const float nl = dot(n, wi), nv = dot(n, wo);
    if (!(nl > 0) || !(nv > 0)) return {0, 0, 0};
    const Vec3f h = normalize(wi + wo, n);
    const float nh = clamp01(dot(n, h));
    const float a2 = alpha * alpha;
    const float d = nh * nh * (a2 - 1.0f) + 1.0f;
    const float distribution = a2 / (kPi * d * d);
    const float visibility = 0.5f / (nl * std::sqrt(nv * nv * (1.0f - a2) + a2) + nv * std::sqrt(nl * nl * (1.0f - a2) + a2));
    return fresnel_schlick(f0, dot(wi, h)) * (distribution * visibility);
}

LobeAlbedo lobe_albedo(float roughness, float cosine) {
    const float r = clamp01(roughness), c = clamp01(cosine);
    const float x = 1.0f - r, y = 0.0425f - 0.0275f * r, z = 1.04f - 0.572f * r, w = 0.022f * r - 0.04f;
    const float a = std::min(x * x, std::exp2(-9.28f * c)) * x + y;
    return {std::max(0.0f, z - 1.04f * a), std::max(0.0f, w + 1.04f * a)};
}

Vec3f LobeAlbedo::compensation(Vec3f f0) const {
    const float single = std::clamp(scale + bias, 0.1f, 1.0f);
    return Vec3f{1, 1, 1} + f0 * (1.0f / single - 1.0f);
}

} // namespace porthole
