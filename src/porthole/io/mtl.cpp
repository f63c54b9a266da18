#include "porthole/io/mtl.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <set>
#include <tuple>

#include "porthole/io/files.h"
#include "porthole/io/text_cursor.h"

namespace porthole {
namespace {

// ---------------------------------------------------------------- reading the text

class MtlParser {
public:
    MtlParser(std::string_view text, const std::string& path, WarningLog& log)
        : cursor_(text.starts_with("\xEF\xBB\xBF") ? text.substr(3) : text, true), path_(path), log_(log) {}

    std::vector<MtlMaterial> parse();

private:
    void statement(std::string_view keyword, MtlMaterial& material);
    void read_color(std::string_view keyword, Vec3f& out);
    template <typename T> void read_value(std::string_view keyword, std::optional<T>& out);
    void read_map(MtlMap& out);
    void unreadable(std::string_view keyword);

    TextCursor cursor_;
    const std::string& path_;
    WarningLog& log_;
    std::set<std::string, std::less<>> ignored_; ///< statements already warned of
};

std::vector<MtlMaterial> MtlParser::parse() {
    std::vector<MtlMaterial> materials;
    for (; !cursor_.at_end(); cursor_.next_line()) {
        if (cursor_.at_line_end()) continue;
        const std::string_view keyword = cursor_.word();
        if (keyword == "newmtl") {
            materials.emplace_back();
            materials.back().name = std::string(cursor_.rest_of_line());
            materials.back().where = at_line(path_, cursor_.line());
        } else if (!materials.empty()) {
            statement(keyword, materials.back());
        }
    }
    return materials;
}

void MtlParser::unreadable(std::string_view keyword) {
    log_.add("W0411", at_line(path_, cursor_.line()), "'" + escaped(keyword, 40) + "' without usable numbers; ignored");
}

void MtlParser::read_color(std::string_view keyword, Vec3f& out) {
    Vec3f color;
    if (!cursor_.number(color.x)) return unreadable(keyword); // "spectral", "xyz": no one writes them
    color.y = color.z = color.x;
    if (!cursor_.at_line_end() && (!cursor_.number(color.y) || !cursor_.number(color.z))) return unreadable(keyword);
    if (!is_finite(color)) return unreadable(keyword);
    out = max(color, Vec3f{});
}

template <typename T> void MtlParser::read_value(std::string_view keyword, std::optional<T>& out) {
    if (keyword == "d") {
        cursor_.skip_blanks();
        TextCursor ahead = cursor_;
        if (ahead.word() == "-halo") cursor_ = ahead;
    }
    float value = 0;
    if (!cursor_.number(value) || !std::isfinite(value)) return unreadable(keyword);
    out = static_cast<T>(std::clamp(value, -1e6f, 1e6f));
}

void MtlParser::read_map(MtlMap& out) {
    MtlMap map;
    map.where = at_line(path_, cursor_.line());
    const auto vector = [&](Vec2f& v, bool fill) {
        // One to three numbers; the third is for volumes.
        float value = 0;
        float* const slots[] = {&v.x, &v.y, nullptr};
        for (int i = 0; i < 3 && !cursor_.at_line_end() && cursor_.number(value); ++i) {
            if (!std::isfinite(value)) value = fill ? 1.0f : 0.0f;
            if (slots[i]) *slots[i] = value;
        }
    };
    while (!cursor_.at_line_end()) {
        TextCursor ahead = cursor_;
        const std::string_view option = ahead.word();
        if (option.size() < 2 || option[0] != '-') break;
        if (option == "-o" || option == "-s" || option == "-t") {
            cursor_ = ahead;
            Vec2f unused;
            vector(option == "-o" ? map.offset : option == "-s" ? map.scale : unused, option == "-s");
        } else if (option == "-mm") {
            cursor_ = ahead;
            (void)cursor_.word();
            (void)cursor_.word();
        } else if (option == "-clamp") {
            cursor_ = ahead;
            map.clamp = cursor_.word() == "on";
        } else if (option == "-bm" || option == "-boost" || option == "-texres" || option == "-type" ||
                   option == "-imfchan" || option == "-blendu" || option == "-blendv" || option == "-cc" ||
                   option == "-colorspace") {
            cursor_ = ahead;
            (void)cursor_.word();
        } else {
            break; // a file name that begins with a hyphen
        }
    }
    map.file = std::string(cursor_.rest_of_line());
    if (!map.file.empty()) out = std::move(map);
}

void MtlParser::statement(std::string_view keyword, MtlMaterial& m) {
    if (keyword == "Kd") return read_color(keyword, m.diffuse);
    if (keyword == "Ks") return read_color(keyword, m.specular.emplace());
    if (keyword == "Ke") return read_color(keyword, m.emissive.emplace());
    if (keyword == "Ns") return read_value(keyword, m.shininess);
    if (keyword == "Ni") return read_value(keyword, m.ior);
    if (keyword == "d") return read_value(keyword, m.opacity);
    if (keyword == "Tr") return read_value(keyword, m.transparency);
    if (keyword == "Pr") return read_value(keyword, m.roughness);
    if (keyword == "Pm") return read_value(keyword, m.metallic);
    if (keyword == "illum") return read_value(keyword, m.illumination);
    if (keyword == "map_Kd") return read_map(m.map_diffuse);
    if (keyword == "map_Ke") return read_map(m.map_emissive);
    if (keyword == "map_d" || keyword == "map_opacity") return read_map(m.map_opacity);
    if (keyword == "map_Pr") return read_map(m.map_roughness);
    if (keyword == "map_Pm") return read_map(m.map_metallic);
    if (keyword == "norm" || keyword == "map_Kn") return read_map(m.map_normal);
    // What changes nothing here, or is written by rote: ambient light, sharpness, sheen ...
    static constexpr std::string_view harmless[] = {"Ka",  "Tf",    "Km",     "Ps",       "Pc",
                                                    "Pcr", "aniso", "anisor", "sharpness"};
    if (std::find(std::begin(harmless), std::end(harmless), keyword) != std::end(harmless)) return;
    if (ignored_.size() < 64 && ignored_.emplace(keyword).second)
        log_.add("W0412", at_line(path_, cursor_.line()), "'" + escaped(keyword, 40) + "' is not supported; ignored");
}

// ---------------------------------------------------------------- the scene's materials

const Rgba8& sampled(const Image<Rgba8>& image, std::int32_t x, std::int32_t y, const Image<Rgba8>& like) {
    return image(std::int32_t(std::int64_t(x) * image.width() / like.width()),
                 std::int32_t(std::int64_t(y) * image.height() / like.height()));
}

std::uint8_t luminance(Rgba8 p) { return std::uint8_t((54u * p.r + 183u * p.g + 19u * p.b + 128u) >> 8); }

bool has_alpha(const Image<Rgba8>& image) {
    return std::any_of(image.pixels().begin(), image.pixels().end(), [](Rgba8 p) { return p.a != 255; });
}

/// Combines two pictures texel by texel, at the size of the larger.
template <typename F> Image<Rgba8> combined(const Image<Rgba8>& a, const Image<Rgba8>& b, F&& texel) {
    const Image<Rgba8>& like = a.pixels().size() >= b.pixels().size() ? a : b;
    Image<Rgba8> out(like.width(), like.height());
    for (std::int32_t y = 0; y < out.height(); ++y)
        for (std::int32_t x = 0; x < out.width(); ++x)
            out(x, y) = texel(a.empty() ? Rgba8{255, 255, 255, 255} : sampled(a, x, y, like),
                              b.empty() ? Rgba8{255, 255, 255, 255} : sampled(b, x, y, like));
    return out;
}

/// The pictures that one material's maps name, kNone where there is none.
struct MapPictures {
    std::int32_t diffuse = kNone, emissive = kNone, opacity = kNone, roughness = kNone, metallic = kNone,
                 normal = kNone;

