// Whether a report tells the truth: its view is traced again, densely and slowly.
#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "porthole/reveal.h"

namespace porthole {

/// Something that a report or its picture says and that was not found.
struct Difference {
    std::string what;            ///< "model", "targets", "target pixels", "hole", "figure", "picture inside",
                                 ///< "picture outside"
    std::string where;           ///< "pixel 12,34", "pixel 12,34 of engine/rod", or a JSON pointer
    std::string reported, found; ///< as words or JSON
};

/// What is compared besides the report itself.
struct CheckParams {
    /// The picture as its file holds it, decoded; may be null: no picture is compared.
    const Image<Rgba16>* picture = nullptr;
    /// A frame as it would come back from such a file. Needed with a picture.
    std::function<Image<Rgba16>(const Frame&)> as_in_file{};
    /// The file keeps no exact pixels (JPEG), so that those beside the hole depend on it.
    bool lossy = false;
    std::uint64_t max_bytes = std::uint64_t(16) << 30; ///< most memory for picture and margin
};

struct Checked {
    std::vector<Difference> differences;          ///< of one `what` at most 20
    std::map<std::string, std::int64_t> unlisted; ///< by `what`: how many more there are
    std::int64_t rays = 0, crossings = 0;         ///< of the dense passes
    std::int64_t target_pixels = 0;               ///< in picture and margin, found and compared
    std::int64_t hole_pixels = 0;                 ///< alike
    std::int64_t tied_pixels = 0;                 ///< where surfaces lie so that either answer is right
    std::int64_t inside_pixels = 0;               ///< of the picture, compared with the reveal drawn again: all, if the
                                                  ///< rest of the model is restyled or the file is lossy
    std::int64_t outside_pixels = 0;              ///< compared with the plain picture

    [[nodiscard]] bool good() const { return differences.empty(); }
};

/// Repeats what `text` reports and compares.
///
/// Independently of the plan and of the renderer's packets: every pixel of the picture and its
/// margin is traced against each target in the rectangle of its projected vertices, and every
/// pixel of the picture against everything, all crossings in order, what is gone decided by
/// the definition of the cut at the pixel's centre. From these come the targets' masks, their
/// pixel counts, visible_before, visible_after, visible_among_targets, outline_iou,
/// see_through_px and hole_pixels. The cut itself and the hole's mask come from a plan with
/// ContourMethod::full. Then the plain picture and the reveal are drawn again: pixels that are
/// neither in the hole nor touch it, nor hold a hair of a target, must equal the plain picture, all others the reveal;
/// and every other figure of the report must come out again, except run, version and warnings.
///
/// @param meshes    of the scene that `reported` names.
/// @param reported  from read_report.
/// @param text      the report itself: the figures in it are compared as they stand.
/// @return what differs; good() if nothing does. When the model lacks the parts that the report
///         names there is nothing to repeat, and only that is listed.
/// @throws Error usage, limit as reveal; limit E0901 when picture and margin do not fit into
///         params.max_bytes; Cancelled.
/// The same answer for any number of threads. Cost: three pictures, and two rays that pass
/// every surface a pixel.
[[nodiscard]] Checked check_report(const MeshBvhs& meshes, const Report& reported, std::string_view text,
                                   const CheckParams& params = {}, const Control& control = {});

} // namespace porthole
