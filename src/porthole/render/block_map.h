// The blocks of 4x4 pixels of a picture that is refined adaptively, and what those that are not
// traced follow from.
#pragma once

#include "porthole/render/lattice.h"
#include "porthole/render/picture.h"

namespace porthole {

/// What is known of a block once it is traced.
struct BlockSummary {
    std::uint32_t key = GBuffer::kNoKey; ///< of all its pixels, if uniform
    std::uint32_t material = 0;
    float open = 0, all = 0;   ///< mean over its pixels of what their ambient rays found
    float lamps[3] = {};       ///< mean
    bool uniform = false;      ///< one key and material, and no crease
    bool evenly_lit = false;   ///< by the lamps
    bool interpolable = false; ///< colours of its material follow from geometry and light alone
    bool has_corners = false;  ///< its corner pixels have the colours that its mean light gives them
    [[nodiscard]] float ambient() const { return all > 0 ? open / all : 1.0f; }
};

/// A picture's blocks of 4x4 pixels and what becomes of them; blocks in units of 4 pixels.
struct BlockMap {
    enum State : std::uint8_t {
        unused,  ///< no pixel is wanted
        wanted,  ///< not traced: what it shows follows from the lattice
        traced,  ///< camera, shadow and ambient rays
        settled, ///< traced, and so much alone on a smooth surface that its light is one value
    };
    /// What the four corners of a lattice cell allow between them.
    enum Cell : std::uint8_t {
        differs,   ///< nothing
        one_light, ///< to infer the light
        one_color  ///< to infer everything
    };
    Rect window; ///< of the picture, pixels
    LatticeAxis columns, rows;
    Mask state;
    Mask allows;                       ///< Cell of blocks that are not traced,
    Mask level;                        ///< and the lattice they follow from
    Image<BlockSummary> summary;       ///< of traced blocks
    Mask cells[LatticeAxis::kLevels];  ///< Cell of each
    Mask across[LatticeAxis::kLevels]; ///< Cell of two lattice blocks side by side: by cell and lattice row
    Mask down[LatticeAxis::kLevels];   ///< one above the other: by lattice column and cell

    explicit BlockMap(const Picture& picture);
    [[nodiscard]] Rect area() const { return state.window(); }
    [[nodiscard]] Rect pixels(int bx, int by) const {
        return Rect{bx * kCell, by * kCell, (bx + 1) * kCell, (by + 1) * kCell}.intersected(window);
    }
    [[nodiscard]] bool is_traced(int bx, int by) const { return state.at_or(bx, by, unused) >= traced; }
    [[nodiscard]] bool is_inferred(int bx, int by) const {
        return state(bx, by) == wanted && allows(bx, by) == one_color;
    }
    /// What two blocks of a lattice allow for one on the line between them; differs elsewhere.
    [[nodiscard]] Cell between_two(int lattice, int bx, int by) const;
    /// What a lattice allows for a block: the least of the cells around it, but on the line
    /// between two blocks of the finest lattice what these two allow.
    [[nodiscard]] Cell allowed(int lattice, int bx, int by) const;
    /// Whether some block in or beside `tile` may see edges.
    [[nodiscard]] bool is_busy(Rect tile) const;
};

/// What the pixels of a block follow from: four traced pixels each, those nearest of the blocks
/// around it. On a lattice row or column these are the row's or column's own.
struct Surrounding {
    Vec2i block[4]; ///< upper left, upper right, lower left, lower right
    bool between_columns, between_rows;
    int left, right, top, bottom; ///< pixels
    float x_step, y_step;

    Surrounding(const BlockMap& map, int bx, int by) : Surrounding(map, map.level(bx, by), bx, by) {}
    Surrounding(const BlockMap& map, int lattice, int bx, int by);
    [[nodiscard]] int left_of(int x) const { return between_columns ? left : x; }
    [[nodiscard]] int right_of(int x) const { return between_columns ? right : x; }
    [[nodiscard]] int top_of(int y) const { return between_rows ? top : y; }
    [[nodiscard]] int bottom_of(int y) const { return between_rows ? bottom : y; }
    [[nodiscard]] float tx(int x) const { return between_columns ? float(x - left) * x_step : 0.0f; }
    [[nodiscard]] float ty(int y) const { return between_rows ? float(y - top) * y_step : 0.0f; }

    /// Of what value(x, y) gives at the four pixels.
    template <typename Value> [[nodiscard]] auto mix(int x, int y, Value&& value) const {
        const auto a = mix_column(left_of(x), y, value);
        return a + (mix_column(right_of(x), y, value) - a) * tx(x);
    }
    /// The same for every pixel of `r`, handed to store(x, y, mixed).
    template <typename Value, typename Store> void mix_all(Rect r, Value&& value, Store&& store) const {
        for (int y = r.y0; y < r.y1; ++y) {
            if (!between_columns) {
                for (int x = r.x0; x < r.x1; ++x) store(x, y, mix_column(x, y, value));
                continue;
            }
            const auto a = mix_column(left, y, value), step = mix_column(right, y, value) - a;
            for (int x = r.x0; x < r.x1; ++x) store(x, y, a + step * tx(x));
        }
    }
    /// Of what value(summary) gives of the four blocks.
    template <typename Value> [[nodiscard]] float mix_blocks(const BlockMap& map, int x, int y, Value&& value) const {
        const auto of = [&](int i) { return float(value(map.summary(block[i].x, block[i].y))); };
        const float a = of(0) + (of(2) - of(0)) * ty(y), b = of(1) + (of(3) - of(1)) * ty(y);
        return a + (b - a) * tx(x);
    }

private:
    template <typename Value> [[nodiscard]] auto mix_column(int x, int y, Value&& value) const {
        const auto a = value(x, top_of(y));
        return a + (value(x, bottom_of(y)) - a) * ty(y);
    }
};

/// The blocks that `tile` touches.
[[nodiscard]] inline Rect blocks_of(Rect tile) {
    return {tile.x0 / kCell, tile.y0 / kCell, (tile.x1 - 1) / kCell + 1, (tile.y1 - 1) / kCell + 1};
}

/// Pass 2 in place of shade_tile(): shades what is traced, but of blocks that stand alone on a smooth
/// surface only the corners, between which their other pixels lie.
void shade_blocks(Picture& picture, const Stage& stage, const BlockMap& map, Rect tile);

/// Colours of the pixels of `tile` that are inferred altogether from the lattice of `level`, once
/// those of traced pixels and of coarser levels are there.
void infer_colors(Picture& picture, const BlockMap& map, int level, Rect tile);

} // namespace porthole
