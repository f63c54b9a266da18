#include "porthole/render/macro_pixels.h"

#include <gtest/gtest.h>

#include <string>
#include <vector>

namespace porthole {
namespace {

using Rows = std::vector<std::string>;

/// A picture drawn as text: one letter a surface, '.' nothing. Colour is a plane over the picture,
/// so that linear interpolation makes no error; depth too.
class Drawn {
public:
    explicit Drawn(Rows rows, Vec2i corner = {0, 0}) : rows_(std::move(rows)), corner_(corner) {}

    [[nodiscard]] Rect window() const {
        return {corner_.x, corner_.y, corner_.x + int(rows_[0].size()), corner_.y + int(rows_.size())};
    }
    [[nodiscard]] char at(int x, int y) const { return rows_[std::size_t(y - corner_.y)][std::size_t(x - corner_.x)]; }
    [[nodiscard]] static Vec4f color(int x, int y) {
        return {0.25f + 0.01f * float(x), 0.75f - 0.02f * float(y), 0, 1};
    }
    [[nodiscard]] static float depth(int x, int y) { return 5 + 0.5f * float(x) - 0.25f * float(y); }

    [[nodiscard]] PartialPicture refined(Refine how, const RefineParams& by, const Mask& wanted = {}) const {
        PartialPicture picture(window());
        Mask asked(window(), 0);
        infer_pixels(how, by, wanted, picture, [&](PartialPicture& p, std::span<const Vec2i> pixels) {
            for (const Vec2i at : pixels) {
                EXPECT_FALSE(asked(at.x, at.y)) << "traced twice: " << at.x << ',' << at.y;
                asked(at.x, at.y) = 1;
                const char c = this->at(at.x, at.y);
                if (c == '.') continue;
                p.surface(at.x, at.y) = std::uint64_t(c);
                p.color(at.x, at.y) = color(at.x, at.y);
                p.ids.id(at.x, at.y) = PartId(std::uint32_t(c));
                p.ids.depth(at.x, at.y) = depth(at.x, at.y);
            }
        });
        return picture;
    }

