#include "porthole/render/block_map.h"

#include <algorithm>

namespace porthole {

BlockMap::BlockMap(const Picture& picture)
    : window(picture.buffer.window()), columns(window.x0 / kCell, (window.x1 - 1) / kCell),
      rows(window.y0 / kCell, (window.y1 - 1) / kCell),
      state(Rect{window.x0 / kCell, window.y0 / kCell, (window.x1 - 1) / kCell + 1, (window.y1 - 1) / kCell + 1}),
      allows(state.window(), differs), level(state.window()), summary(state.window()) {
    for (int lattice = 0; lattice < LatticeAxis::kLevels; ++lattice) {
        cells[lattice] = Mask(columns.cells(lattice), rows.cells(lattice), differs);
        across[lattice] = Mask(columns.cells(lattice), rows.blocks(lattice), differs);
        down[lattice] = Mask(columns.blocks(lattice), rows.cells(lattice), differs);
    }
    const Rect a = area();
    if (picture.everything) std::fill(state.pixels().begin(), state.pixels().end(), wanted);
    for (int by = a.y0; by < a.y1 && !picture.everything; ++by)
        for (int bx = a.x0; bx < a.x1; ++bx) {
            const Rect r = pixels(bx, by);
            for (int y = r.y0; y < r.y1; ++y)
                for (int x = r.x0; x < r.x1; ++x)
                    if (picture.buffer.pixels(x, y).has(Pixel::traced)) state(bx, by) = wanted;
        }
}

BlockMap::Cell BlockMap::between_two(int lattice, int bx, int by) const {
    const bool in_column = columns.on_lattice(lattice, bx), in_row = rows.on_lattice(lattice, by);
    if (in_column == in_row) return differs;
    const int column = columns.index(lattice, bx), row = rows.index(lattice, by);
    return Cell(in_row ? across[lattice](column, row) : down[lattice](column, row));
}

BlockMap::Cell BlockMap::allowed(int lattice, int bx, int by) const {
    const LatticeAxis::Place x = columns.place(lattice, bx), y = rows.place(lattice, by);
    if (lattice == LatticeAxis::kFinest && (x.low == bx) != (y.low == by)) return between_two(lattice, bx, by);
    std::uint8_t least = one_color;
    for (int cy = y.cell_low; cy <= y.cell_high; ++cy)
        for (int cx = x.cell_low; cx <= x.cell_high; ++cx) least = std::min(least, cells[lattice](cx, cy));
    return Cell(least);
}

bool BlockMap::is_busy(Rect tile) const {
    const Rect blocks = blocks_of(tile).grown(1).intersected(area());
    for (int by = blocks.y0; by < blocks.y1; ++by)
        for (int bx = blocks.x0; bx < blocks.x1; ++bx)
            if (state(bx, by) == traced || (state(bx, by) == wanted && allows(bx, by) == one_light)) return true;
    return false;
}

Surrounding::Surrounding(const BlockMap& map, int lattice, int bx, int by) {
    const LatticeAxis::Place column = map.columns.place(lattice, bx), row = map.rows.place(lattice, by);
    block[0] = {column.low, row.low}, block[1] = {column.high, row.low};
    block[2] = {column.low, row.high}, block[3] = {column.high, row.high};
    between_columns = column.low != column.high, between_rows = row.low != row.high;
    left = (column.low + 1) * kCell - 1, right = column.high * kCell;
    top = (row.low + 1) * kCell - 1, bottom = row.high * kCell;
    // Blocks that another one follows are whole, but for the first ones' missing left and upper pixels.
    x_step = 1.0f / float(std::max(1, right - left)), y_step = 1.0f / float(std::max(1, bottom - top));
}

void shade_blocks(Picture& picture, const Stage& stage, const BlockMap& map, Rect tile) {
    GBuffer& buffer = picture.buffer;
    std::vector<Vec2i> todo;
    const Rect area = blocks_of(tile);
    for (int by = area.y0; by < area.y1; ++by)
        for (int bx = area.x0; bx < area.x1; ++bx) {
            if (map.state(bx, by) == BlockMap::unused || map.is_inferred(bx, by)) continue;
            const Rect r = map.pixels(bx, by);
            if (map.state(bx, by) != BlockMap::settled || !map.summary(bx, by).has_corners) {
                for (int y = r.y0; y < r.y1; ++y)
                    for (int x = r.x0; x < r.x1; ++x)
                        if (buffer.pixels(x, y).has(Pixel::traced)) todo.push_back({x, y});
                continue;
            }
            const Vec4f a = picture.color(r.x0, r.y0), b = picture.color(r.x1 - 1, r.y0);
            const Vec4f c = picture.color(r.x0, r.y1 - 1), d = picture.color(r.x1 - 1, r.y1 - 1);
            const PixelLight light(buffer.pixels(r.x0, r.y0).reach()); // of all its pixels
            for (int y = r.y0; y < r.y1; ++y) {
                const float ty = r.height() > 1 ? float(y - r.y0) / float(r.height() - 1) : 0.0f;
                const Vec4f left = a + (c - a) * ty, right = b + (d - b) * ty;
                for (int x = r.x0; x < r.x1; ++x) {
                    const float tx = r.width() > 1 ? float(x - r.x0) / float(r.width() - 1) : 0.0f;
                    picture.color(x, y) = left + (right - left) * tx;
                    buffer.light(x, y) = light;
                }
            }
        }
    shade_pixels(picture, stage, tile, todo);
}

void infer_colors(Picture& picture, const BlockMap& map, int level, Rect tile) {
    const Rect area = blocks_of(tile);
    for (int by = area.y0; by < area.y1; ++by)
        for (int bx = area.x0; bx < area.x1; ++bx) {
            if (!map.is_inferred(bx, by) || map.level(bx, by) != level) continue;
            const Rect r = map.pixels(bx, by);
            const Surrounding around(map, bx, by);
            for (int y = r.y0; y < r.y1; ++y) std::fill_n(&picture.inferred(r.x0, y), r.width(), std::uint8_t{1});
            if (map.summary(around.block[0].x, around.block[0].y).key == GBuffer::kNoKey) continue; // as it is
            around.mix_all(
                r, [&](int x, int y) { return picture.color(x, y); },
                [&](int x, int y, Vec4f color) { picture.color(x, y) = color; });
        }
}

} // namespace porthole
