#include "porthole/render/preview.h"

#include <algorithm>
#include <limits>

namespace porthole {

namespace {

/// Whether the preview has to show something at a pixel.
bool is_asked(const Picture& picture, int x, int y) {
    if (const Cut* cut = picture.camera.cut()) return cut->distance.at_or(x, y, 1.0f) <= 0;
    return picture.covered.at_or(x, y, 0) == 0;
}

/// Whether a pixel of a traced block shows what pixels asked for may show.
bool is_source(const Picture& picture, int x, int y) {
    const Pixel& pixel = picture.buffer.pixels(x, y);
    return pixel.has(Pixel::traced) && (!picture.camera.cut() || pixel.has(Pixel::in_hole));
}

/// The four blocks of a lattice around a block.
std::array<Vec2i, 4> around(const BlockMap& map, int level, int bx, int by) {
    const LatticeAxis::Place x = map.columns.place(level, bx), y = map.rows.place(level, by);
    return {Vec2i{x.low, y.low}, {x.high, y.low}, {x.low, y.high}, {x.high, y.high}};
}

template <typename Body> void for_blocks(const BlockMap& map, Rect tile, Body&& body) {
    for (int by = tile.y0 / kCell; by <= (tile.y1 - 1) / kCell; ++by)
        for (int bx = tile.x0 / kCell; bx <= (tile.x1 - 1) / kCell; ++bx) body(bx, by, map.pixels(bx, by));
}

template <typename Body> void for_pixels(Rect r, Body&& body) {
    for (int y = r.y0; y < r.y1; ++y)
        for (int x = r.x0; x < r.x1; ++x) body(x, y);
}

/// Mean over the pixels of a traced block that see the same surface as (x, y).
Reach mean_light(const GBuffer& buffer, Rect block, int x, int y) {
    const std::uint32_t key = buffer.key(x, y);
    float open = 0, all = 0, lamps[3] = {}, n = 0;
    for_pixels(block, [&](int px, int py) {
        const Pixel& p = buffer.pixels(px, py);
        if (!p.has(Pixel::traced) || buffer.key(px, py) != key) return;
        open += float(p.ambient_open), all += float(p.ambient_all);
        for (int c = 0; c < 3; ++c) lamps[c] += float(p.lamps[c]);
        n += 255.0f;
    });
    return {{lamps[0] / n, lamps[1] / n, lamps[2] / n}, all > 0 ? open / all : 1.0f};
}

/// What a pixel between blocks follows from.
struct Sources {
    Vec2i at[4];
    float weight[4]; ///< 0: not a source
    int nearest = -1;
    float sum = 0;

