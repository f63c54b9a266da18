#include "porthole/render/lattice.h"

#include <algorithm>
#include <cassert>

namespace porthole {

LatticeAxis::LatticeAxis(int first, int last) : first_(first) {
    assert(first >= 0 && first <= last);
    for (int level = 0; level < kLevels; ++level) {
        const int stride = 8 >> level;
        blocks_[level].push_back(first);
        for (int b = (first / stride + 1) * stride; b < last; b += stride) blocks_[level].push_back(b);
        if (last > first) blocks_[level].push_back(last);
    }
    for (int level = 0; level < kLevels; ++level) {
        const std::vector<int>& b = blocks_[level];
        const int last_cell = cells(level) - 1;
        int k = 0;
        for (int block = first; block <= last; ++block) {
            if (k + 1 < int(b.size()) && b[std::size_t(k + 1)] == block) ++k;
            const int low = b[std::size_t(k)];
            if (low == block)
                places_[level].push_back({low, low, std::clamp(k - 1, 0, last_cell), std::min(k, last_cell), k});
            else
                places_[level].push_back({low, b[std::size_t(k + 1)], k, k, k});
        }
    }
}

int LatticeAxis::cells(int level) const { return std::max(1, int(blocks_[level].size()) - 1); }

std::pair<int, int> LatticeAxis::cell(int level, int index) const {
    const std::vector<int>& b = blocks_[level];
    return {b[std::size_t(index)], b[std::min(std::size_t(index) + 1, b.size() - 1)]};
}

int LatticeAxis::parent(int level, int cell) const {
    return place(level - 1, blocks_[level][std::size_t(cell)]).cell_high;
}

} // namespace porthole
