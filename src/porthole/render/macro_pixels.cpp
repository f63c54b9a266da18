#include "porthole/render/macro_pixels.h"

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>
#include <vector>

namespace porthole {

namespace {

using State = PartialPicture::State;

/// What is inferred of a pixel besides its surface: colour and depth.
using Channels = std::array<double, 5>;

Channels weighted(const Channels& a, double wa, const Channels& b, double wb) {
    Channels sum;
    for (std::size_t c = 0; c < sum.size(); ++c) sum[c] = a[c] * wa + b[c] * wb;
    return sum;
}

/// Colour and depth over the pixels of a block: least squares through some of them.
class Plane {
public:
    Plane(const std::vector<Vec2i>& at, const std::vector<Channels>& values) {
        const auto n = std::int64_t(at.size());
        std::int64_t sum_x = 0, sum_y = 0;
        for (const Vec2i p : at) sum_x += p.x, sum_y += p.y;
        mean_x_ = double(sum_x) / double(n), mean_y_ = double(sum_y) / double(n);
        // In whole numbers, n times too large, so that guides on one line are known for sure.
        std::int64_t xx = 0, xy = 0, yy = 0;
        Channels vx{}, vy{};
        for (std::size_t i = 0; i < at.size(); ++i) {
            const std::int64_t x = n * at[i].x - sum_x, y = n * at[i].y - sum_y;
            xx += x * x, xy += x * y, yy += y * y;
            mean_ = weighted(mean_, 1, values[i], 1.0 / double(n));
            vx = weighted(vx, 1, values[i], double(x));
            vy = weighted(vy, 1, values[i], double(y));
        }
        const std::int64_t det = xx * yy - xy * xy;
        if (det == 0) return;
        const double scale = double(n) / double(det);
        slope_x_ = weighted(vx, scale * double(yy), vy, -scale * double(xy));
        slope_y_ = weighted(vy, scale * double(xx), vx, -scale * double(xy));
    }
    [[nodiscard]] Channels at(int x, int y) const {
        const Channels slope = weighted(slope_x_, double(x) - mean_x_, slope_y_, double(y) - mean_y_);
        return weighted(mean_, 1, slope, 1);
    }

private:
    double mean_x_ = 0, mean_y_ = 0;
    Channels mean_{}, slope_x_{}, slope_y_{};
};

class Inference {
public:
    Inference(const RefineParams& by, const Mask& wanted, PartialPicture& picture, const TracePixels& trace)
        : by_(by), wanted_(wanted), picture_(picture), trace_(trace), window_(picture.window()) {}

    void paper1() {
        for (std::vector<Block> blocks = macro_pixels(); !blocks.empty(); blocks = std::move(smaller_)) {
            for (const Block& b : blocks)
                for (const Vec2i p : high_left_pixels(b)) ask(p);
            trace_asked();
            smaller_.clear();
            for (const Block& b : blocks) {
                const std::array<Vec2i, 4> corners = high_left_pixels(b);
                if (see_the_same(corners))
                    interpolate(b, corners);
                else if (!subdivide(b))
                    for_each_open(b, [&](Vec2i p) { copy(corners[0], p); });
            }
        }
    }

    void paper2() {
        static const std::vector<Vec2f> kCorners = RefineParams{}.guides;
        const bool corners =
            std::is_permutation(by_.guides.begin(), by_.guides.end(), kCorners.begin(), kCorners.end());
        for (std::vector<Block> blocks = macro_pixels(); !blocks.empty(); blocks = std::move(smaller_)) {
            for (const Block& b : blocks)
                for (const Vec2i p : guide_pixels(b)) ask(p);
            trace_asked();
            smaller_.clear();
            for (const Block& b : blocks) {
                const std::vector<Vec2i> guides = guide_pixels(b);
                if (!see_the_same(guides)) {
                    if (subdivide(b)) continue;
                    for_each_open(b, [&](Vec2i p) { copy(nearest(guides, p), p); });
                } else if (corners) {
                    const Rect r = inside(b);
                    interpolate(b, {Vec2i{r.x0, r.y0}, {r.x1 - 1, r.y0}, {r.x0, r.y1 - 1}, {r.x1 - 1, r.y1 - 1}});
                } else {
                    lay_plane(b, guides);
                }
            }
        }
    }

