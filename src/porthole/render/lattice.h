// Where blocks of 4x4 pixels lie in the nested lattices of adaptive refinement.
#pragma once

#include <utility>
#include <vector>

namespace porthole {

/// One axis of the lattices: level 0 has every eighth block, level 1 every fourth, level 2 every
/// second, and all of them the first and the last one. Blocks are numbered as in the picture: pixel / 4.
class LatticeAxis {
public:
    static constexpr int kLevels = 3, kFinest = kLevels - 1;

    /// Blocks first..last, both included.
    LatticeAxis(int first, int last);

    /// A block between the lattice's blocks `low` and `high`, which are the block itself if it is
    /// one of them; the cells that touch it are cell_low..cell_high.
    struct Place {
        int low, high;
        int cell_low, cell_high;
        int index; ///< of `low` among the lattice's blocks
    };
    [[nodiscard]] const Place& place(int level, int block) const { return places_[level][std::size_t(block - first_)]; }
    [[nodiscard]] bool on_lattice(int level, int block) const { return place(level, block).low == block; }
    [[nodiscard]] int blocks(int level) const { return int(blocks_[level].size()); } ///< of the lattice
    [[nodiscard]] int block(int level, int index) const { return blocks_[level][std::size_t(index)]; }
    /// Which block of the lattice is the last not beyond `block`.
    [[nodiscard]] int index(int level, int block) const { return place(level, block).index; }
    /// Cells lie between neighbouring lattice blocks; there is at least one.
    [[nodiscard]] int cells(int level) const;
    [[nodiscard]] std::pair<int, int> cell(int level, int index) const; ///< its first and last block
    [[nodiscard]] int parent(int level, int cell) const;                ///< the cell of the level above that holds it

private:
    int first_;
    std::vector<int> blocks_[kLevels];   ///< of the lattice, increasing
    std::vector<Place> places_[kLevels]; ///< by block
};

} // namespace porthole
