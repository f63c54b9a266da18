// A loop over tiles that can be stopped and gone on with.
#pragma once

#include <cstdint>
#include <vector>

#include "porthole/base/parallel.h"

namespace porthole {

/// Runs one loop over tiles after the other. One that an exception stopped goes on when it is run
/// again: no tile that was finished is done twice.
class TileLoop {
public:
    /// parallel_for_tiles() over the tiles not done yet. @throws Cancelled, and what `body` throws.
    template <typename Body> void run(Rect window, int tile_px, const Control& control, Body&& body) {
        if (window.empty()) return;
        const auto tile_of = [tile_px](int v) { return (v >= 0 ? v : v - tile_px + 1) / tile_px; };
        const int x0 = tile_of(window.x0), y0 = tile_of(window.y0);
        const int across = tile_of(window.x1 - 1) - x0 + 1, down = tile_of(window.y1 - 1) - y0 + 1;
        done_.resize(std::size_t(across) * std::size_t(down), 0);
        parallel_for_tiles(window, tile_px, control, [&](Rect tile) {
            std::uint8_t& done =
                done_[std::size_t(tile_of(tile.y0) - y0) * std::size_t(across) + std::size_t(tile_of(tile.x0) - x0)];
            if (done) return;
            body(tile);
            done = 1;
        });
        done_.clear();
    }

private:
    std::vector<std::uint8_t> done_; ///< of the loop that runs
};

} // namespace porthole