    void expansion() {
        const std::vector<Block> blocks = macro_pixels();
        const int size = by_.macro_px;
        const auto cell = [&](const Block& b) { return Vec2i{b.x / size, b.y / size}; };
        // One more cell around, so that every block has eight neighbours.
        const Rect cells = Rect{floor_div(window_.x0, size), floor_div(window_.y0, size),
                                floor_div(window_.x1 - 1, size) + 1, floor_div(window_.y1 - 1, size) + 1}
                               .grown(1);
        Mask waits(cells, 0);
        std::vector<Block> next;
        for (const Block& b : blocks) ask(sampled(b));
        trace_asked();
        for (const Block& b : blocks) {
            const bool hit = hits(sampled(b));
            waits(cell(b).x, cell(b).y) = !hit;
            if (hit) next.push_back(b);
        }
        while (!next.empty()) {
            const std::vector<Block> now = std::move(next);
            next.clear();
            for (const Block& b : now) for_each(b, [&](Vec2i p) { ask(p); });
            trace_asked();
            for (const Block& b : now) {
                bool any = false;
                for_each(b, [&](Vec2i p) { any |= hits(p); });
                if (!any) continue;
                for (int dy = -1; dy <= 1; ++dy)
                    for (int dx = -1; dx <= 1; ++dx) {
                        std::uint8_t& waiting = waits(cell(b).x + dx, cell(b).y + dy);
                        if (waiting) next.push_back({b.x + dx * size, b.y + dy * size, size});
                        waiting = 0;
                    }
            }
        }
        for (const Block& b : blocks) for_each_open(b, [&](Vec2i p) { copy(sampled(b), p); });
    }

private:
    struct Block {
        int x = 0, y = 0; ///< may lie left of or above the window
        int size = 1;
    };

    static int floor_div(int a, int b) { return a >= 0 ? a / b : -((-a + b - 1) / b); }
    [[nodiscard]] Rect inside(const Block& b) const {
        return Rect{b.x, b.y, b.x + b.size, b.y + b.size}.intersected(window_);
    }
    template <typename Visit> void for_each(const Block& b, Visit&& visit) const {
        const Rect r = inside(b);
        for (int y = r.y0; y < r.y1; ++y)
            for (int x = r.x0; x < r.x1; ++x) visit(Vec2i{x, y});
    }
    /// The block's pixels that are not traced.
    template <typename Visit> void for_each_open(const Block& b, Visit&& visit) const {
        for_each(b, [&](Vec2i p) {
            if (picture_.state(p.x, p.y) != State::traced) visit(p);
        });
    }
    [[nodiscard]] bool is_wanted(const Block& b) const {
        bool any = false;
        const Rect r = inside(b);
        if (r.empty() || wanted_.empty()) return !r.empty();
        for (int y = r.y0; y < r.y1 && !any; ++y)
            for (int x = r.x0; x < r.x1 && !any; ++x) any = wanted_(x, y) != 0;
        return any;
    }
    [[nodiscard]] std::vector<Block> macro_pixels() const {
        std::vector<Block> blocks;
        const int size = by_.macro_px;
        for (int y = floor_div(window_.y0, size) * size; y < window_.y1; y += size)
            for (int x = floor_div(window_.x0, size) * size; x < window_.x1; x += size)
                if (is_wanted({x, y, size})) blocks.push_back({x, y, size});
        return blocks;
    }
    bool subdivide(const Block& b) {
        if (b.size <= by_.threshold_px) return false;
        const int half = b.size / 2;
        for (const Vec2i d : {Vec2i{0, 0}, {half, 0}, {0, half}, {half, half}})
            if (const Block sub{b.x + d.x, b.y + d.y, half}; is_wanted(sub)) smaller_.push_back(sub);
        return true;
    }

