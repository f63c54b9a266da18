// A picture shown early: blocks of 4x4 pixels on a lattice of 16 are traced where the next coarser
// lattice does not settle them, what lies between is interpolated whether they agree or not.
#pragma once

#include "porthole/render/adaptive.h"

namespace porthole {

constexpr int kPreviewLevel = 1; ///< the lattice of previews

/// Blocks that a preview needs traced whether they are on its lattice and whether that of the level
/// above agrees around them or not: those with nothing around that shows anything of what they do, in
/// a narrow hole, say. Of a picture with a cut only the hole is looked at, of others all but what is covered.
[[nodiscard]] Mask lone_blocks(const Picture& picture, const BlockMap& map);

/// What is known of a picture so far.
struct Preview {
    Image<Vec4f> color;
    IdBuffer ids;
    Mask inside;    ///< as Frame::inside; empty without a cut
    Mask inferred;  ///< 1 where nothing was traced
    Mask shown;     ///< with a cut: 1 in the hole; empty: everything is
    RayTotals rays; ///< for the preview alone: what mirrors and glass show

    explicit Preview(const Picture& picture);
};

/// Colours of the traced pixels of `tile`, in the mean light of their block.
/// @param map  with the lattices up to kPreviewLevel traced and nothing else.
void shade_preview(Preview& preview, const Picture& picture, const Stage& stage, const BlockMap& map, Rect tile);

/// The other pixels of `tile` that follow from the lattice of `level`, once the traced ones of all tiles
/// are shaded and coarser levels done: the surface that the nearest pixel of the blocks around
/// sees, in a colour between theirs.
void interpolate_preview(Preview& preview, const Picture& picture, const BlockMap& map, int level, Rect tile);

} // namespace porthole
