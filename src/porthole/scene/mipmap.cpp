#include <algorithm>
#include <cmath>

#include "porthole/scene/texture.h"

namespace porthole {

namespace {

/// How the texels of an image are averaged.
struct Meaning {
    bool srgb = false;  ///< RGB are colours
    bool hides = false; ///< alpha says how much of the colour there is
};

std::vector<Meaning> find_meanings(const Scene& scene) {
    std::vector<Meaning> meanings(scene.images.size());
    const auto mean = [&](const TextureRef& ref, Meaning meaning) {
        if (!has_texture(scene, ref)) return;
        Meaning& m = meanings[std::size_t(scene.textures[std::size_t(ref.texture)].image)];
        m.srgb |= meaning.srgb;
        m.hides |= meaning.hides;
    };
    for (const Material& m : scene.materials) {
        mean(m.base_color_texture, {true, m.alpha_mode != AlphaMode::opaque});
        mean(m.emissive_texture, {true, false});
        if (m.specular_workflow) mean(m.metallic_roughness_texture, {true, false});
    }
    return meanings;
}

std::uint8_t byte_of(float value) { return static_cast<std::uint8_t>(std::clamp(value, 0.0f, 1.0f) * 255.0f + 0.5f); }

/// sRGB bytes of linear values; finer than a byte's steps everywhere.
const std::vector<std::uint8_t>& srgb_bytes() {
    static const std::vector<std::uint8_t> bytes = [] {
        std::vector<std::uint8_t> b(16384);
        for (std::size_t i = 0; i < b.size(); ++i) {
            const double v = double(i) / double(b.size() - 1);
            b[i] = byte_of(float(v <= 0.0031308 ? 12.92 * v : 1.055 * std::pow(v, 1 / 2.4) - 0.055));
        }
        return b;
    }();
    return bytes;
}

/// The texels that texel `i` of `n` covers in a row of `from`, and how much of each.
struct Cover {
    int first = 0, count = 0;
    float weight[4] = {};
};
std::vector<Cover> find_covers(int n, int from) {
    std::vector<Cover> covers(static_cast<std::size_t>(n));
    const double size = double(from) / n; // 1 to 3
    for (int i = 0; i < n; ++i) {
        Cover& c = covers[std::size_t(i)];
        c.first = int(std::floor(i * size));
        for (int k = c.first; k < from && k < (i + 1) * size && c.count < 4; ++k)
            c.weight[c.count++] = float((std::min((i + 1) * size, k + 1.0) - std::max(i * size, double(k))) / size);
    }
    return covers;
}

Image<Rgba8> halved(const Image<Rgba8>& image, Meaning meaning) {
    Image<Rgba8> half(std::max(1, image.width() / 2), std::max(1, image.height() / 2));
    const std::vector<Cover> columns = find_covers(half.width(), image.width());
    const std::vector<Cover> rows = find_covers(half.height(), image.height());
    const Rect w = image.window();
    constexpr float kByte = 1.0f / 255.0f;
    const auto value = [&](std::uint8_t v) { return meaning.srgb ? linear_from_srgb8(v) : float(v) * kByte; };
    const auto encoded = [&](float v) {
        if (!meaning.srgb) return byte_of(v);
        const auto& bytes = srgb_bytes();
        return bytes[std::size_t(std::clamp(v, 0.0f, 1.0f) * float(bytes.size() - 1) + 0.5f)];
    };
    for (int y = 0; y < half.height(); ++y)
        for (int x = 0; x < half.width(); ++x) {
            const Cover &cx = columns[std::size_t(x)], &cy = rows[std::size_t(y)];
            Vec3f plain{0, 0, 0}, covered{0, 0, 0};
            float alpha = 0;
            for (int j = 0; j < cy.count; ++j)
                for (int i = 0; i < cx.count; ++i) {
                    const Rgba8 p = image(w.x0 + cx.first + i, w.y0 + cy.first + j);
                    const float weight = cx.weight[i] * cy.weight[j];
                    const Vec3f c{value(p.r), value(p.g), value(p.b)};
                    const float a = float(p.a) * kByte * weight;
                    plain += c * weight;
                    covered += c * a;
                    alpha += a;
                }
            const Vec3f c = meaning.hides && alpha > 0 ? covered / alpha : plain;
            half(x, y) = {encoded(c.x), encoded(c.y), encoded(c.z), byte_of(alpha)};
        }
    return half;
}

} // namespace

void build_mips(Scene& scene, const Control& control) {
    const std::vector<Meaning> meanings = find_meanings(scene);
    scene.mips.assign(scene.images.size(), {});
    parallel_for(scene.images.size(), control, [&](std::size_t i) {
        const Image<Rgba8>* above = &scene.images[i];
        std::vector<Image<Rgba8>> levels;
        levels.reserve(32);
        while (!above->empty() && (above->width() > 1 || above->height() > 1)) {
            levels.push_back(halved(*above, meanings[i]));
            above = &levels.back();
        }
        scene.mips[i] = std::move(levels);
    });
}

} // namespace porthole
