// Materials, textures and their images.
#pragma once

#include <cstdint>
#include <map>
#include <span>
#include <vector>

#include "porthole/base/parallel.h"
#include "porthole/io/gltf_accessor.h"
#include "porthole/io/gltf_json.h"
#include "porthole/io/load.h"
#include "porthole/scene/scene.h"

namespace porthole::gltf {

struct MaterialSet {
    std::vector<Material> materials; ///< the used ones in the file's order, then the default one if used
    std::vector<Texture> textures;   ///< the used ones
    std::vector<Image<Rgba8>> images;
    std::vector<std::uint32_t> material_of; ///< index into `materials` by glTF material; last: of none
};

/// The materials marked in `used` (by glTF index; the last element stands for "none given")
/// and what they need. Images are decoded in parallel, equal ones once; one that cannot be
/// read is a warning and an empty image.
/// @throws Error E0303; limit E0902 when the images pass params.max_bytes; Cancelled.
[[nodiscard]] MaterialSet read_materials(Document& doc, std::span<const std::uint8_t> used,
                                         std::span<const BufferView> views, UriReader& uris, const LoadParams& params,
                                         const Control& control);

/// Collects the textures that materials use, then decodes their images.
class TextureReader {
public:
    TextureReader(Document& doc, std::span<const BufferView> views, UriReader& uris);

    /// The textureInfo `key` of `object`, KHR_texture_transform included; none if it is
    /// absent, refers to nothing or has no image of a kind that we read (a warning then).
    [[nodiscard]] TextureRef read(const Json& object, std::string_view key);
    [[nodiscard]] std::vector<Texture> take_textures() { return std::move(textures_); }
    [[nodiscard]] std::vector<Image<Rgba8>> decode_images(const LoadParams& params, const Control& control);

private:
    std::int32_t texture_of(const Json& info);
    std::int32_t image_of(const Json& texture);
    [[nodiscard]] Bytes bytes_of(const Json& image);
    [[nodiscard]] static std::vector<std::size_t> first_of_equals(std::span<const Bytes> bytes);

    Document& doc_;
    std::span<const BufferView> views_;
    UriReader& uris_;
    std::span<const Json> texture_list_, image_list_, sampler_list_;
    std::vector<Texture> textures_;
    std::vector<const Json*> images_;
    std::map<std::uint64_t, std::int32_t> texture_by_index_, image_by_index_;
};

} // namespace porthole::gltf
