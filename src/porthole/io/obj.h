// Wavefront OBJ with its material libraries.
#pragma once

#include <filesystem>

#include "porthole/base/parallel.h"
#include "porthole/io/files.h"
#include "porthole/io/load.h"
#include "porthole/scene/scene.h"

namespace porthole {

/// Reads a Wavefront OBJ file.
///
/// Every `o` begins a part; within it (or in a file without `o`) every group name makes a part
/// of its own, path "object/group". A file with neither is one part named after the file.
/// Polygons are cut into triangles, materials become submeshes, corners with equal (v, vt, vn)
/// share a vertex. Parts without normals in the file are shaded flat. Vertex colours ("v x y z
/// r g b") and Kd, Ke are taken as sRGB. A line that cannot be read costs its vertex or face,
/// not the file; commands (`csh`, `call`) are never run.
///
/// @param file  the bytes; must stay valid during the call only.
/// @param path  names the file in messages; its folder holds material libraries and textures.
/// @return a scene without parts if the file has no faces.
/// @throws Error input E0401 not an OBJ file (no statement known), E0402 binary data or UTF-16,
///         E0403 nothing usable is left; limit E0902, E0904 (more than 2^32 corners); Cancelled.
/// Warnings: W0401 vertices, W0402 faces, W0403 references, W0404 triangles left out, W0405
///         points and curves, W0406 polygons, W0407 commands, W0408 unknown statements, W0410
///         material libraries, W0411 and W0412 materials; W070x textures.
/// Cost: linear, 0.2 to 0.3 s per million triangles; memory 80 to 110 bytes per triangle
/// besides the file.
[[nodiscard]] Scene read_obj(const FileBytes& file, const std::filesystem::path& path, const LoadParams& params,
                             const Control& control);

} // namespace porthole
