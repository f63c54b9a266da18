// Adaptive refinement: which blocks of 4x4 pixels are traced, and what the others take from
// those around.
//
// Blocks on a lattice of 32 pixels are traced first. Where the four at the corners of a cell see
// one surface in one light, what lies between is inferred; elsewhere the lattice is halved, and halved again,
// then every block is traced. At last each traced block that contradicts what was inferred beside it
// has that neighbour traced as well, and so on: the paper's contour following, lifted from pixels
// to blocks. Rounds of it follow one another whole, so the result
// does not depend on the order of work.
#pragma once

#include <memory>

#include "porthole/render/block_map.h"

namespace porthole {

/// Pass 1 in place of gather_tile() for every tile: traces what has to be. Afterwards pixels of
/// blocks that are not traced have Pixel::inferred; without Pixel::traced if all of them is inferred: their
/// surface is in the ids, their light where traced pixels beside them look for it, and their
/// colour comes with infer_colors().
/// Cost: 1/16 of gathering every block where nothing differs.
/// The same bits for any number of threads. Keeps references. What Cancelled stopped goes on where it
/// was when called again.
class AdaptiveGather {
public:
    /// @param everything  false: camera rays are traced everywhere, only light is inferred.
    AdaptiveGather(Picture& picture, const Stage& stage, bool everything);
    ~AdaptiveGather();
    /// As far as a preview needs it.
    void trace_lattice(const Control& control);
    /// And then the others.
    void trace_rest(const Control& control);
    [[nodiscard]] const BlockMap& map() const;

private:
    struct Work;
    std::unique_ptr<Work> work_;
};

} // namespace porthole
