// The lines of one picture: the rim of its hole, and outlines and creases.
#pragma once

#include "porthole/render/lines.h"
#include "porthole/render/picture.h"

namespace porthole {

/// Half the width of outlines and creases; scaled like rim_px in pictures over 1080 px high.
[[nodiscard]] float line_half_width(const View& view);
/// How much wider than stated lines are in pictures over 1080 px high.
[[nodiscard]] float line_scale(const View& view);

/// What samples anywhere in the picture see: Camera::trace() with `may_open` as the cut has it.
[[nodiscard]] Seen16 look(const Camera& camera, Samples16 samples, RayCounts& rays);

/// The rays of a camera. Keeps references.
[[nodiscard]] LineTrace camera_trace(const Camera& camera, const std::vector<Placement>& placements, RayCounts& rays);

/// Which sub-positions of a pixel (Ink::position) see a target; bit by sub-position.
[[nodiscard]] std::uint32_t parts_on_target(const Camera& camera, int x, int y, RayCounts& rays);

/// Where along the rim of a hole its line is drawn: where something was cut away.
///
/// On bumpy surfaces the cut begins ragged: here the surface lies in front of it, there behind.
/// The line bridges gaps of up to a hundredth of the picture's height, so that it is even, and
/// does not run on where the rim crosses what is whole.
class RimLine {
public:
    RimLine() = default; ///< none
    /// @param picture  after the first pass.
    /// @param plain    the ids of the same view without the cut.
    RimLine(const Picture& picture, const Cut& cut, const IdBuffer& plain, float tolerance);

    /// How much the end of a cut surface at `s`, seen at a position of the picture, is the rim: where
    /// the surface lies deeper than the cut begins, that is where the hole ends, and not at its outline.
    [[nodiscard]] float outer(float x, float y, const LineSample& s) const;
    /// How much the line takes of the light at a position of the picture, [0, 1].
    [[nodiscard]] float darkness(float x, float y) const;
    /// False if darkness() is zero all over the pixel.
    [[nodiscard]] bool reaches(int x, int y) const {
        if (!cut_) return false;
        const float d = cut_->distance.at_or(x, y, kNowhere);
        return d < 3 && d > -2 * width_ - 3; // as distances differ by less than 1.5 a pixel
    }

private:
    static constexpr float kNowhere = 1e6f;
    const Cut* cut_ = nullptr;
    const IdBuffer* plain_ = nullptr;
    float width_ = 0;
    Image<std::uint8_t> drawn_;
};

/// Pass 5: draws the lines that the picture's parameters ask for over one tile. In a picture
/// with a cut only on pixels that it opens, and those of the rim never on targets.
void draw_lines(Picture& picture, const Stage& stage, const RimLine& rim, Rect tile);

} // namespace porthole
