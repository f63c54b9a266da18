// What keeps adaptive refinement from missing things: where it starts to look, and where what was
// traced contradicts what was inferred. Blocks of 4x4 pixels, in units of 4.
#pragma once

#include <span>
#include <vector>

#include "porthole/render/block_map.h"

namespace porthole {

inline constexpr float kAmbientStep = 0.25f; ///< of the open share, from block to block
inline constexpr float kLampStep = 0.02f;    ///< of the lamps' share

/// Blocks that are not traced and in which a vertex of a part should be seen but would not be: up
/// to 32 vertices of every part, those in front of what is inferred. Each block once.
[[nodiscard]] std::vector<Vec2i> seed_blocks(const Picture& picture, const Stage& stage, const BlockMap& map,
                                             const Control& control);

/// Blocks that are not traced and have to be since `fresh` ones are: neighbours in which these
/// show that something else goes on, and what followed from blocks that were not as assumed.
/// Each once, neighbours close together.
[[nodiscard]] std::vector<Vec2i> contradicted_by(const Picture& picture, const BlockMap& map,
                                                 std::span<const Vec2i> fresh, const Control& control);

} // namespace porthole
