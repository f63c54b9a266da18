#include "porthole/render/bxdf.h"

#include <array>
#include <cstdint>

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
    const float visibility =
        0.5f / (nl * std::sqrt(nv * nv * (1.0f - a2) + a2) + nv * std::sqrt(nl * nl * (1.0f - a2) + a2));
    return fresnel_schlick(f0, dot(wi, h)) * (distribution * visibility);
}

namespace {

constexpr int kAlbedoSteps = 16; ///< of roughness and of cosine, from 0 to 1

float radical_inverse(std::uint32_t bits) {
    float value = 0, digit = 0.5f;
    for (; bits; bits >>= 1, digit *= 0.5f) value += bits & 1 ? digit : 0.0f;
    return value;
}

/// Directional albedo by importance sampling: half vectors spread as the lobe is.
LobeAlbedo integrate_lobe(float roughness, float cosine) {
    const float alpha = std::max(roughness * roughness, 1e-3f), a2 = alpha * alpha;
    const float nv = std::max(cosine, 1e-3f);
    const Vec3f wo{std::sqrt(1.0f - nv * nv), 0, nv};
    constexpr int kSamples = 256;
    double scale = 0, bias = 0;
    for (int i = 0; i < kSamples; ++i) {
        const float u = (float(i) + 0.5f) / kSamples, phi = 2 * kPi * radical_inverse(std::uint32_t(i));
        const float nh = std::sqrt((1.0f - u) / (1.0f + (a2 - 1.0f) * u)),
                    sh = std::sqrt(std::max(0.0f, 1.0f - nh * nh));
        const Vec3f h{sh * std::cos(phi), sh * std::sin(phi), nh};
        const float vh = dot(wo, h);
        const float nl = 2.0f * vh * nh - nv;
        if (!(nl > 0) || !(vh > 0)) continue;
        const float smith =
            0.5f / (nl * std::sqrt(nv * nv * (1.0f - a2) + a2) + nv * std::sqrt(nl * nl * (1.0f - a2) + a2));
        const double weight = double(smith) * 4.0 * double(vh) * double(nl) / double(nh);
        const double fresnel = std::pow(1.0 - double(vh), 5.0);
        scale += (1.0 - fresnel) * weight;
        bias += fresnel * weight;
    }
    return {float(scale / kSamples), float(bias / kSamples)};
}

using AlbedoTable = std::array<std::array<LobeAlbedo, kAlbedoSteps + 1>, kAlbedoSteps + 1>;

const AlbedoTable& albedo_table() {
    static const AlbedoTable table = [] {
        AlbedoTable t{};
        for (int r = 0; r <= kAlbedoSteps; ++r)
            for (int c = 0; c <= kAlbedoSteps; ++c)
                t[std::size_t(r)][std::size_t(c)] = integrate_lobe(float(r) / kAlbedoSteps, float(c) / kAlbedoSteps);
        return t;
    }();
    return table;
}

} // namespace

LobeAlbedo lobe_albedo(float roughness, float cosine) {
    const AlbedoTable& table = albedo_table();
    const float r = clamp01(roughness) * kAlbedoSteps, c = clamp01(cosine) * kAlbedoSteps;
    const int r0 = std::min(int(r), kAlbedoSteps - 1), c0 = std::min(int(c), kAlbedoSteps - 1);
    const float fr = r - float(r0), fc = c - float(c0);
    const auto mixed = [&](float LobeAlbedo::*field) {
        const auto& low = table[std::size_t(r0)];
        const auto& high = table[std::size_t(r0 + 1)];
        const float a = low[std::size_t(c0)].*field * (1 - fc) + low[std::size_t(c0 + 1)].*field * fc;
        const float b = high[std::size_t(c0)].*field * (1 - fc) + high[std::size_t(c0 + 1)].*field * fc;
        return a * (1 - fr) + b * fr;
    };
    return {mixed(&LobeAlbedo::scale), mixed(&LobeAlbedo::bias)};
}

Vec3f LobeAlbedo::compensation(Vec3f f0) const {
    const float single = std::clamp(scale + bias, 0.1f, 1.0f);
    return Vec3f{1, 1, 1} + f0 * (1.0f / single - 1.0f);
}

} // namespace porthole