    /// Of the block and of its neighbours to the right, below, and below to the right; beyond the
    /// window the last pixel inside stands in.
    [[nodiscard]] std::array<Vec2i, 4> high_left_pixels(const Block& b) const {
        const auto clipped = [&](int x, int y) {
            return Vec2i{std::clamp(x, window_.x0, window_.x1 - 1), std::clamp(y, window_.y0, window_.y1 - 1)};
        };
        const Vec2i own = clipped(b.x, b.y);
        if (b.size == 1) return {own, own, own, own}; // nothing is left to infer
        return {own, clipped(b.x + b.size, b.y), clipped(b.x, b.y + b.size), clipped(b.x + b.size, b.y + b.size)};
    }
    [[nodiscard]] std::vector<Vec2i> guide_pixels(const Block& b) const {
        const Rect r = inside(b);
        std::vector<Vec2i> pixels;
        for (const Vec2f g : by_.guides)
            pixels.push_back({r.x0 + int(std::lround(g.x * float(r.width() - 1))),
                              r.y0 + int(std::lround(g.y * float(r.height() - 1)))});
        return pixels;
    }
    [[nodiscard]] Vec2i sampled(const Block& b) const {
        const Rect r = inside(b);
        return {(r.x0 + r.x1) / 2, (r.y0 + r.y1) / 2};
    }
    static Vec2i nearest(const std::vector<Vec2i>& guides, Vec2i p) {
        return *std::min_element(guides.begin(), guides.end(), [&](Vec2i a, Vec2i b) {
            const auto squared = [&](Vec2i g) { return (g.x - p.x) * (g.x - p.x) + (g.y - p.y) * (g.y - p.y); };
            return squared(a) < squared(b);
        });
    }

    void ask(Vec2i p) {
        if (picture_.state(p.x, p.y) == State::traced) return;
        picture_.state(p.x, p.y) = State::traced;
        asked_.push_back(p);
    }
    void trace_asked() {
        if (!asked_.empty()) trace_(picture_, asked_);
        asked_.clear();
    }

    [[nodiscard]] bool hits(Vec2i p) const { return picture_.surface(p.x, p.y) != PartialPicture::kNothing; }
    template <typename Pixels> [[nodiscard]] bool see_the_same(const Pixels& pixels) const {
        return std::all_of(pixels.begin(), pixels.end(), [&](Vec2i p) {
            return picture_.surface(p.x, p.y) == picture_.surface(pixels[0].x, pixels[0].y);
        });
    }
    [[nodiscard]] Channels channels(Vec2i p) const {
        const Vec4f c = picture_.color(p.x, p.y);
        // Where nothing is hit there is no depth to interpolate.
        return {c.x, c.y, c.z, c.w, hits(p) ? picture_.ids.depth(p.x, p.y) : 0.0f};
    }
    void infer(Vec2i p, Vec2i from, const Channels& v) {
        picture_.state(p.x, p.y) = State::inferred;
        picture_.surface(p.x, p.y) = picture_.surface(from.x, from.y);
        picture_.ids.id(p.x, p.y) = picture_.ids.id(from.x, from.y);
        picture_.ids.depth(p.x, p.y) = hits(from) ? float(v[4]) : kInfinity;
        const auto channel = [](double c) { return clamp01(float(c)); };
        picture_.color(p.x, p.y) = {channel(v[0]), channel(v[1]), channel(v[2]), channel(v[3])};
    }
    void copy(Vec2i from, Vec2i p) { infer(p, from, channels(from)); }
    /// @param corners  up left, up right, down left, down right.
    void interpolate(const Block& b, const std::array<Vec2i, 4>& corners) {
        std::array<Channels, 4> v;
        for (std::size_t i = 0; i < 4; ++i) v[i] = channels(corners[i]);
        const Vec2i first = corners[0], last = corners[3];
        const auto share = [](int a, int from, int to) { return to > from ? double(a - from) / double(to - from) : 0; };
        for_each_open(b, [&](Vec2i p) {
            const double x = share(p.x, first.x, last.x), y = share(p.y, first.y, last.y);
            infer(p, first, weighted(weighted(v[0], 1 - x, v[1], x), 1 - y, weighted(v[2], 1 - x, v[3], x), y));
        });
    }
    void lay_plane(const Block& b, const std::vector<Vec2i>& guides) {
        std::vector<Channels> values;
        for (const Vec2i g : guides) values.push_back(channels(g));
        const Plane plane(guides, values);
        for_each_open(b, [&](Vec2i p) { infer(p, guides[0], plane.at(p.x, p.y)); });
    }

    const RefineParams& by_;
    const Mask& wanted_;
    PartialPicture& picture_;
    const TracePixels& trace_;
    Rect window_;
    std::vector<Vec2i> asked_;
    std::vector<Block> smaller_; ///< to be decided next
};

} // namespace

void infer_pixels(Refine how, const RefineParams& by, const Mask& wanted, PartialPicture& picture,
                  const TracePixels& trace) {
    assert(wanted.empty() || wanted.window() == picture.window());
    Inference inference(by, wanted, picture, trace);
    if (how == Refine::paper1) inference.paper1();
    if (how == Refine::paper2) inference.paper2();
    if (how == Refine::expansion) inference.expansion();
}

} // namespace porthole
