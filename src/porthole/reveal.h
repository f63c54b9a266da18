// The whole flow: model in, picture with a hole and its report out.
#pragma once

#include "porthole/params.h"
#include "porthole/report.h"

namespace porthole {

struct Revealed {
    ViewPlan plan;
    Frame frame;   ///< empty if nothing was revealed; its ids are all traced
    Mask inferred; ///< of the frame as it was drawn: 1 where ids were inferred; empty: nowhere
    Report report; ///< without version, command, model_path, load, write and total seconds
};

/// Who is seen and who may be cut when `params` are asked for.
[[nodiscard]] Subject make_subject(const MeshBvhs& meshes, const RevealParams& params, const Control& control = {});

/// How both pictures, with and without the hole, are drawn when `params` are asked for.
[[nodiscard]] RenderParams look_of(const RevealParams& params);

/// The plain picture, or the wireframe, that `params` ask for: no hole.
/// @param whole  every part. @throws Error as render() and render_wireframe().
/// @param refinement  if given, and if `params` ask for it: how it compares with every pixel traced. A
///                    wireframe compares with nothing.
[[nodiscard]] Frame render_plain(const MeshBvhs& meshes, const Bvh& whole, const View& view, const RevealParams& params,
                                 const Control& control = {}, std::optional<RefinementReport>* refinement = nullptr);

/// Opens a hole around the targets in whatever hides them and draws the picture.
///
/// @param meshes  from build_mesh_bvhs; the scene behind it must hold at least one part.
/// @return frame and report. `plan.nothing_revealed()`: all targets are absent or refused, and
///         there is no frame. `plan.nothing_to_cut()`: a plain picture.
/// @throws Error usage (camera, depth), limit; Cancelled.
/// The same bits for any number of threads. Safe to call concurrently on one scene.
///
///   const Scene scene = load_scene("engine.glb");
///   const MeshBvhs meshes = build_mesh_bvhs(scene);
///   const Revealed revealed = reveal(meshes, {.targets = select_parts(scene, {"rod*"})});
[[nodiscard]] Revealed reveal(const MeshBvhs& meshes, const RevealParams& params, const Control& control = {});

} // namespace porthole
