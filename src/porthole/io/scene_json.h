// Scenes of primitives in JSON; docs/scene-format.md is the format.
#pragma once

#include <filesystem>
#include <string_view>

#include "porthole/base/parallel.h"
#include "porthole/io/files.h"
#include "porthole/io/load.h"
#include "porthole/scene/scene.h"

namespace porthole {

/// Whether the beginning of a JSON text names the mark that every scene file bears.
[[nodiscard]] bool has_scene_mark(std::string_view text);

/// Reads a scene file. Every part gets a mesh of primitives of its own.
///
/// @param path  names the file in messages.
/// @throws Error input, each naming the place as "file:/parts/2/sphere/radius": E1001 not JSON or
///         no scene of version 1; E1002 a key that is unknown, missing or of the wrong type, or a
///         material that is not there; E1003 a number out of its range, or a placement that
///         flattens what it places; E1004 nested too deep or too many primitives; E1005 operands
///         of which nothing is left. limit E0902. Cancelled.
/// Cost: linear in the file; each primitive is copied once for every operation above it.
[[nodiscard]] Scene read_scene_json(const FileBytes& file, const std::filesystem::path& path, const LoadParams& params,
                                    const Control& control);

} // namespace porthole
