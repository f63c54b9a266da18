// PLY, ASCII and binary of both byte orders.
#pragma once

#include <filesystem>

#include "porthole/base/parallel.h"
#include "porthole/io/files.h"
#include "porthole/io/load.h"
#include "porthole/scene/scene.h"

namespace porthole {

/// Reads a PLY file: one part named after the file.
///
/// Vertex positions, normals, colours (taken as sRGB) and texture coordinates under their
/// usual names, of any type and in any order; faces as polygons, which are cut into triangles,
/// or as triangle strips; the picture of a "comment TextureFile NAME". Other elements and
/// properties are skipped.
///
/// @param path  names the file in messages; its folder holds the texture.
/// @return a scene without parts if the file has no faces.
/// @throws Error input E0501 header, E0502 data ends early or is no number, E0503 no x, y, z,
///         E0504 no face can be used; limit E0902, E0904; Cancelled.
/// Warnings: W0501 faces left out, W0502 bytes after the data, W0503 data not drawn, W0504
///         triangles left out, W0505 polygons cut roughly; W070x textures.
/// Cost: linear; binary about 0.1 s per million triangles.
[[nodiscard]] Scene read_ply(const FileBytes& file, const std::filesystem::path& path, const LoadParams& params,
                             const Control& control);

} // namespace porthole
