// Textures, samplers and images.
#include <cmath>
#include <optional>
#include <unordered_map>

#include "porthole/io/gltf_material.h"
#include "porthole/io/gltf_mesh.h"
#include "porthole/io/image_file.h"

namespace porthole::gltf {
namespace {

Wrap wrap_of(Document& doc, const Json& sampler, std::string_view key) {
    switch (const std::uint64_t code = doc.uint_or(sampler, key, 10497)) {
    case 10497: return Wrap::repeat;
    case 33071: return Wrap::clamp;
    case 33648: return Wrap::mirror;
    default:
        doc.warn("W0303", sampler, key,
                 "is " + std::to_string(code) + ", expected 10497, 33071 or 33648; 10497 (repeat) is used");
        return Wrap::repeat;
    }
}

void read_transform(Document& doc, const Json& info, std::uint64_t& uv_set, TextureRef& ref) {
    const Json* transform = doc.extension(info, "KHR_texture_transform");
    if (!transform) return;
    double v[2];
    if (doc.numbers(*transform, "offset", v)) ref.offset = {float(v[0]), float(v[1])};
    if (doc.numbers(*transform, "scale", v)) ref.scale = {float(v[0]), float(v[1])};
    ref.rotation = static_cast<float>(doc.number_or(*transform, "rotation", 0));
    uv_set = doc.uint_or(*transform, "texCoord", uv_set);
    const bool finite = std::isfinite(ref.offset.x) && std::isfinite(ref.offset.y) && std::isfinite(ref.scale.x) &&
                        std::isfinite(ref.scale.y) && std::isfinite(ref.rotation);
    if (finite) return;
    doc.warn("W0303", *transform, {}, "is too large for single precision; ignored");
    ref.offset = {0, 0};
    ref.scale = {1, 1};
    ref.rotation = 0;
}

} // namespace

TextureReader::TextureReader(Document& doc, std::span<const BufferView> views, UriReader& uris)
    : doc_(doc), views_(views), uris_(uris), texture_list_(doc.list_of_objects(doc.root(), "textures")),
      image_list_(doc.list_of_objects(doc.root(), "images")),
      sampler_list_(doc.list_of_objects(doc.root(), "samplers")) {}

TextureRef TextureReader::read(const Json& object, std::string_view key) {
    TextureRef ref;
    const Json* info = doc_.object(object, key);
    if (!info) return ref;
    std::uint64_t uv_set = doc_.uint_or(*info, "texCoord", 0);
    read_transform(doc_, *info, uv_set, ref);
    if (uv_set > 1) {
        doc_.warn("W0303", *info, "texCoord",
                  "is " + std::to_string(uv_set) + ", only 0 and 1 are read; the texture is ignored");
        return {};
    }
    ref.uv_set = static_cast<std::uint8_t>(uv_set);
    ref.texture = texture_of(*info);
    return ref;
}

std::int32_t TextureReader::texture_of(const Json& info) {
    const std::span<const Json> list = texture_list_;
    const std::uint64_t index = doc_.need_uint(info, "index");
    if (index >= list.size()) {
        doc_.warn("W0303", info, "index",
                  "refers to texture " + std::to_string(index) + " of " + std::to_string(list.size()) + "; ignored");
        return kNone;
    }
    if (const auto known = texture_by_index_.find(index); known != texture_by_index_.end()) return known->second;

    const Json& json = list[index];
    Texture texture;
    texture.image = image_of(json);
    std::int32_t& result = texture_by_index_[index];
    if (texture.image == kNone) return result = kNone;
    const std::span<const Json> samplers = sampler_list_;
    if (const auto sampler = doc_.uint(json, "sampler")) {
        if (*sampler < samplers.size()) {
            const Json& s = samplers[*sampler];
            texture.wrap_u = wrap_of(doc_, s, "wrapS");
            texture.wrap_v = wrap_of(doc_, s, "wrapT");
            texture.nearest = doc_.uint_or(s, "magFilter", 9729) == 9728;
        } else {
            doc_.warn("W0303", json, "sampler",
                      "refers to sampler " + std::to_string(*sampler) + " of " + std::to_string(samplers.size()) +
                          "; ignored");
        }
    }
    textures_.push_back(texture);
    return result = static_cast<std::int32_t>(textures_.size() - 1);
}

std::int32_t TextureReader::image_of(const Json& texture) {
    const std::span<const Json> list = image_list_;
    std::optional<std::uint64_t> source;
    if (const Json* webp = doc_.extension(texture, "EXT_texture_webp")) source = doc_.uint(*webp, "source");
    if (!source) source = doc_.uint(texture, "source");
    if (!source) {
        const Json* extensions = doc_.object(texture, "extensions");
        if (extensions && !extensions->empty())
            doc_.warn("W0304", texture, {},
                      "has only an image of a kind that is not read (" + shortened(extensions->begin().key()) +
                          "); the material's plain colour is used");
        return kNone; // else glTF leaves the image open
    }
    if (*source >= list.size()) {
        doc_.warn("W0304", texture, {},
                  "refers to image " + std::to_string(*source) + " of " + std::to_string(list.size()) + "; ignored");
        return kNone;
    }
    const auto [known, fresh] = image_by_index_.try_emplace(*source, static_cast<std::int32_t>(images_.size()));
    if (fresh) images_.push_back(&list[*source]);
    return known->second;
}

Bytes TextureReader::bytes_of(const Json& image) {
    if (const Json* uri = Document::find(image, "uri"))
        return uris_.read(doc_.string_or(image, "uri"), doc_.where(*uri));
    const BufferView& view = views_[doc_.need_index(image, "bufferView", views_.size(), "buffer view")];
    return view.bytes;
}

// For every image the first one with the same bytes, itself if there is none: exporters like
// to write an image once per material.
std::vector<std::size_t> TextureReader::first_of_equals(std::span<const Bytes> bytes) {
    const auto text = [&](std::size_t i) {
        return std::string_view(reinterpret_cast<const char*>(bytes[i].data.data()), bytes[i].data.size());
    };
    std::vector<std::size_t> first(bytes.size());
    std::unordered_map<std::string_view, std::size_t> seen;
    for (std::size_t i = 0; i < bytes.size(); ++i)
        first[i] = bytes[i].data.empty() ? i : seen.try_emplace(text(i), i).first->second;
    return first;
}

std::vector<Image<Rgba8>> TextureReader::decode_images(const LoadParams& params, const Control& control) {
    const std::size_t n = images_.size();
    std::vector<Bytes> bytes(n);
    std::vector<std::string> problem(n), where(n);
    std::uint64_t total = 0;
    for (std::size_t i = 0; i < n; ++i) {
        where[i] = doc_.where(*images_[i]);
        try {
            bytes[i] = bytes_of(*images_[i]);
        } catch (const Error& e) {
            problem[i] = e.what();
        }
    }
    const std::vector<std::size_t> first = first_of_equals(bytes);
    std::vector<std::int32_t> slot(n);
    std::vector<std::size_t> kept;
    for (std::size_t i = 0; i < n; ++i) {
        slot[i] = first[i] == i ? static_cast<std::int32_t>(kept.size()) : slot[first[i]];
        if (first[i] != i) continue;
        kept.push_back(i);
        if (!problem[i].empty()) continue;
        try {
            const ImageInfo info = image_info(bytes[i].data, where[i]);
            total += std::uint64_t(info.width) * std::uint64_t(info.height) * sizeof(Rgba8);
        } catch (const Error& e) {
            problem[i] = e.what();
        }
        if (total > params.max_bytes)
            doc_.fail_limit(*images_[i], {},
                            "the decoded images take more than the allowed " + std::to_string(params.max_bytes) +
                                " bytes; raise the memory limit");
    }
    for (Texture& texture : textures_) texture.image = slot[std::size_t(texture.image)];

    std::vector<Image<Rgba8>> images(kept.size());
    std::vector<Warnings> warnings(kept.size());
    parallel_in_order(kept.size(), control, [&](std::size_t k) {
        const std::size_t i = kept[k];
        if (!problem[i].empty()) return;
        try {
            images[k] = decode_image(bytes[i].data, where[i], &warnings[k]);
        } catch (const Error& e) {
            problem[i] = e.what();
        }
    });
    for (std::size_t k = 0; k < kept.size(); ++k) {
        const std::size_t i = kept[k];
        for (const Warning& w : warnings[k]) doc_.warn(w.code.c_str(), *images_[i], {}, w.reason);
        if (!problem[i].empty())
            doc_.warn("W0304", *images_[i], {}, problem[i] + "; the material's plain colour is used");
    }
    return images;
}

} // namespace porthole::gltf
