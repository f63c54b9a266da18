#include "porthole/io/gltf_extension.h"

#include <algorithm>
#include <array>
#include <charconv>

namespace porthole::gltf {
namespace {

enum class Support {
    full,    // read
    partial, // does not change where triangles are: a file that requires it is drawn without it
    geometry // would add or change geometry that is not read
};

struct Known {
    std::string_view name;
    Support support;
};

constexpr std::array kKnown = {
    Known{"KHR_draco_mesh_compression", Support::full},
    Known{"EXT_meshopt_compression", Support::full},
    Known{"KHR_meshopt_compression", Support::full},
    Known{"KHR_mesh_quantization", Support::full},
    Known{"EXT_mesh_gpu_instancing", Support::full},
    Known{"KHR_lights_punctual", Support::full},
    Known{"KHR_node_visibility", Support::full},
    Known{"KHR_texture_transform", Support::full},
    Known{"EXT_texture_webp", Support::full},
    Known{"KHR_materials_pbrSpecularGlossiness", Support::full},
    Known{"KHR_materials_emissive_strength", Support::full},
    Known{"KHR_materials_unlit", Support::full},
    Known{"KHR_materials_ior", Support::full},
    Known{"KHR_materials_transmission", Support::full},
    Known{"KHR_materials_volume", Support::full},
    Known{"KHR_texture_basisu", Support::full}, // textures that need it warn one by one
    Known{"EXT_texture_avif", Support::full},
    Known{"MSFT_texture_dds", Support::full},
    Known{"KHR_xmp", Support::full}, // metadata
    Known{"KHR_xmp_json_ld", Support::full},
    Known{"KHR_materials_anisotropy", Support::partial},
    Known{"KHR_materials_clearcoat", Support::partial},
    Known{"KHR_materials_diffuse_transmission", Support::partial},
    Known{"KHR_materials_dispersion", Support::partial},
    Known{"KHR_materials_iridescence", Support::partial},
    Known{"KHR_materials_sheen", Support::partial},
    Known{"KHR_materials_specular", Support::partial},
    Known{"KHR_materials_variants", Support::partial},
    Known{"KHR_animation_pointer", Support::partial},
    Known{"EXT_lights_image_based", Support::partial},
    Known{"KHR_gaussian_splatting", Support::geometry},
    Known{"KHR_implicit_shapes", Support::geometry},
};

const Known* find_known(std::string_view name) {
    const auto known = std::find_if(kKnown.begin(), kKnown.end(), [&](const Known& k) { return k.name == name; });
    return known == kKnown.end() ? nullptr : &*known;
}

struct Version {
    unsigned major = 0, minor = 0;
    friend bool operator<=(Version a, Version b) { return a.major != b.major ? a.major < b.major : a.minor <= b.minor; }
};

Version need_version(const Document& doc, const Json& asset, std::string_view key) {
    const std::string_view text = doc.string_or(asset, key);
    Version v;
    const auto [dot, error] = std::from_chars(text.data(), text.data() + text.size(), v.major);
    const bool has_minor = error == std::errc{} && dot != text.data() + text.size() && *dot == '.';
    if (!has_minor || std::from_chars(dot + 1, text.data() + text.size(), v.minor).ec != std::errc{})
        doc.fail("E0304", asset, key, "is \"" + shortened(text) + "\", expected a version as \"2.0\"");
    return v;
}

} // namespace

void check_asset(const Document& doc) {
    const Json* asset = doc.object(doc.root(), "asset");
    if (!asset || !Document::find(*asset, "version"))
        doc.fail("E0304", asset ? *asset : doc.root(), {}, "has no asset version; this is no glTF 2.0 file");
    const Version version = need_version(doc, *asset, "version");
    if (version.major != 2)
        doc.fail("E0304", *asset, "version",
                 "is " + std::to_string(version.major) + "." + std::to_string(version.minor) +
                     ", expected 2.0; convert the file to glTF 2.0");
    if (!Document::find(*asset, "minVersion")) return;
    const Version least = need_version(doc, *asset, "minVersion");
    // A later minor version is read as far as it is known, if the file itself is consistent.
    if (!(least <= version) || least.major != 2)
        doc.fail("E0304", *asset, "minVersion",
                 "asks for version " + std::to_string(least.major) + "." + std::to_string(least.minor) +
                     " of a file of version " + std::to_string(version.major) + "." + std::to_string(version.minor));
}

void check_names(Document& doc) {
    for (const auto& [key, list] : doc.root().get_ref<const Json::object_t&>()) {
        if (!list.is_array()) continue;
        for (const Json& element : list) {
            const Json* name = element.is_object() ? Document::find(element, "name") : nullptr;
            if (name && !name->is_string()) doc.warn("W0303", *name, {}, "is a name that is no text; ignored");
        }
    }
}

void check_extensions(Document& doc) {
    const auto text_of = [&](const Json& value) -> std::string_view {
        if (!value.is_string()) doc.fail("E0303", value, {}, "is no extension name");
        return value.get_ref<const std::string&>();
    };
    for (const Json& value : doc.list(doc.root(), "extensionsRequired")) {
        const std::string_view name = text_of(value);
        const Known* known = find_known(name);
        if (!known || known->support == Support::geometry)
            doc.fail("E0305", value, {},
                     "the file requires the extension \"" + shortened(name) +
                         "\", which porthole does not read; export it without");
        if (known->support == Support::partial)
            doc.warn("W0308", value, {},
                     "the extension \"" + std::string(name) + "\" is not supported; the model is drawn without it");
    }
    for (const Json& value : doc.list(doc.root(), "extensionsUsed")) {
        const Known* known = find_known(text_of(value));
        if (known && known->support == Support::geometry)
            doc.warn("W0308", value, {}, "the geometry of \"" + std::string(known->name) + "\" is not read");
    }
}

} // namespace porthole::gltf
