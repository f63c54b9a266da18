#include <cmath>
#include <cstring>
#include <memory>

#include "porthole/render/picture.h"

namespace porthole {

namespace {

constexpr float kCrease = 0.96f; ///< cosine: normals that differ more are a crease
constexpr float kBend = 0.64f;   ///< of encoded brightness within three pixels, for one sample
constexpr float kLeastBend = 0.01f, kMostBend = 0.08f;
constexpr float kContrast = 0.01f;      ///< of encoded brightness, across a crease or step
constexpr float kFaintest = 1.0f / 255; ///< of an edge: parts may differ and look the same

constexpr int kSize = FilteredTile::kSize + 2; ///< a tile and one pixel around
constexpr int kVectors = 72;                   ///< of a row that are computed: whole vectors
constexpr int kRow = kVectors + 8;             ///< room for their right neighbours

/// A tile with its border, one plane per quantity.
struct Planes {
    alignas(64) std::int32_t key[kSize][kRow];
    alignas(64) float color[4][kSize][kRow]; ///< encoded roughly as files are: what the eye sees
    alignas(64) float step[kSize][kRow];     ///< scratch: contrast with a neighbour
    alignas(64) float other[kSize][kRow];    ///< scratch: the same, 1 where keys differ
    float edge[kSize][kRow];                 ///< contrast with neighbours across an edge; 0: no edge
};

/// Key of pixels that are not traced: they are not compared.
constexpr std::int32_t kOutside = -2;

void load(const Picture& picture, Rect tile, Planes& p) {
    const GBuffer& g = picture.buffer;
    for (int row = 0; row < kSize; ++row) {
        const int y = tile.y0 - 1 + row;
        for (int column = 0; column < kRow; ++column) {
            const int x = tile.x0 - 1 + column;
            p.key[row][column] = kOutside;
            for (auto& plane : p.color) plane[row][column] = 0;
            p.edge[row][column] = 0;
            if (column >= kSize || !g.pixels.contains(x, y) || !g.pixels(x, y).has(Pixel::traced)) continue;
            p.key[row][column] = std::int32_t(g.key(x, y));
            const Vec4f c = picture.color(x, y);
            p.color[0][row][column] = c.x, p.color[1][row][column] = c.y, p.color[2][row][column] = c.z;
            p.color[3][row][column] = c.w;
        }
        for (int c = 0; c < 3; ++c)
            for (int column = 0; column < kRow; ++column) p.color[c][row][column] = std::sqrt(p.color[c][row][column]);
    }
}

/// Contrast of every pixel of a row with the pixel (dx, dy) further.
void compare_row(Planes& p, int row, int dx, int dy) {
    for (int i = 0; i < kVectors; ++i) {
        const int o = i + dx;
        float most = 0;
        for (int c = 0; c < 4; ++c) most = std::max(most, std::abs(p.color[c][row][i] - p.color[c][row + dy][o]));
        const std::int32_t a = p.key[row][i], b = p.key[row + dy][o];
        const float traced = ((a == kOutside) | (b == kOutside)) ? 0.0f : 1.0f;
        p.step[row][i] = most;
        p.other[row][i] = traced * (a == b ? most : 1.0f);
    }
}

/// Whether two pixels of one part see the same smooth piece of surface.
bool same_surface(const Picture& picture, int ax, int ay, int bx, int by) {
    const GBuffer& g = picture.buffer;
    if (g.ids.id(ax, ay) == kNoPart) return true;
    const Vec3f na = unpack_normal(g.pixels(ax, ay).normal), nb = unpack_normal(g.pixels(bx, by).normal);
    if (dot(na, nb) < kCrease) return false;
    const auto position = [&](int x, int y) {
        const Ray ray = picture.view.ray(float(x) + 0.5f, float(y) + 0.5f);
        return ray.origin + ray.direction * (g.ids.depth(x, y) / ray.depth_per_t);
    };
    const Vec3f between = position(bx, by) - position(ax, ay);
    const float pixel = picture.view.pixel_size(std::min(g.ids.depth(ax, ay), g.ids.depth(bx, by)));
    return std::min(std::abs(dot(between, na)), std::abs(dot(between, nb))) < pixel;
}

/// How much the pixels of a row differ from the mean of the neighbours before and after, times two.
void bend_row(Planes& p, int row, int dx, int dy, float least) {
    for (int i = 1; i < kVectors; ++i) {
        float most = 0;
        for (int c = 0; c < 4; ++c) {
            const float middle = p.color[c][row][i];
            most = std::max(
                most, std::abs((p.color[c][row - dy][i - dx] - middle) + (p.color[c][row + dy][i + dx] - middle)));
        }
        const bool outside =
            (p.key[row][i] == kOutside) | (p.key[row - dy][i - dx] == kOutside) | (p.key[row + dy][i + dx] == kOutside);
        const float bend = (outside | (most <= least)) ? 0.0f : most;
        p.edge[row][i] = std::max(p.edge[row][i], bend);
    }
}

void mark_row(const Picture& picture, Rect tile, Planes& p, int row, int dx, int dy) {
    for (int i = 0; i < kSize - dx; ++i) {
        const float step = p.other[row][i];
        if (step <= kContrast) continue;
        const int x = tile.x0 - 1 + i, y = tile.y0 - 1 + row;
        if (p.key[row][i] == p.key[row + dy][i + dx] && same_surface(picture, x, y, x + dx, y + dy)) continue;
        const float contrast = std::max(p.step[row][i], kFaintest);
        p.edge[row][i] = std::max(p.edge[row][i], contrast);
        p.edge[row + dy][i + dx] = std::max(p.edge[row + dy][i + dx], contrast);
    }
}

} // namespace

void find_edges(Picture& picture, Rect tile) {
    if (picture.params.uniform) {
        for (int y = tile.y0; y < tile.y1; ++y)
            for (int x = tile.x0; x < tile.x1; ++x)
                picture.edges(x, y) = picture.buffer.pixels(x, y).has(Pixel::traced) ? 1 : 0;
        return;
    }
    const auto planes = std::make_unique<Planes>();
    load(picture, tile, *planes);
    for (int row = 0; row < tile.height() + 2; ++row) {
        compare_row(*planes, row, 1, 0);
        mark_row(picture, tile, *planes, row, 1, 0);
        if (row == tile.height() + 1) break;
        compare_row(*planes, row, 0, 1);
        mark_row(picture, tile, *planes, row, 0, 1);
    }
    const float least_bend = std::clamp(kBend / float(picture.params.samples), kLeastBend, kMostBend);
    for (int row = 1; row <= tile.height(); ++row) {
        bend_row(*planes, row, 1, 0, least_bend);
        bend_row(*planes, row, 0, 1, least_bend);
    }
    for (int y = tile.y0; y < tile.y1; ++y)
        for (int x = tile.x0; x < tile.x1; ++x) {
            const float contrast = planes->edge[y - tile.y0 + 1][x - tile.x0 + 1];
            const bool rim = picture.buffer.pixels(x, y).has(Pixel::rim);
            picture.edges(x, y) = rim ? 255 : std::uint8_t(std::lround(std::min(contrast, 1.0f) * 255.0f));
        }
}

} // namespace porthole
