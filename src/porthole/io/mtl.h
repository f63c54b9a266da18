// Wavefront material libraries (.mtl).
#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "porthole/base/parallel.h"
#include "porthole/io/load.h"
#include "porthole/io/reader.h"
#include "porthole/scene/scene.h"

namespace porthole {

/// A texture statement: the file and the options that matter.
struct MtlMap {
    std::string file;
    std::string where;
    Vec2f offset{0, 0}, scale{1, 1};
    bool clamp = false;
};

/// One `newmtl` block, as written.
struct MtlMaterial {
    std::string name; ///< raw bytes, as usemtl refers to it
    std::string where;
    Vec3f diffuse{0.8f, 0.8f, 0.8f}; ///< Kd, sRGB
    std::optional<Vec3f> specular, emissive;
    std::optional<float> shininess, opacity, transparency, roughness, metallic, ior;
    std::optional<int> illumination;
    MtlMap map_diffuse, map_emissive, map_opacity, map_roughness, map_metallic, map_normal;
};

/// Reads the text of a library. Unknown and unreadable statements are skipped, with a warning.
[[nodiscard]] std::vector<MtlMaterial> parse_mtl(std::string_view text, const std::string& path, WarningLog& log);

/// Turns materials as written into the scene's, reading their textures.
///
/// Metallic = Pm or 0; roughness = Pr, else 1 - sqrt(Ns / 1000) as Blender writes it, else 1
/// (illum 0, 1) or 0.6; opacity = d, else 1 - Tr, below 1 blended. map_d and map_Kd become
/// one picture, as do map_Pr and map_Pm.
/// @param used  scene.materials will be these, in this order.
/// @throws Error limit E0902; Cancelled.
void add_materials(Scene& scene, const std::vector<const MtlMaterial*>& used, const std::filesystem::path& model,
                   const LoadParams& params, const Control& control, WarningLog& log);

} // namespace porthole