    [[nodiscard]] std::array<std::int32_t, 6> all() const {
        return {diffuse, emissive, opacity, roughness, metallic, normal};
    }
};

/// How a texture is made of one picture or two.
enum class Recipe : std::uint8_t { plain, opaque, with_opacity, rough_and_metal };

/// Makes the scene's images and textures; materials share those that are made alike.
class TextureMaker {
public:
    TextureMaker(Scene& scene, std::vector<Image<Rgba8>> pictures, const std::vector<MapPictures>& wanted,
                 const LoadParams& params, std::string path)
        : scene_(scene), pictures_(std::move(pictures)), uses_(pictures_.size(), 0), params_(params),
          path_(std::move(path)) {
        for (const Image<Rgba8>& image : pictures_) readable_.push_back(!image.empty());
        for (const MapPictures& maps : wanted)
            for (const std::int32_t i : maps.all())
                if (i != kNone) ++uses_[std::size_t(i)];
    }

    /// Whether there is such a picture and it could be read.
    [[nodiscard]] bool has(std::int32_t i) const { return i != kNone && readable_[std::size_t(i)]; }
    /// Index of the texture made of pictures a and b, at least one of which can be read.
    std::int32_t texture(Recipe recipe, const MtlMap& map, std::int32_t a, std::int32_t b = kNone);

private:
    [[nodiscard]] const Image<Rgba8>& picture(std::int32_t i) const {
        return i == kNone ? none_ : pictures_[std::size_t(i)];
    }
    /// A picture that one map alone uses moves into the scene instead of being copied.
    Image<Rgba8> take(std::int32_t i) {
        Image<Rgba8>& image = pictures_[std::size_t(i)];
        return uses_[std::size_t(i)] == 1 ? std::move(image) : image;
    }
    Image<Rgba8> make(Recipe recipe, std::int32_t a, std::int32_t b);