    /// What the picture shows: traced pixels in capitals, '*' where nothing was hit; '?' unknown.
    [[nodiscard]] Rows shown(const PartialPicture& p) const {
        Rows rows;
        const Rect w = p.window();
        for (int y = w.y0; y < w.y1; ++y) {
            std::string row;
            for (int x = w.x0; x < w.x1; ++x) {
                const bool traced = p.state(x, y) == PartialPicture::traced;
                const bool none = p.surface(x, y) == PartialPicture::kNothing;
                char c = none ? '.' : char(p.surface(x, y));
                if (traced) c = none ? '*' : char(c - 'a' + 'A');
                row += p.state(x, y) == PartialPicture::unknown ? '?' : c;
            }
            rows.push_back(row);
        }
        return rows;
    }
    [[nodiscard]] Rows shown(Refine how, const RefineParams& by, const Mask& wanted = {}) const {
        return shown(refined(how, by, wanted));
    }

private:
    Rows rows_;
    Vec2i corner_;
};

RefineParams blocks(int macro_px, int threshold_px = 1) {
    RefineParams by;
    by.macro_px = macro_px, by.threshold_px = threshold_px;
    return by;
}

const Drawn kEven({"aaaaaaaa", "aaaaaaaa", "aaaaaaaa", "aaaaaaaa", "aaaaaaaa", "aaaaaaaa", "aaaaaaaa", "aaaaaaaa"});
const Drawn kCorner({"aaaaaaaa", "aaaaaaaa", "aaaaaaaa", "aaaaaaaa", "aaaaaaaa", "aaaaaaaa", "aaaaaaab", "aaaaaabb"});

void expect_planes(const PartialPicture& p, char surface) {
    const Rect w = p.window();
    for (int y = w.y0; y < w.y1; ++y)
        for (int x = w.x0; x < w.x1; ++x) {
            const Vec4f want = Drawn::color(x, y), c = p.color(x, y);
            EXPECT_NEAR(c.x, want.x, 1e-6) << x << ',' << y;
            EXPECT_NEAR(c.y, want.y, 1e-6) << x << ',' << y;
            EXPECT_NEAR(c.z, want.z, 1e-6) << x << ',' << y;
            EXPECT_NEAR(c.w, want.w, 1e-6) << x << ',' << y;
            EXPECT_NEAR(p.ids.depth(x, y), Drawn::depth(x, y), 1e-5) << x << ',' << y;
            EXPECT_EQ(p.ids.id(x, y), PartId(std::uint32_t(surface)));
        }
}

TEST(Paper1, TracesHighLeftPixelsAndTheLastOnesAtTheBorder) {
    EXPECT_EQ(kEven.shown(Refine::paper1, blocks(4)),
              (Rows{"AaaaAaaA", "aaaaaaaa", "aaaaaaaa", "aaaaaaaa", "AaaaAaaA", "aaaaaaaa", "aaaaaaaa", "AaaaAaaA"}));
}

TEST(Paper1, InterpolatesLinearly) {
    expect_planes(kEven.refined(Refine::paper1, blocks(4)), 'a');
    expect_planes(kEven.refined(Refine::paper1, blocks(8)), 'a');
}

TEST(Paper1, ComparesWithTheNeighboursRightBelowAndBelowRight) {
    // b is the high left pixel of a block: all four that meet there subdivide, and of the blocks of 2
    // the four around it once more.
    const Drawn drawn({"aaaaaaaa", "aaaaaaaa", "aaaaaaaa", "aaaaaaaa", "aaaabaaa", "aaaaaaaa", "aaaaaaaa", "aaaaaaaa"});
    EXPECT_EQ(drawn.shown(Refine::paper1, blocks(4)),
              (Rows{"AaAaAaAA", "aaaaaaaa", "AaAAAAAA", "aaAAAAaa", "AaAABAAA", "aaAAAAaa", "AaAaAaAA", "AaAaAaAA"}));
}

TEST(Paper1, MissesWhatNoHighLeftPixelMeets) {
    const Drawn drawn({"aaaa", "abba", "abba", "aaaa"});
    EXPECT_EQ(drawn.shown(Refine::paper1, blocks(4)), (Rows{"AaaA", "aaaa", "aaaa", "AaaA"}));
    EXPECT_EQ(drawn.shown(Refine::paper1, blocks(2)), (Rows{"AAAA", "ABBA", "ABBA", "AAAA"}));
}

TEST(Paper1, StopsAtTheThreshold) {
    const Drawn drawn({"aabb", "aabb", "aabb", "aabb"});
    // Blocks of 2 that differ show what their high left pixel sees.
    const PartialPicture p = drawn.refined(Refine::paper1, blocks(4, 2));
    EXPECT_EQ(drawn.shown(p), (Rows{"AaBB", "aabb", "AaBB", "AaBB"}));
    EXPECT_EQ(p.color(1, 1).x, Drawn::color(0, 0).x);
    EXPECT_EQ(p.ids.depth(1, 1), Drawn::depth(0, 0));
    // Those that do not are interpolated still.
    EXPECT_NEAR(p.color(3, 1).y, Drawn::color(3, 1).y, 1e-6);
}

TEST(Paper1, TracesEveryPixelWhenMacroPixelsArePixels) {
    for (const Refine how : {Refine::paper1, Refine::paper2})
        for (const std::string& row : kCorner.shown(how, blocks(1)))
            EXPECT_EQ(row.find_first_of("abc?"), std::string::npos) << row;
}

TEST(Paper1, InfersNothingWhereNothingIsHit) {
    const Drawn drawn({"....", "....", "....", "...."});
    const PartialPicture p = drawn.refined(Refine::paper1, blocks(4));
    EXPECT_EQ(drawn.shown(p), (Rows{"*..*", "....", "....", "*..*"}));
    EXPECT_EQ(p.ids.id(1, 1), kNoPart);
    EXPECT_EQ(p.ids.depth(1, 1), kInfinity);
    EXPECT_EQ(p.color(1, 1).w, 0);
}

TEST(Paper1, ClipsMacroPixelsToTheWindow) {
    // Macro pixels lie at multiples of 4 wherever the window begins.
    const Drawn drawn({"aaaaa", "aaaaa", "aaaaa"}, {-2, 3});
    EXPECT_EQ(drawn.shown(Refine::paper1, blocks(4)), (Rows{"AaAaA", "AaAaA", "AaAaA"}));
    expect_planes(drawn.refined(Refine::paper1, blocks(4)), 'a');
}

TEST(Paper1, LeavesOutBlocksThatAreNotWanted) {
    Mask wanted(kEven.window(), 0);
    wanted(5, 1) = 1;
    EXPECT_EQ(kEven.shown(Refine::paper1, blocks(4), wanted),
              (Rows{"????AaaA", "????aaaa", "????aaaa", "????aaaa", "????A??A", "????????", "????????", "????????"}));
}

TEST(Paper2, TracesTheFourCorners) {
    EXPECT_EQ(kEven.shown(Refine::paper2, blocks(4)),
              (Rows{"AaaAAaaA", "aaaaaaaa", "aaaaaaaa", "AaaAAaaA", "AaaAAaaA", "aaaaaaaa", "aaaaaaaa", "AaaAAaaA"}));
    expect_planes(kEven.refined(Refine::paper2, blocks(4)), 'a');
}

TEST(Paper2, SubdividesWhereGuidesDiffer) {
    EXPECT_EQ(kCorner.shown(Refine::paper2, blocks(8)),
              (Rows{"AaaAAaaA", "aaaaaaaa", "aaaaaaaa", "AaaAAaaA", "AaaAAAAA", "aaaaAAAA", "aaaaAAAB", "AaaAAABB"}));
}

TEST(Paper2, TakesTheNearestGuideAtTheThreshold) {
    const Drawn drawn({"aaaa", "aaab", "aaab", "bbbb"});
    EXPECT_EQ(drawn.shown(Refine::paper2, blocks(4, 4)), (Rows{"AaaA", "aaaa", "bbbb", "BbbB"}));
}

TEST(Paper2, LaysAPlaneThroughOtherGuides) {
    RefineParams by = blocks(8);
    by.guides = {{0, 0}, {1, 0.5f}, {0.25f, 1}};
    const PartialPicture p = kEven.refined(Refine::paper2, by);
    EXPECT_EQ(kEven.shown(p),
              (Rows{"Aaaaaaaa", "aaaaaaaa", "aaaaaaaa", "aaaaaaaa", "aaaaaaaA", "aaaaaaaa", "aaaaaaaa", "aaAaaaaa"}));
    expect_planes(p, 'a');
}

TEST(Paper2, FitsThePlaneByLeastSquares) {
    // The centre is brighter than the corners: the plane lies a fifth of that above them.
    const Rows rows(5, "aaaaa");
    const Drawn drawn(rows);
    RefineParams by = blocks(8);
    by.guides = {{0, 0}, {1, 0}, {0, 1}, {1, 1}, {0.5f, 0.5f}};
    PartialPicture p(drawn.window());
    infer_pixels(Refine::paper2, by, {}, p, [](PartialPicture& picture, std::span<const Vec2i> pixels) {
        for (const Vec2i at : pixels) {
            picture.surface(at.x, at.y) = 'a';
            const float v = at == Vec2i{2, 2} ? 0.7f : 0.2f;
            picture.color(at.x, at.y) = {v, 0, 0, 1};
        }
    });
    EXPECT_NEAR(p.color(1, 0).x, 0.3f, 1e-6);
    EXPECT_NEAR(p.color(3, 2).x, 0.3f, 1e-6);
    EXPECT_FLOAT_EQ(p.color(2, 2).x, 0.7f);
    EXPECT_FLOAT_EQ(p.color(4, 4).x, 0.2f);
}

TEST(Paper2, TakesTheMeanWhereGuidesFallOnOneLine) {
    const Drawn drawn({"aaaa"});
    RefineParams by = blocks(4);
    by.guides = {{0, 0}, {1, 0}, {0, 1}};
    const PartialPicture p = drawn.refined(Refine::paper2, by);
    EXPECT_EQ(drawn.shown(p), (Rows{"AaaA"}));
    EXPECT_NEAR(p.color(1, 0).x, (2 * Drawn::color(0, 0).x + Drawn::color(3, 0).x) / 3, 1e-6);
}

TEST(Expansion, GrowsFromTheBlocksThatTheSamplingHits) {
    // The first sampling, at the centres of blocks of 2, meets the bar's middle alone.
    const Drawn drawn({"........", "..aaaa..", "...a....", "........", "........", "........", "........", "......a."});
    // Every block beside one that holds something is traced, round after round. What lies apart and
    // is not sampled is missed, as the paper warns.
    EXPECT_EQ(drawn.shown(Refine::expansion, blocks(2)),
              (Rows{"********", "**AAAA**", "***A****", "********", "******..", "******.*", "........", ".*.*.*.*"}));
}

TEST(Expansion, FindsAllWhenEveryPixelIsSampled) {
    const Drawn drawn({"a...", "....", "....", "...a"});
    EXPECT_EQ(drawn.shown(Refine::expansion, blocks(1)), (Rows{"A***", "****", "****", "***A"}));
}

} // namespace
} // namespace porthole
