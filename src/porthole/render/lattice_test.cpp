#include "porthole/render/lattice.h"

#include <gtest/gtest.h>

#include <algorithm>

namespace porthole {
namespace {

TEST(Lattice, HasEveryEighthFourthAndSecondBlockAndBothEnds) {
    const LatticeAxis axis(3, 20);
    const auto blocks = [&](int level) {
        std::vector<int> found;
        for (int i = 0; i < axis.blocks(level); ++i) found.push_back(axis.block(level, i));
        return found;
    };
    EXPECT_EQ(blocks(0), (std::vector<int>{3, 8, 16, 20}));
    EXPECT_EQ(blocks(1), (std::vector<int>{3, 4, 8, 12, 16, 20}));
    EXPECT_EQ(blocks(2), (std::vector<int>{3, 4, 6, 8, 10, 12, 14, 16, 18, 20}));
}

TEST(Lattice, EveryBlockLiesInCellsThatTouchIt) {
    for (int first = 0; first < 9; ++first)
        for (int last = first; last < first + 40; ++last) {
            const LatticeAxis axis(first, last);
            for (int level = 0; level < LatticeAxis::kLevels; ++level)
                for (int b = first; b <= last; ++b) {
                    const LatticeAxis::Place p = axis.place(level, b);
                    ASSERT_LE(p.low, b);
                    ASSERT_GE(p.high, b);
                    EXPECT_TRUE(axis.on_lattice(level, p.low) && axis.on_lattice(level, p.high));
                    EXPECT_EQ(p.low == b, p.high == b);
                    EXPECT_EQ(axis.block(level, axis.index(level, b)), p.low);
                    for (int c = 0; c < axis.cells(level); ++c) {
                        const auto [low, high] = axis.cell(level, c);
                        EXPECT_EQ(low <= b && b <= high, p.cell_low <= c && c <= p.cell_high)
                            << first << ".." << last << " level " << level << " block " << b << " cell " << c;
                    }
                }
        }
}

TEST(Lattice, CellsLieWithinTheirParents) {
    for (int first = 0; first < 9; ++first)
        for (int last = first; last < first + 40; ++last) {
            const LatticeAxis axis(first, last);
            for (int level = 1; level < LatticeAxis::kLevels; ++level)
                for (int c = 0; c < axis.cells(level); ++c) {
                    const auto [low, high] = axis.cell(level, c);
                    const auto [outer_low, outer_high] = axis.cell(level - 1, axis.parent(level, c));
                    EXPECT_LE(outer_low, low);
                    EXPECT_GE(outer_high, high);
                }
        }
}

} // namespace
} // namespace porthole