    Scene& scene_;
    std::vector<Image<Rgba8>> pictures_;
    std::vector<int> uses_;
    std::vector<bool> readable_;
    const LoadParams& params_;
    std::string path_;
    Image<Rgba8> none_;
    std::uint64_t bytes_ = 0; ///< of the images made so far
    std::map<std::tuple<Recipe, std::int32_t, std::int32_t, bool>, std::int32_t> made_;
};

Image<Rgba8> TextureMaker::make(Recipe recipe, std::int32_t a, std::int32_t b) {
    if (recipe == Recipe::plain) return take(a);
    if (recipe == Recipe::opaque) {
        Image<Rgba8> image = take(a);
        for (Rgba8& p : image.pixels()) p.a = 255;
        return image;
    }
    const Image<Rgba8>& first = picture(a);
    const Image<Rgba8>& second = picture(b);
    if (recipe == Recipe::with_opacity) {
        const bool from_alpha = has_alpha(second);
        return combined(first, second, [&](Rgba8 p, Rgba8 o) {
            return Rgba8{p.r, p.g, p.b, from_alpha ? o.a : luminance(o)};
        });
    }
    return combined(first, second, [](Rgba8 rough, Rgba8 metal) {
        return Rgba8{255, luminance(rough), luminance(metal), 255};
    });
}

std::int32_t TextureMaker::texture(Recipe recipe, const MtlMap& map, std::int32_t a, std::int32_t b) {
    const auto [entry, is_new] = made_.try_emplace({recipe, a, b, map.clamp}, std::int32_t(scene_.textures.size()));
    if (!is_new) return entry->second;
    scene_.images.push_back(make(recipe, a, b));
    bytes_ += scene_.images.back().pixels().size() * sizeof(Rgba8);
    check_memory(bytes_, params_, path_);
    Texture texture;
    texture.image = std::int32_t(scene_.images.size()) - 1;
    texture.wrap_u = texture.wrap_v = map.clamp ? Wrap::clamp : Wrap::repeat;
    scene_.textures.push_back(texture);
    return entry->second;
}

/// In the file v runs up, uv' = scale uv + offset; here v runs down.
TextureRef reference(std::int32_t texture, const MtlMap& map) {
    TextureRef ref;
    ref.texture = texture;
    ref.scale = map.scale;
    ref.offset = {map.offset.x, 1.0f - map.scale.y - map.offset.y};
    return ref;
}

Material factors_of(const MtlMaterial& m, const std::string& where, WarningLog& log) {
    Material material;
    material.name = valid_utf8(m.name);
    const Vec3f diffuse = min(linear_color(m.diffuse), Vec3f{1, 1, 1});
    float opacity = 1;
    if (m.opacity) {
        opacity = clamp01(*m.opacity);
    } else if (m.transparency) {
        opacity = 1.0f - clamp01(*m.transparency);
        if (opacity == 0) {
            // Some programs write Tr the other way round; a part that nobody can see helps no one.
            log.add("W0411", where, "Tr 1 would make material '" + escaped(m.name, 80) + "' invisible; drawn opaque");
            opacity = 1;
        }
    }
    material.base_color = {diffuse.x, diffuse.y, diffuse.z, opacity};
    if (opacity < 1) material.alpha_mode = AlphaMode::blend;
    material.metallic = m.metallic ? clamp01(*m.metallic) : 0.0f;
    const bool matt = m.illumination && *m.illumination < 2;
    if (m.roughness)
        material.roughness = clamp01(*m.roughness);
    else if (matt || (m.specular && *m.specular == Vec3f{}))
        material.roughness = 1;
    else if (m.shininess)
        material.roughness = 1.0f - std::sqrt(clamp01(*m.shininess / 1000.0f));
    else
        material.roughness = 0.6f;
    if (m.emissive) material.emissive = linear_color(*m.emissive);
    if (m.ior && *m.ior >= 1 && *m.ior <= 4) material.ior = *m.ior;
    return material;
}

/// Nearly only 0 and 1 is a cut-out (leaves, grids), anything else glass or smoke.
bool is_cut_out(const Image<Rgba8>& image) {
    const auto between =
        std::count_if(image.pixels().begin(), image.pixels().end(), [](Rgba8 p) { return p.a > 16 && p.a < 239; });
    return std::size_t(between) * 20 < image.pixels().size();
}

/// Gives `material` the textures of `m`, as far as their pictures could be read.
void add_maps(Material& material, const MtlMaterial& m, const MapPictures& maps, TextureMaker& maker,
              const Scene& scene) {
    const bool colored = maker.has(maps.diffuse);
    if (maker.has(maps.opacity)) {
        const MtlMap& map = colored ? m.map_diffuse : m.map_opacity;
        const std::int32_t diffuse = colored ? maps.diffuse : kNone;
        const std::int32_t texture = maker.texture(Recipe::with_opacity, map, diffuse, maps.opacity);
        material.base_color_texture = reference(texture, map);
        const auto image = std::size_t(scene.textures[std::size_t(texture)].image);
        if (material.alpha_mode == AlphaMode::opaque)
            material.alpha_mode = is_cut_out(scene.images[image]) ? AlphaMode::mask : AlphaMode::blend;
    } else if (colored) {
        material.base_color_texture =
            reference(maker.texture(Recipe::opaque, m.map_diffuse, maps.diffuse), m.map_diffuse);
    }
    // Programs disagree on whether Kd multiplies the texture; black or absent, it cannot.
    if (colored && (m.diffuse == Vec3f{} || m.diffuse == MtlMaterial{}.diffuse))
        material.base_color = {1, 1, 1, material.base_color.w};
    if (maker.has(maps.emissive)) {
        material.emissive_texture =
            reference(maker.texture(Recipe::plain, m.map_emissive, maps.emissive), m.map_emissive);
        if (material.emissive == Vec3f{}) material.emissive = {1, 1, 1};
    }
    const bool rough = maker.has(maps.roughness), metal = maker.has(maps.metallic);
    if (rough || metal) {
        const MtlMap& map = rough ? m.map_roughness : m.map_metallic;
        material.metallic_roughness_texture = reference(
            maker.texture(Recipe::rough_and_metal, map, rough ? maps.roughness : kNone, metal ? maps.metallic : kNone),
            map);
        if (rough && !m.roughness) material.roughness = 1;
        if (metal && !m.metallic) material.metallic = 1;
    }
    if (maker.has(maps.normal))
        material.normal_texture = reference(maker.texture(Recipe::plain, m.map_normal, maps.normal), m.map_normal);
}

} // namespace

std::vector<MtlMaterial> parse_mtl(std::string_view text, const std::string& path, WarningLog& log) {
    return MtlParser(text, path, log).parse();
}

void add_materials(Scene& scene, const std::vector<const MtlMaterial*>& used, const std::filesystem::path& model,
                   const LoadParams& params, const Control& control, WarningLog& log) {
    TextureFiles files(model, params);
    const auto find = [&](const MtlMap& map) {
        return map.file.empty() ? kNone : files.find(map.file, map.where, log);
    };
    std::vector<MapPictures> maps;
    maps.reserve(used.size());
    for (const MtlMaterial* m : used)
        maps.push_back({find(m->map_diffuse), find(m->map_emissive), find(m->map_opacity), find(m->map_roughness),
                        find(m->map_metallic), find(m->map_normal)});
    TextureMaker maker(scene, files.decode(control, log), maps, params, model.string());
    for (std::size_t i = 0; i < used.size(); ++i) {
        const MtlMaterial& m = *used[i];
        Material material = factors_of(m, m.where.empty() ? model.string() : m.where, log);
        add_maps(material, m, maps[i], maker, scene);
        scene.materials.push_back(std::move(material));
    }
}

} // namespace porthole
