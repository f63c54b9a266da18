#include "porthole/io/gltf_material.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "porthole/io/gltf_node.h"

namespace porthole::gltf {
namespace {

// A number that should lie in [low, high]; brought there, with a warning, when it does not.
float number_in(Document& doc, const Json& object, std::string_view key, double fallback, double low, double high) {
    const double value = doc.number_or(object, key, fallback);
    if (value >= low && value <= high) return static_cast<float>(value);
    const double used = std::isnan(value) ? fallback : std::clamp(value, low, high);
    doc.warn("W0303", object, key,
             "is " + std::to_string(value) + ", out of range; " + std::to_string(used) + " is used");
    return static_cast<float>(used);
}

template <std::size_t N>
std::array<float, N> color_in(Document& doc, const Json& object, std::string_view key, std::array<float, N> fallback) {
    double values[N];
    if (!doc.numbers(object, key, values)) return fallback;
    std::array<float, N> color;
    for (std::size_t k = 0; k < N; ++k) {
        if (!(values[k] >= 0 && values[k] <= 1))
            doc.warn("W0303", object, key, "has " + std::to_string(values[k]) + ", out of [0, 1]; clamped");
        color[k] = static_cast<float>(values[k] > 0 ? std::min(values[k], 1.0) : 0.0);
    }
    return color;
}

Vec3f color3_in(Document& doc, const Json& object, std::string_view key, Vec3f fallback) {
    const auto c = color_in<3>(doc, object, key, {fallback.x, fallback.y, fallback.z});
    return {c[0], c[1], c[2]};
}

Vec4f color4_in(Document& doc, const Json& object, std::string_view key) {
    const auto c = color_in<4>(doc, object, key, {1, 1, 1, 1});
    return {c[0], c[1], c[2], c[3]};
}

void read_metallic_roughness(Document& doc, const Json& pbr, TextureReader& textures, Material& m) {
    m.base_color = color4_in(doc, pbr, "baseColorFactor");
    m.base_color_texture = textures.read(pbr, "baseColorTexture");
    m.metallic = number_in(doc, pbr, "metallicFactor", 1, 0, 1);
    m.roughness = number_in(doc, pbr, "roughnessFactor", 1, 0, 1);
    m.metallic_roughness_texture = textures.read(pbr, "metallicRoughnessTexture");
}

void read_specular_glossiness(Document& doc, const Json& spec, TextureReader& textures, Material& m) {
    m.specular_workflow = true;
    m.base_color = color4_in(doc, spec, "diffuseFactor");
    m.base_color_texture = textures.read(spec, "diffuseTexture");
    m.specular_color = color3_in(doc, spec, "specularFactor", {1, 1, 1});
    m.metallic = 0;
    m.roughness = 1 - number_in(doc, spec, "glossinessFactor", 1, 0, 1);
    m.metallic_roughness_texture = textures.read(spec, "specularGlossinessTexture");
}

void read_extensions(Document& doc, const Json& json, TextureReader& textures, Material& m) {
    constexpr double kHuge = 1e30;
    m.unlit = doc.extension(json, "KHR_materials_unlit") != nullptr;
    if (const Json* e = doc.extension(json, "KHR_materials_emissive_strength"))
        m.emissive *= number_in(doc, *e, "emissiveStrength", 1, 0, kHuge);
    if (const Json* e = doc.extension(json, "KHR_materials_ior")) {
        m.ior = number_in(doc, *e, "ior", 1.5, 0, 100);
        if (m.ior < 1 && m.ior != 0) {
            doc.warn("W0303", *e, "ior", "is " + std::to_string(m.ior) + ", below 1; 1 is used");
            m.ior = 1;
        }
    }
    if (const Json* e = doc.extension(json, "KHR_materials_transmission")) {
        m.transmission = number_in(doc, *e, "transmissionFactor", 0, 0, 1);
        m.transmission_texture = textures.read(*e, "transmissionTexture");
    }
    if (const Json* e = doc.extension(json, "KHR_materials_volume")) {
        m.thickness = number_in(doc, *e, "thicknessFactor", 0, 0, kHuge);
        m.attenuation_color = color3_in(doc, *e, "attenuationColor", {1, 1, 1});
        if (Document::find(*e, "attenuationDistance")) {
            const double distance = doc.number_or(*e, "attenuationDistance", 0);
            if (distance > 0)
                m.attenuation_distance = static_cast<float>(distance);
            else
                doc.warn("W0303", *e, "attenuationDistance", "is not positive; the volume does not absorb");
        }
    }
}

Material read_material(Document& doc, const Json& json, TextureReader& textures) {
    Material m;
    m.name = without_nul(raw_name(json));
    const Json* pbr = doc.object(json, "pbrMetallicRoughness");
    const Json* spec = doc.extension(json, "KHR_materials_pbrSpecularGlossiness");
    if (spec)
        read_specular_glossiness(doc, *spec, textures, m);
    else if (pbr)
        read_metallic_roughness(doc, *pbr, textures, m);

    m.normal_texture = textures.read(json, "normalTexture");
    if (const Json* info = doc.object(json, "normalTexture"))
        m.normal_scale = static_cast<float>(doc.number_or(*info, "scale", 1));
    m.occlusion_texture = textures.read(json, "occlusionTexture");
    if (const Json* info = doc.object(json, "occlusionTexture"))
        m.occlusion_strength = number_in(doc, *info, "strength", 1, 0, 1);
    m.emissive_texture = textures.read(json, "emissiveTexture");
    m.emissive = color3_in(doc, json, "emissiveFactor", {0, 0, 0});

    const std::string_view mode = doc.string_or(json, "alphaMode", "OPAQUE");
    if (mode == "MASK")
        m.alpha_mode = AlphaMode::mask;
    else if (mode == "BLEND")
        m.alpha_mode = AlphaMode::blend;
    else if (mode != "OPAQUE")
        doc.warn("W0303", json, "alphaMode", "is \"" + shortened(mode) + "\"; OPAQUE is used");
    m.alpha_cutoff = number_in(doc, json, "alphaCutoff", 0.5, 0, 1e30);
    m.double_sided = doc.bool_or(json, "doubleSided", false);
    read_extensions(doc, json, textures, m);
    return m;
}

} // namespace

MaterialSet read_materials(Document& doc, std::span<const std::uint8_t> used, std::span<const BufferView> views,
                           UriReader& uris, const LoadParams& params, const Control& control) {
    const std::span<const Json> list = doc.list_of_objects(doc.root(), "materials");
    TextureReader textures(doc, views, uris);
    MaterialSet set;
    set.material_of.assign(used.size(), 0);
    for (std::size_t i = 0; i < list.size(); ++i) {
        if (!used[i]) continue;
        set.material_of[i] = static_cast<std::uint32_t>(set.materials.size());
        set.materials.push_back(read_material(doc, list[i], textures));
    }
    if (used.back()) {
        set.material_of.back() = static_cast<std::uint32_t>(set.materials.size());
        set.materials.emplace_back();
    }
    set.images = textures.decode_images(params, control); // first: equal images are brought together
    set.textures = textures.take_textures();
    return set;
}

} // namespace porthole::gltf
