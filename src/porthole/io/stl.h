// STL, binary and ASCII.
#pragma once

#include <filesystem>

#include "porthole/base/parallel.h"
#include "porthole/io/files.h"
#include "porthole/io/load.h"
#include "porthole/scene/scene.h"

namespace porthole {

/// Whether the bytes have the size that their triangle count asks for, as binary STL does
/// whatever its header says.
[[nodiscard]] bool is_exact_binary_stl(const FileBytes& file);

/// Reads an STL file; binary if its size says so, else ASCII if it begins with "solid".
///
/// Corners at exactly the same place share a vertex. Shaded flat: the normals in the file are
/// those of the facets, or nothing. Every `solid` of an ASCII file is a part of its name; a
/// binary file is one part named after the file.
///
/// @param path  names the file in messages.
/// @return a scene without parts if the file has no facets.
/// @throws Error input E0601 neither kind, E0602 data ends early, E0603 no facet can be used;
///         limit E0902, E0904 (more than 2^32 corners); Cancelled.
/// Warnings: W0601 facets left out, W0602 bytes after the last facet, W0603 text that is not
///         understood, W0604 triangles left out, W0605 keywords in capitals.
/// Cost: linear; binary about 0.15 s per million triangles.
[[nodiscard]] Scene read_stl(const FileBytes& file, const std::filesystem::path& path, const LoadParams& params,
                             const Control& control);

} // namespace porthole
