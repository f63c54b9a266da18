// Caps: where the cut surface runs through solid material, and through whose.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "porthole/scene/solid.h"
#include "porthole/trace/bvh.h"

namespace porthole {

/// Where the rays of a packet meet the cut surface of each level.
struct CutLanes {
    float t[kMostLevels][kLanes];      ///< +infinity: the level is not cut there
    bool chamfer[kMostLevels][kLanes]; ///< on the chamfer, where shells are capped
};

struct CapLanes {
    SurfaceRef cap[kMostLevels][kLanes]; ///< whose material it is; part kNoPart: none
};

/// Levels that have parts to cap.
struct CappedLevels {
    std::uint32_t mask = 0; ///< ray mask; 0: none
    bool any[kMostLevels] = {}, solids[kMostLevels] = {};
    bool doubtful = false; ///< among them parts with gaps: rays must be followed to their end
    [[nodiscard]] bool at(std::size_t level, bool chamfer) const { return chamfer ? any[level] : solids[level]; }
};

/// The caps of a cut at pixel centres and as a mesh.
struct Caps {
    std::span<const MeshSolid> solids; ///< by mesh index; must stay alive
    CappedLevels capped;
    std::vector<Image<SurfaceRef>> levels; ///< by level, over the hole's box: part kNoPart where there is none
    std::vector<Mask> even; ///< by level: 1 where a pixel and its eight neighbours have caps of one part, or none
    CapMesh mesh; ///< one quad a capped pixel, larger ones where the cut is flat, and the walls between pixels
                  ///< where it drops through a solid. See-through materials have none: light passes them
    [[nodiscard]] bool empty() const { return levels.empty(); }
    [[nodiscard]] SurfaceRef at(std::size_t level, int x, int y) const {
        return levels.empty() ? SurfaceRef{} : levels[level].at_or(x, y, SurfaceRef{});
    }
    /// Whether the pixel's cap stands for all of its samples.
    [[nodiscard]] bool is_even(std::size_t level, int x, int y) const {
        return levels[level].empty() || even[level].at_or(x, y, 0) != 0;
    }
};

/// @param targets  ids of the opened targets, any window: where they are seen, the cut ends on them
///                 and no cap is made. May be empty.
/// @param solids   by mesh index, judged for the meshes of the cut set; others are not asked.
/// @return empty when no part of the cut set is capped.
/// Cost: one find_caps() ray a pixel of the hole, 16 bytes a pixel and level of its box.
/// The same for any number of threads.
/// @throws Cancelled.
[[nodiscard]] Caps trace_caps(const Bvh& bvh, const Cut& cut, std::span<const MeshSolid> solids,
                              const Image<PartId>& targets = {}, const Control& control = {},
                              std::int64_t* rays = nullptr);

/// Whose material rays from the eye are in where they meet the cut surface.
///
/// A ray is inside a part when on its way it entered the part's closed components more often
/// than it left them. Of several parts the one that was entered last is innermost; ties by
/// lower id. The surface named is where it was entered. Of parts with gaps (closed by rays, but
/// not by all) only rays count that enter and leave them in turn along their whole way.
///
/// @param bvh     built with the roles and levels of `cut`.
/// @param caps    of `cut`, from trace_caps().
/// @param rays    from the eye; active lanes with their origin and direction. tnear, tfar and
///                mask are overwritten.
/// Cost: one occlusion ray a lane that passes every surface in front of the deepest cut; none
/// where no level can be capped.
[[nodiscard]] CapLanes find_caps(const Bvh& bvh, const Cut& cut, const Caps& caps, RayHit16& rays,
                                 const CutLanes& lanes);

} // namespace porthole
