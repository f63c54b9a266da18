// Which parts hold a point, and which kind of cap the parts of a cut may get.
#pragma once

#include <span>
#include <vector>

#include "porthole/base/cut.h"
#include "porthole/base/view.h"
#include "porthole/scene/solid.h"
#include "porthole/trace/bvh.h"

namespace porthole {

/// Whether each point lies in the material of `part`: by majority, rays from it in several
/// seeded directions leave the part more often than they enter it. A point within float rounding
/// of the surface may come out on either side.
/// @param solids  by mesh, from find_solids; a part without material holds nothing.
/// @param points  world coordinates.
/// @return 1 where a point lies inside, in the order of `points`.
/// Cost: one ray a point outside and five a point inside; points outside the part's box cost none.
[[nodiscard]] std::vector<std::uint8_t> lies_inside(const MeshBvhs& meshes, std::span<const MeshSolid> solids,
                                                    PartId part, std::span<const Vec3f> points);

/// Which of `parts` hold a target in their material, as skin holds a heart: those must be
/// shells, for a solid cannot contain another part.
///
/// Looks at points spread evenly over each target's surface. A part holds a target when at
/// least two of its points (or the only one) lie in the part's material, and deeper than 2 % of
/// the target's size: shafts pressed into their bores and threads that overlap do not make a
/// housing a shell.
/// @return by part id, 1 for those that do; always 0 outside `parts` and for targets themselves.
/// Does not depend on the view. The same for any number of threads. @throws Cancelled.
/// Cost: about 40 rays for each pair of part and target whose boxes touch.
[[nodiscard]] std::vector<std::uint8_t> find_holders(const MeshBvhs& meshes, std::span<const MeshSolid> solids,
                                                     std::span<const PartId> parts, std::span<const PartId> targets,
                                                     const Control& control = {});

/// Which of `parts` the eye lies in: its material is all around the start of the view's rays.
/// Of an orthographic view, whose rays start on a plane, nine points of the picture are tried.
[[nodiscard]] std::vector<PartId> find_around_eye(const MeshBvhs& meshes, std::span<const MeshSolid> solids,
                                                  std::span<const PartId> parts, const View& view);

/// What classify() decides.
struct CapRules {
    std::vector<CapRule> rule;       ///< by part id; none for all but the parts asked for
    std::vector<PartId> open;        ///< of those, the ones without any closed piece: no cap
    std::vector<PartId> partly_open; ///< those with closed pieces, which are capped, and open ones, which are not
    std::vector<PartId> around_eye;  ///< those that hold the eye: no cap
};

/// The user's word on parts, as PartIds in any order; `solid` wins over `shell`.
struct CapOverrides {
    std::vector<PartId> solid, shell;
};

/// How each of `parts` is capped: not at all if it bounds no material or the eye lies in it;
/// else as the overrides say; else as a shell if it holds a target; else as a solid.
/// @param solids   by mesh, from find_solids for at least the meshes of `parts`.
/// @param holders  by part id, from find_holders.
[[nodiscard]] CapRules classify(const MeshBvhs& meshes, std::span<const MeshSolid> solids,
                                std::span<const PartId> parts, std::span<const std::uint8_t> holders, const View& view,
                                const CapOverrides& overrides = {});

} // namespace porthole