    Sources(const Preview& preview, const BlockMap& map, const Surrounding& s, int x, int y) {
        const float tx = s.tx(x), ty = s.ty(y);
        const int across[2] = {s.left_of(x), s.right_of(x)}, down[2] = {s.top_of(y), s.bottom_of(y)};
        for (int i = 0; i < 4; ++i) {
            at[i] = {across[i & 1], down[i >> 1]};
            weight[i] = (i & 1 ? tx : 1 - tx) * (i >> 1 ? ty : 1 - ty);
            if (!preview.shown(at[i].x, at[i].y)) weight[i] = 0;
            if (weight[i] > 0 && (nearest < 0 || weight[i] > weight[nearest])) nearest = i;
            sum += weight[i];
        }
        if (nearest < 0) find_nearest(preview, map, s, x, y);
    }

private:
    /// None of the four nearest will do: the nearest of all pixels of their blocks.
    void find_nearest(const Preview& preview, const BlockMap& map, const Surrounding& s, int x, int y) {
        int least = std::numeric_limits<int>::max();
        for (const Vec2i b : s.block)
            for_pixels(map.pixels(b.x, b.y), [&](int px, int py) {
                const int distance = (px - x) * (px - x) + (py - y) * (py - y);
                if (distance >= least || !preview.shown(px, py)) return;
                least = distance;
                at[0] = {px, py};
                nearest = 0, weight[0] = sum = 1;
            });
    }
};

} // namespace

Mask lone_blocks(const Picture& picture, const BlockMap& map) {
    Mask lone(map.area());
    if (!picture.camera.cut() && picture.covered.empty()) return lone;
    Mask asked(map.area());
    for_pixels(map.area(), [&](int bx, int by) {
        if (map.state(bx, by) != BlockMap::wanted) return;
        for_pixels(map.pixels(bx, by), [&](int x, int y) {
            if (is_asked(picture, x, y)) asked(bx, by) = 1;
        });
    });
    for_pixels(map.area(), [&](int bx, int by) {
        if (!asked(bx, by)) return;
        const auto is_asked_block = [&](Vec2i b) { return asked(b.x, b.y) != 0; };
        const auto fine = around(map, kPreviewLevel, bx, by), coarse = around(map, kPreviewLevel - 1, bx, by);
        // What the coarser lattice settles follows from all four of its blocks.
        lone(bx, by) = fine[0] == Vec2i{bx, by} ? !std::all_of(coarse.begin(), coarse.end(), is_asked_block)
                                                : std::none_of(fine.begin(), fine.end(), is_asked_block);
    });
    return lone;
}

Preview::Preview(const Picture& picture)
    : color(picture.buffer.window(), Vec4f{}), ids(picture.buffer.window()), inferred(picture.buffer.window(), 1),
      shown(picture.buffer.window()) {
    if (picture.camera.cut()) inside = Mask(picture.buffer.window());
}

void shade_preview(Preview& preview, const Picture& picture, const Stage& stage, const BlockMap& map, Rect tile) {
    const GBuffer& buffer = picture.buffer;
    const bool flat = picture.params.shading == Shading::flat;
    std::vector<Vec2i> todo;
    for_blocks(map, tile, [&](int bx, int by, Rect block) {
        if (!map.is_traced(bx, by)) return;
        for_pixels(block, [&](int x, int y) {
            if (buffer.pixels(x, y).has(Pixel::traced)) todo.push_back({x, y});
        });
    });
    if (todo.empty()) return;
    RayCounts rays;
    Shader shader(stage, todo.size(), false, rays);
    for (std::uint32_t slot = 0; slot < todo.size(); ++slot) {
        const auto [x, y] = todo[slot];
        const Reach light = flat ? Reach{} : mean_light(buffer, map.pixels(x / kCell, y / kCell), x, y);
        shade_first(picture, stage, {x, y}, light, slot, shader);
    }
    shader.finish();
    for (std::uint32_t slot = 0; slot < todo.size(); ++slot) {
        const auto [x, y] = todo[slot];
        preview.color(x, y) = display_color(shader.radiance(slot), picture.params.background);
        preview.ids.id(x, y) = buffer.ids.id(x, y);
        preview.ids.depth(x, y) = buffer.ids.depth(x, y);
        preview.inferred(x, y) = 0;
        preview.shown(x, y) = is_source(picture, x, y);
        if (preview.inside.empty()) continue;
        preview.inside(x, y) = inside_of(buffer.pixels(x, y));
    }
    preview.rays.add(rays);
}

void interpolate_preview(Preview& preview, const Picture& picture, const BlockMap& map, int level, Rect tile) {
    const bool parallel = picture.view.orthographic;
    const auto inside = [&](Vec2i p) { return preview.inside.at_or(p.x, p.y, 0); };
    for_blocks(map, tile, [&](int bx, int by, Rect block) {
        if (map.state(bx, by) != BlockMap::wanted) return;
        const bool on_lattice = map.columns.on_lattice(kPreviewLevel, bx) && map.rows.on_lattice(kPreviewLevel, by);
        if (on_lattice != (level < kPreviewLevel)) return;
        const Surrounding surrounding(map, level, bx, by);
        for_pixels(block, [&](int x, int y) {
            if (!is_asked(picture, x, y)) return;
            const Sources from(preview, map, surrounding, x, y);
            if (from.nearest < 0) return;
            const Vec2i nearest = from.at[from.nearest];
            const PartId id = preview.ids.id(nearest.x, nearest.y);
            Vec4f color{};
            float depth = 0;
            bool one_surface = id != kNoPart;
            for (int i = 0; i < 4; ++i) {
                if (!(from.weight[i] > 0)) continue;
                const Vec2i p = from.at[i];
                const float share = from.weight[i] / from.sum, z = preview.ids.depth(p.x, p.y);
                color = color + preview.color(p.x, p.y) * share;
                depth += share * (parallel ? z : 1.0f / z);
                one_surface = one_surface && preview.ids.id(p.x, p.y) == id && inside(p) == inside(nearest);
            }
            preview.color(x, y) = color;
            preview.ids.id(x, y) = id;
            preview.ids.depth(x, y) = !one_surface ? preview.ids.depth(nearest.x, nearest.y)
                                      : parallel   ? depth
                                                   : 1.0f / depth;
            preview.shown(x, y) = 1;
            if (!preview.inside.empty()) preview.inside(x, y) = inside(nearest);
        });
    });
}

} // namespace porthole
