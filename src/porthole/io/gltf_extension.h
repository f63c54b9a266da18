// What is checked of the file as a whole: its version, the extensions it needs, names.
#pragma once

#include "porthole/io/gltf_json.h"

namespace porthole::gltf {

/// @throws Error E0304 unless asset.version is 2.x and asset.minVersion at most 2.0.
void check_asset(const Document& doc);

/// Warns about names that are no text.
void check_names(Document& doc);

/// Refuses required extensions that we do not know, and warns about those that we know of but
/// do not draw when the file needs them, or when they stand for geometry.
/// @throws Error E0305.
void check_extensions(Document& doc);

} // namespace porthole::gltf
