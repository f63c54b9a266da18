#include "porthole/hole/contour.h"

#include <algorithm>
#include <cstring>
#include <tuple>

namespace porthole {
namespace {

/// What the follower keeps per pixel. Algorithm 1 numbers the borders only to nest them; who
/// is on some border already is all that the set of borders needs.
enum State : std::int8_t { background = 0, target = 1, followed = 2, followed_east = -2 /* its east side is done */ };

/// The targets' pixels within a frame of target pixels, one wide: beyond the window is inside.
struct Grid {
    Rect window;
    std::ptrdiff_t stride;
    std::vector<std::int8_t> cells;

    explicit Grid(const Image<PartId>& ids)
        : window(ids.window()), stride(window.width() + 2),
          // Eight more at the end for the scan, which looks at eight cells at a time.
          cells(std::size_t(stride) * std::size_t(window.height() + 2) + 8, target) {
        for (std::int32_t y = window.y0; y < window.y1; ++y) {
            const PartId* in = ids.row(y);
            std::int8_t* out = cells.data() + at(window.x0, y);
            for (std::int32_t i = 0; i < window.width(); ++i) out[i] = in[i] != kNoPart ? target : background;
        }
    }

    [[nodiscard]] std::ptrdiff_t at(std::int32_t x, std::int32_t y) const {
        return std::ptrdiff_t(y - window.y0 + 1) * stride + (x - window.x0 + 1);
    }
    [[nodiscard]] Vec2i pixel(std::ptrdiff_t cell) const {
        return {window.x0 + std::int32_t(cell % stride) - 1, window.y0 + std::int32_t(cell / stride) - 1};
    }
};

/// Follows one border from `start`, whose neighbour in direction `from` (0=E, 2=N, 4=W, 6=S) is
/// background, to its end, and marks it. Steps 3.1 to 3.5 of algorithm 1.
void follow_border(Grid& grid, std::ptrdiff_t start, int from, std::vector<std::ptrdiff_t>& chain) {
    const std::ptrdiff_t s = grid.stride;
    const std::ptrdiff_t offset[8] = {1, 1 - s, -s, -1 - s, -1, s - 1, s, s + 1};
    std::int8_t* f = grid.cells.data();
    chain.clear();

    // 3.1: clockwise from the background to the pixel that the border comes from.
    int back = (from + 7) & 7;
    while (f[start + offset[back]] == background && back != from) back = (back + 7) & 7;
    if (back == from) {
        f[start] = followed_east;
        chain.push_back(start);
        return;
    }
    const std::ptrdiff_t last = start + offset[back];
    std::ptrdiff_t current = start;
    for (;;) {
        // 3.3: counter-clockwise from where we come to the next pixel of the border.
        bool east_is_background = false;
        int next = (back + 1) & 7;
        while (f[current + offset[next]] == background) {
            east_is_background |= next == 0;
            next = (next + 1) & 7;
        }
        // 3.4: an inner border must not be started again from a pixel whose east side is done.
        if (east_is_background) {
            f[current] = followed_east;
        } else if (f[current] == target) {
            f[current] = followed;
        }
        chain.push_back(current);
        const std::ptrdiff_t following = current + offset[next];
        if (following == start && current == last) return;
        back = (next + 4) & 7;
        current = following;
    }
}

/// Adds the followed border to `contours`: whole, or without its frame cells as open pieces.
void add_border(const Grid& grid, const std::vector<std::ptrdiff_t>& chain, bool outer,
                std::vector<Contour>& contours) {
    std::vector<Vec2i> pixels(chain.size());
    std::transform(chain.begin(), chain.end(), pixels.begin(), [&](std::ptrdiff_t cell) { return grid.pixel(cell); });
    const auto on_frame = [&](Vec2i p) { return !grid.window.contains(p.x, p.y); };
    const auto frame = std::find_if(pixels.begin(), pixels.end(), on_frame);
    if (frame == pixels.end()) {
        contours.push_back({std::move(pixels), outer, true});
        return;
    }
    // The region touches the window's edge, so no target is known to enclose it.
    std::rotate(pixels.begin(), frame, pixels.end());
    for (auto piece = pixels.begin(); piece != pixels.end();) {
        piece = std::find_if_not(piece, pixels.end(), on_frame);
        const auto end = std::find_if(piece, pixels.end(), on_frame);
        if (piece != end) contours.push_back({{piece, end}, true, false});
        piece = end;
    }
}

} // namespace

std::vector<Contour> find_contours(const Image<PartId>& target_ids) {
    std::vector<Contour> contours;
    if (target_ids.empty()) return contours;
    Grid grid(target_ids);
    std::vector<std::ptrdiff_t> chain;

    for (std::int32_t y = grid.window.y0; y < grid.window.y1; ++y) {
        std::int8_t* f = grid.cells.data() + grid.at(grid.window.x0 - 1, y);
        // From the frame's cell on the left: the first pixel of an enclosed region can be next to it.
        for (std::ptrdiff_t i = 0; i <= grid.window.width();) {
            // Nothing starts among eight cells that equal both their neighbours.
            std::uint64_t west, here, east;
            std::memcpy(&west, f + i - 1, 8);
            std::memcpy(&here, f + i, 8);
            std::memcpy(&east, f + i + 1, 8);
            if (west == here && here == east) {
                i += 8;
                continue;
            }
            const std::ptrdiff_t start = f + i - grid.cells.data();
            if (f[i] == target && f[i - 1] == background) {
                follow_border(grid, start, 4, chain);
                add_border(grid, chain, true, contours);
            } else if (f[i] > 0 && f[i + 1] == background) {
                follow_border(grid, start, 0, chain);
                add_border(grid, chain, false, contours);
            }
            ++i;
        }
    }
    return contours;
}

std::vector<Vec2i> contour_pixels(std::span<const Contour> contours) {
    std::vector<Vec2i> pixels;
    for (const Contour& contour : contours) pixels.insert(pixels.end(), contour.pixels.begin(), contour.pixels.end());
    std::sort(pixels.begin(), pixels.end(), [](Vec2i a, Vec2i b) { return std::tie(a.y, a.x) < std::tie(b.y, b.x); });
    pixels.erase(std::unique(pixels.begin(), pixels.end()), pixels.end());
    return pixels;
}

} // namespace porthole
