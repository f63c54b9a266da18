#include "porthole/hole/contour.h"

#include <immintrin.h>

#include <algorithm>
#include <bit>
#include <cstring>
#include <tuple>

namespace porthole {
namespace {

/// What the follower keeps, a bit a pixel. Algorithm 1 numbers the borders only to nest them; who is on
/// some border already is all that the set of borders needs.
struct Grid {
    Rect window;
    std::int32_t left;     ///< column 0 of a row of bits, absolute; what lies beyond the window is inside
    std::ptrdiff_t stride; ///< words a row; one row above and below the window
    std::vector<std::uint64_t> target;
    std::vector<std::uint64_t> followed;  ///< on some border
    std::vector<std::uint64_t> east_done; ///< and the background on its right belongs to one that is done

    /// @param fill  writes the bits of row y, from column x0 & ~7 on, at an address.
    template <typename Fill> Grid(Rect pixels, const Fill& fill)
        : window(pixels), left((pixels.x0 & ~7) - 8), stride((pixels.x1 - left) / 64 + 1),
          target(std::size_t(stride * (window.height() + 2)), ~std::uint64_t{0}), followed(target.size()),
          east_done(target.size()) {
        for (std::int32_t y = window.y0; y < window.y1; ++y) {
            std::uint64_t* row = target.data() + (y - window.y0 + 1) * stride;
            fill(y, reinterpret_cast<std::uint8_t*>(row) + 1);
            for (std::int32_t x = left + 8; x < window.x0; ++x) row[0] |= std::uint64_t{1} << (x - left);
            const std::int32_t end = window.x1 - left;
            for (std::int32_t c = end; c < ((end + 7) & ~7); ++c) row[c >> 6] |= std::uint64_t{1} << (c & 63);
        }
    }

    [[nodiscard]] bool is_target(std::ptrdiff_t cell) const {
        return target[std::size_t(cell >> 6)] >> (cell & 63) & 1;
    }
    static void set(std::vector<std::uint64_t>& bits, std::ptrdiff_t cell) {
        bits[std::size_t(cell >> 6)] |= std::uint64_t{1} << (cell & 63);
    }
    [[nodiscard]] Vec2i pixel(std::ptrdiff_t cell) const {
        return {left + std::int32_t(cell % (64 * stride)), window.y0 - 1 + std::int32_t(cell / (64 * stride))};
    }
};

/// Follows one border from `start`, whose neighbour in direction `from` (0=E, 2=N, 4=W, 6=S) is
/// background, to its end, and marks it. Steps 3.1 to 3.5 of algorithm 1.
void follow_border(Grid& grid, std::ptrdiff_t start, int from, std::vector<std::ptrdiff_t>& chain) {
    const std::ptrdiff_t s = 64 * grid.stride;
    const std::ptrdiff_t offset[8] = {1, 1 - s, -s, -1 - s, -1, s - 1, s, s + 1};
    chain.clear();

    // 3.1: clockwise from the background to the pixel that the border comes from.
    int back = (from + 7) & 7;
    while (!grid.is_target(start + offset[back]) && back != from) back = (back + 7) & 7;
    if (back == from) {
        Grid::set(grid.east_done, start);
        chain.push_back(start);
        return;
    }
    const std::ptrdiff_t last = start + offset[back];
    std::ptrdiff_t current = start;
    for (;;) {
        // 3.3: counter-clockwise from where we come to the next pixel of the border.
        bool east_is_background = false;
        int next = (back + 1) & 7;
        while (!grid.is_target(current + offset[next])) {
            east_is_background |= next == 0;
            next = (next + 1) & 7;
        }
        // 3.4: an inner border must not be started again from a pixel whose east side is done.
        Grid::set(east_is_background ? grid.east_done : grid.followed, current);
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

std::vector<Contour> all_borders(Grid& grid) {
    std::vector<Contour> contours;
    std::vector<std::ptrdiff_t> chain;
    const std::ptrdiff_t end = grid.window.x1 - grid.left;
    for (std::int32_t y = grid.window.y0; y < grid.window.y1; ++y) {
        const std::ptrdiff_t row = (y - grid.window.y0 + 1) * grid.stride;
        for (std::ptrdiff_t k = row; 64 * (k - row) < end; ++k) {
            // Borders start where a target's neighbour on the left or on the right is background. The words
            // before and after a row are the neighbouring rows': inside, as a row ends outside the window.
            const std::uint64_t here = grid.target[std::size_t(k)];
            const std::uint64_t west = here << 1 | grid.target[std::size_t(k - 1)] >> 63;
            const std::uint64_t east = here >> 1 | grid.target[std::size_t(k + 1)] << 63;
            std::uint64_t starts = here & ~(west & east);
            if (const std::ptrdiff_t used = end - 64 * (k - row); used < 64) starts &= (std::uint64_t{1} << used) - 1;
            for (; starts; starts &= starts - 1) {
                const int bit = std::countr_zero(starts);
                const std::uint64_t one = std::uint64_t{1} << bit;
                const std::ptrdiff_t start = 64 * k + bit;
                if (grid.east_done[std::size_t(k)] & one) continue;
                if (!(west & one) && !(grid.followed[std::size_t(k)] & one)) {
                    follow_border(grid, start, 4, chain);
                    add_border(grid, chain, true, contours);
                } else if (!(east & one)) {
                    follow_border(grid, start, 0, chain);
                    add_border(grid, chain, false, contours);
                }
            }
        }
    }
    return contours;
}

} // namespace

std::vector<Contour> find_contours(const Image<PartId>& target_ids) {
    if (target_ids.empty()) return {};
    const Rect w = target_ids.window();
    Grid grid(w, [&](std::int32_t y, std::uint8_t* out) {
        const int before = w.x0 & 7;
        std::memset(out, 0, std::size_t(before + w.width() + 7) / 8);
        const PartId* in = target_ids.row(y);
        std::int32_t i = 0;
        const auto one = [&] {
            out[(before + i) >> 3] = std::uint8_t(out[(before + i) >> 3] | int(in[i] != kNoPart) << ((before + i) & 7));
            ++i;
        };
        while (i < w.width() && ((before + i) & 7)) one();
        const __m256i none = _mm256_set1_epi32(int(index(kNoPart)));
        for (; i + 8 <= w.width(); i += 8) {
            const __m256i eight = _mm256_loadu_si256(reinterpret_cast<const __m256i*>(in + i));
            const int outside = _mm256_movemask_ps(_mm256_castsi256_ps(_mm256_cmpeq_epi32(eight, none)));
            out[(before + i) >> 3] = std::uint8_t(~outside);
        }
        while (i < w.width()) one();
    });
    return all_borders(grid);
}

std::vector<Contour> find_contours(const Bits& targets, Rect window) {
    if (window.empty()) return {};
    Grid grid(window, [&](std::int32_t y, std::uint8_t* out) {
        std::memcpy(out, targets.row(y) + (((window.x0 & ~7) - targets.window().x0) >> 3),
                    std::size_t((window.x0 & 7) + window.width() + 7) / 8);
    });
    return all_borders(grid);
}

std::vector<Vec2i> contour_pixels(std::span<const Contour> contours) {
    std::vector<Vec2i> pixels;
    for (const Contour& contour : contours) pixels.insert(pixels.end(), contour.pixels.begin(), contour.pixels.end());
    std::sort(pixels.begin(), pixels.end(), [](Vec2i a, Vec2i b) { return std::tie(a.y, a.x) < std::tie(b.y, b.x); });
    pixels.erase(std::unique(pixels.begin(), pixels.end()), pixels.end());
    return pixels;
}

} // namespace porthole
