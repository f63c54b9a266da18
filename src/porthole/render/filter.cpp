#include "porthole/render/filter.h"

#include <memory>

namespace porthole {

namespace {

constexpr int kApron = 2;
constexpr int kRow = FilteredTile::kSize + 2 * kApron + 12; // padded: whole vectors at every offset
constexpr int kRows = FilteredTile::kSize + 2 * kApron;
constexpr float kSimilarNormal = 0.9f;
constexpr int kVector = 16; ///< widths are rounded up to this

int whole_vectors(int width) { return (width + kVector - 1) / kVector * kVector; }

/// A tile with its apron, one plane per quantity, so that rows are filtered as vectors.
struct Planes {
    alignas(64) std::int32_t key[kRows][kRow];
    alignas(64) float px[kRows][kRow], py[kRows][kRow], pz[kRows][kRow];
    alignas(64) float nx[kRows][kRow], ny[kRows][kRow], nz[kRows][kRow];
    alignas(64) float near[kRows][kRow]; ///< how far off its tangent plane a neighbour may lie, metres
    alignas(64) float open[kRows][kRow], all[kRows][kRow];
    alignas(64) float lamps[3][kRows][kRow];
};

/// What a tile needs: the filter does nothing where nothing is hit, and grey shadows are one
/// channel.
struct Content {
    bool any = false, colored = false;
};

Content load(const GBuffer& buffer, const View& view, Rect tile, Planes& p) {
    Content content;
    const int columns = std::min(kRow, whole_vectors(tile.width()) + 2 * kApron);
    for (int row = 0; row < tile.height() + 2 * kApron; ++row) {
        const int y = tile.y0 - kApron + row;
        for (int column = 0; column < columns; ++column) {
            const int x = tile.x0 - kApron + column;
            p.key[row][column] = -1;
            p.px[row][column] = p.py[row][column] = p.pz[row][column] = 0;
            p.nx[row][column] = p.ny[row][column] = p.nz[row][column] = 0;
            p.near[row][column] = p.open[row][column] = p.all[row][column] = 0;
            for (auto& lamp : p.lamps) lamp[row][column] = 0;
            if (!buffer.pixels.contains(x, y)) continue;
            const std::uint32_t key = buffer.key(x, y);
            if (key == GBuffer::kNoKey) continue;
            const Pixel& pixel = buffer.pixels(x, y);
            const float depth = buffer.ids.depth(x, y);
            const Ray ray = view.ray(float(x) + 0.5f, float(y) + 0.5f);
            const Vec3f position = ray.origin + ray.direction * (depth / ray.depth_per_t);
            const Vec3f normal = unpack_normal(pixel.normal);
            p.key[row][column] = std::int32_t(key);
            p.px[row][column] = position.x, p.py[row][column] = position.y, p.pz[row][column] = position.z;
            p.nx[row][column] = normal.x, p.ny[row][column] = normal.y, p.nz[row][column] = normal.z;
            p.near[row][column] = 1.5f * view.pixel_size(depth);
            p.open[row][column] = float(pixel.ambient_open);
            p.all[row][column] = float(pixel.ambient_all);
            for (int c = 0; c < 3; ++c) p.lamps[c][row][column] = float(pixel.lamps[c]);
            content.any = true;
            content.colored |= pixel.lamps[0] != pixel.lamps[1] || pixel.lamps[1] != pixel.lamps[2];
        }
    }
    return content;
}

/// Sums of one row of pixels over its neighbours.
struct Sums {
    alignas(64) float open[FilteredTile::kSize], all[FilteredTile::kSize];
    alignas(64) float lamps[3][FilteredTile::kSize], weight[FilteredTile::kSize];
};

template <int kChannels>
void add_neighbours(const Planes& p, int row, int dx, int dy, int columns, float weight, Sums& sums) {
    const int other = row + dy;
    for (int i = 0; i < columns; ++i) {
        const int a = i + kApron, b = a + dx;
        const float ex = p.px[other][b] - p.px[row][a], ey = p.py[other][b] - p.py[row][a],
                    ez = p.pz[other][b] - p.pz[row][a];
        const float nx = p.nx[row][a], ny = p.ny[row][a], nz = p.nz[row][a];
        const float off = std::abs(ex * nx + ey * ny + ez * nz);
        const float alike = nx * p.nx[other][b] + ny * p.ny[other][b] + nz * p.nz[other][b];
        const int same = (p.key[row][a] == p.key[other][b]) & (off <= p.near[row][a]) & (alike >= kSimilarNormal);
        const float w = same ? weight : 0.0f;
        sums.weight[i] += w;
        sums.open[i] += w * p.open[other][b];
        sums.all[i] += w * p.all[other][b];
        for (int c = 0; c < kChannels; ++c) sums.lamps[c][i] += w * p.lamps[c][other][b];
    }
}

} // namespace

void filter_tile(const GBuffer& buffer, const View& view, Rect tile, FilteredTile& out) {
    out.tile = tile;
    const auto planes = std::make_unique<Planes>();
    const Content content = load(buffer, view, tile, *planes);
    if (!content.any) return;
    Sums sums;
    const int columns = whole_vectors(tile.width());
    for (int y = 0; y < tile.height(); ++y) {
        sums = {};
        for (int dy = -kApron; dy <= kApron; ++dy)
            for (int dx = -kApron; dx <= kApron; ++dx) {
                const float weight = (std::abs(dx) == kApron ? 0.5f : 1.0f) * (std::abs(dy) == kApron ? 0.5f : 1.0f);
                if (content.colored)
                    add_neighbours<3>(*planes, y + kApron, dx, dy, columns, weight, sums);
                else
                    add_neighbours<1>(*planes, y + kApron, dx, dy, columns, weight, sums);
            }
        const int first = y * FilteredTile::kSize;
        for (int i = 0; i < tile.width(); ++i) {
            out.ambient[first + i] = sums.all[i] > 0 ? sums.open[i] / sums.all[i] : 1.0f;
            const float scale = sums.weight[i] > 0 ? 1.0f / (255.0f * sums.weight[i]) : 0.0f;
            for (int c = 0; c < 3; ++c) out.lamps[c][first + i] = sums.lamps[content.colored ? c : 0][i] * scale;
        }
    }
}

} // namespace porthole
