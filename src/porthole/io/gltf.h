// glTF 2.0, as JSON (.gltf) and binary (.glb).
#pragma once

#include <filesystem>

#include "porthole/base/parallel.h"
#include "porthole/io/files.h"
#include "porthole/io/load.h"
#include "porthole/scene/scene.h"

namespace porthole {

/// Reads a glTF 2.0 file, JSON or GLB, told apart by its first bytes.
///
/// One Mesh per glTF mesh (one Submesh per primitive), one Part per node of the default scene
/// that has a mesh with at least one triangle, in depth-first order; EXT_mesh_gpu_instancing
/// gives one Part per instance. Skinned and morphed meshes are baked at rest pose, or at
/// `params.time` seconds into the first animation; a skinned Mesh is baked into world space
/// and its Part has the identity transform. The tree is walked with loops, so its depth is
/// bounded by memory only.
///
/// Geometry: every accessor type, sparse, interleaved, non-indexed, strips, fans,
/// KHR_mesh_quantization, KHR_draco_mesh_compression, EXT_/KHR_meshopt_compression.
/// Looks: metallic-roughness, KHR_materials_{pbrSpecularGlossiness, emissive_strength, unlit,
/// ior, transmission, volume}, KHR_texture_transform, EXT_texture_webp; other materials'
/// extensions are ignored. A texture that cannot be read is a warning and leaves an empty
/// image. Also cameras, KHR_lights_punctual and KHR_node_visibility.
///
/// Not applied here: LoadParams::up, metres_per_unit, recentre().
///
/// @param file   the bytes; must stay valid during the call only.
/// @param path   names the file in messages; its folder holds buffers and images. "-" is
///               standard input, from which no other file may be named.
/// @return a scene without parts if the file draws no triangle.
/// @throws Error input, `where` "<path>:<JSON pointer>" or "<path>:byte <n>":
///         E0301 data ends early, E0302 not JSON, E0303 property missing, of the wrong type or
///         out of range, E0304 version, E0305 unknown required extension, E0306 reference to
///         nothing, E0307 a buffer's bytes cannot be had, E0308 compressed data broken,
///         E0309 node tree is no tree, E0310 GLB malformed.
///         Error limit E0902 when the geometry would pass params.max_bytes; Cancelled.
/// Warnings: W0301 triangles dropped, W0302 points or lines left out, W0303 a property ignored,
///         W0304 texture unreadable, W0305 transform unusable, W0306 camera or light unusable,
///         W0307 vertex data repaired or ignored, W0308 extension not supported,
///         W0309 animation not applied, W0310 text repaired.
/// Cost: linear in the file; primitives and images are decoded on control.threads threads.
///
///   const Scene scene = read_gltf(FileBytes("engine.glb"), "engine.glb", {}, {});
[[nodiscard]] Scene read_gltf(const FileBytes& file, const std::filesystem::path& path, const LoadParams& params,
                              const Control& control);

} // namespace porthole
