#include "porthole/hole/floor.h"

#include <algorithm>
#include <numeric>

#include "porthole/hole/distance.h"

namespace porthole {
namespace {

/// Per row of a box, the next pixel to the right that is not painted yet: disjoint sets whose
/// representative is that pixel (one past the row when there is none).
class Unpainted {
public:
    explicit Unpainted(Rect box) : box_(box), next_(Rect{box.x0, box.y0, box.x1 + 1, box.y1}) {
        for (std::int32_t y = box.y0; y < box.y1; ++y) {
            std::int32_t* row = next_.row(y);
            std::iota(row, row + box.width() + 1, box.x0);
        }
    }
    [[nodiscard]] std::int32_t next(std::int32_t x, std::int32_t y) {
        std::int32_t* row = next_.row(y) - box_.x0;
        while (row[x] != x) x = row[x] = row[row[x]]; // path halving
        return x;
    }
    void paint(std::int32_t x, std::int32_t y) { next_(x, y) = x + 1; }

private:
    Rect box_;
    Image<std::int32_t> next_;
};

/// Sums over every run of 2 radius + 1 entries: out[i] = in[i - radius] + ... + in[i + radius].
///
/// Running sums would carry the rounding of everything left of a pixel along. Instead the line
/// is cut into blocks as long as a run, at absolute positions; a run is the end of one block
/// and the start of the next, summed from the cut outwards (van Herk, 1992). Rows of `lanes`
/// entries are summed side by side.
class RunSums {
public:
    /// @param origin absolute position of line 0.
    RunSums(std::int32_t lines, std::int32_t origin, int radius, std::size_t lanes)
        : lines_(lines), origin_(origin), radius_(radius), length_(2 * radius + 1), lanes_(lanes),
          ends_(std::size_t(length_) * lanes), start_(lanes) {}

    /// read(i) gives the lanes of line i in [0, lines); write(i, ends, start) is called for each
    /// line in turn, whose sums are ends[lane] + start[lane].
    template <typename Read, typename Write> void run(const Read& read, const Write& write) {
        const auto add = [&](double* sum, std::int32_t line) {
            if (line < 0 || line >= lines_) return;
            const double* in = read(line);
            for (std::size_t k = 0; k < lanes_; ++k) sum[k] += in[k];
        };
        const std::int32_t past = (origin_ - radius_) % length_;
        const std::int32_t first_block = -radius_ - (past < 0 ? past + length_ : past);
        for (std::int32_t block = first_block; block < lines_ - radius_; block += length_) {
            std::fill(ends_.begin(), ends_.end(), 0.0);
            for (std::int32_t o = length_ - 1; o >= 0; --o) {
                double* sum = ends_.data() + std::size_t(o) * lanes_;
                if (o + 1 < length_) std::copy(sum + lanes_, sum + 2 * lanes_, sum);
                add(sum, block + o);
            }
            std::fill(start_.begin(), start_.end(), 0.0);
            for (std::int32_t o = 0; o < length_; ++o) {
                if (o > 0) add(start_.data(), block + length_ + o - 1);
                const std::int32_t line = block + o + radius_;
                if (line >= 0 && line < lines_) write(line, ends_.data() + std::size_t(o) * lanes_, start_.data());
            }
        }
    }

private:
    std::int32_t lines_, origin_;
    int radius_;
    std::int32_t length_;
    std::size_t lanes_;
    std::vector<double> ends_, start_;
};

/// Sums of `values` over squares of 2 radius + 1 pixels, zero beyond the window.
Image<double> square_sums(Image<double> values, int radius) {
    const Rect w = values.window();
    constexpr std::int32_t kLanes = 8;
    // Across: eight rows at a time, side by side.
    RunSums across(w.width(), w.x0, radius, kLanes);
    std::vector<double> turned(std::size_t(w.width()) * kLanes);
    for (std::int32_t y = w.y0; y < w.y1; y += kLanes) {
        const std::int32_t rows = std::min(kLanes, w.y1 - y);
        for (std::int32_t k = 0; k < kLanes; ++k) {
            const double* in = values.row(y + std::min(k, rows - 1));
            for (std::int32_t x = 0; x < w.width(); ++x) turned[std::size_t(x) * kLanes + std::size_t(k)] = in[x];
        }
        across.run([&](std::int32_t x) { return turned.data() + std::size_t(x) * kLanes; },
                   [&](std::int32_t x, const double* ends, const double* start) {
                       for (std::int32_t k = 0; k < rows; ++k) values.row(y + k)[x] = ends[k] + start[k];
                   });
    }
    // Down: whole rows side by side.
    Image<double> result(w);
    RunSums down(w.height(), w.y0, radius, std::size_t(w.width()));
    down.run([&](std::int32_t y) { return values.row(w.y0 + y); },
             [&](std::int32_t y, const double* ends, const double* start) {
                 double* out = result.row(w.y0 + y);
                 for (std::int32_t x = 0; x < w.width(); ++x) out[x] = ends[x] + start[x];
             });
    return result;
}

} // namespace

Image<float> paint_floor(Image<float> depth, const Image<PartId>& targets, std::vector<FloorDisc> discs,
                         std::int64_t scale, Rect box) {
    // Deepest first, so that the first disc to reach a pixel is the one that counts.
    std::sort(discs.begin(), discs.end(), [](const FloorDisc& a, const FloorDisc& b) { return a.depth > b.depth; });
    Unpainted unpainted(box);
    for (const FloorDisc& disc : discs) {
        const std::int64_t radius2 = disc.weight / scale;
        const auto radius = std::int32_t(integer_sqrt(radius2));
        const std::int32_t y0 = std::max(disc.center.y - radius, box.y0),
                           y1 = std::min(disc.center.y + radius + 1, box.y1);
        for (std::int32_t y = y0; y < y1; ++y) {
            const std::int64_t dy = y - disc.center.y;
            const auto half = std::int32_t(integer_sqrt(radius2 - dy * dy));
            const std::int32_t x1 = std::min(disc.center.x + half + 1, box.x1);
            float* row = depth.row(y) - depth.window().x0;
            const PartId* target = targets.row(y) - targets.window().x0;
            for (std::int32_t x = std::max(disc.center.x - half, box.x0); (x = unpainted.next(x, y)) < x1;) {
                if (target[x] == kNoPart) row[x] = disc.depth;
                unpainted.paint(x, y);
            }
        }
    }
    return depth;
}

Image<float> blur_floor(Image<float> depth, const Mask& mask, const Image<PartId>& targets, Rect box, int radius,
                        int times) {
    if (radius == 0 || box.empty()) return depth;
    const Rect read = box.grown(radius).intersected(depth.window());
    const auto for_each_pixel = [](Rect r, const auto& f) {
        for (std::int32_t y = r.y0; y < r.y1; ++y)
            for (std::int32_t x = r.x0; x < r.x1; ++x) f(x, y);
    };
    Image<double> values(read);
    for_each_pixel(read, [&](std::int32_t x, std::int32_t y) { values(x, y) = mask(x, y) ? 1.0 : 0.0; });
    const Image<double> counts = square_sums(values, radius);
    for (; times > 0; --times) {
        for_each_pixel(read,
                       [&](std::int32_t x, std::int32_t y) { values(x, y) = mask(x, y) ? double(depth(x, y)) : 0.0; });
        const Image<double> sums = square_sums(values, radius);
        for_each_pixel(box, [&](std::int32_t x, std::int32_t y) {
            if (mask(x, y) && targets(x, y) == kNoPart) depth(x, y) = float(sums(x, y) / counts(x, y));
        });
    }
    return depth;
}

} // namespace porthole
