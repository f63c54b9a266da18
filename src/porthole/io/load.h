// Reading a model file, whatever it is called: the content decides.
#pragma once

#include <filesystem>
#include <span>
#include <string>

#include "porthole/base/parallel.h"
#include "porthole/scene/scene.h"

namespace porthole {

struct LoadParams {
    std::string format;         ///< "glb", "gltf", "obj", "ply", "scene", "stl"; empty: told from content and name
    double time = -1;           ///< seconds into the first animation; negative: rest pose
    char up = 'y';              ///< axis of the file that points up, 'y' or 'z' (z-up is rotated to y)
    double metres_per_unit = 1; ///< length of the file's unit
    std::uint64_t max_bytes = std::uint64_t(16) << 30; ///< most memory a file may make the reader allocate
};

/// Reads the model at `path` ("-" reads standard input, which then needs `format`).
///
/// No file makes this crash, hang or read outside the model's folder: every count and offset
/// is checked against the bytes at hand before anything is allocated. Files named inside the
/// model (buffers, textures, material libraries) are read only from the model's own folder or
/// below it, symbolic links resolved. What is left out or repaired is listed in
/// Scene::warnings.
///
/// A file whose name promises another format than its content has is read as what it is, with
/// warning W0201. Parts of which no triangle is usable are left out, unless all are such.
///
/// @throws Error input (E02xx..E07xx, E10xx) with file and position, E0204 naming what the file is
///         instead of a model that is read; usage E0120..E0122 for params out of range; limit
///         (E09xx) when params.max_bytes would be passed; Cancelled.
/// Cost: linear in the file; decoding and textures run on control.threads threads.
[[nodiscard]] Scene load_scene(const std::string& path, const LoadParams& params = {}, const Control& control = {});

} // namespace porthole
