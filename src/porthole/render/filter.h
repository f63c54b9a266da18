// Evens out the interleaved patterns of shadow and ambient rays.
#pragma once

#include "porthole/base/view.h"
#include "porthole/render/gbuffer.h"

namespace porthole {

/// Light that reaches the pixels of one tile, filtered.
struct FilteredTile {
    static constexpr int kSize = 64; ///< largest tile
    Rect tile;
    float ambient[kSize * kSize];
    float lamps[3][kSize * kSize];
    [[nodiscard]] int index(int x, int y) const { return (y - tile.y0) * kSize + (x - tile.x0); }
    [[nodiscard]] Reach reach(int x, int y) const {
        const int i = index(x, y);
        return {{lamps[0][i], lamps[1][i], lamps[2][i]}, ambient[i]};
    }
};

/// Averages each pixel of `tile` with its 5x5 neighbours in the buffer's window, the outer
/// ones at half weight: every offset of the 4x4 pattern weighs the same, so on a surface
/// without edges all 16 patterns count equally and no grain is left. Only neighbours of the
/// same part and side of the rim, with a similar normal and near the pixel's tangent plane
/// count. Writes `out` at the tile's pixels that hit something (64 KB: mind the stack).
/// @param view  the buffer's; gives positions and the size of a pixel.
void filter_tile(const GBuffer& buffer, const View& view, Rect tile, FilteredTile& out);

} // namespace porthole
