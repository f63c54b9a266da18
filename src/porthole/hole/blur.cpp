#include "porthole/hole/blur.h"

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

namespace porthole {
namespace {

/// Where runs of 2 radius + 1 pixels are cut. Running sums would carry the rounding of all that
/// lies before a run along. Instead the line is cut into blocks as long as a run, at absolute
/// positions; a run is the end of one block and the start of the next, each summed from the
/// cut outwards (van Herk, 1992), so that its sum depends on its own entries only.
struct Runs {
    explicit Runs(int r) : radius(r), length(2 * r + 1) {}
    int radius;
    std::int32_t length;
    /// Place of absolute position p within its block.
    [[nodiscard]] std::int32_t place(std::int32_t p) const {
        const std::int32_t r = p % length;
        return r < 0 ? r + length : r;
    }
};

/// out[i] = sum of value(i - radius) .. value(i + radius), i in [0, n); zero beyond.
class RowSums {
public:
    RowSums(Runs runs, std::int32_t n, std::int32_t origin)
        : runs_(runs), n_(n), origin_(origin), in_(padded(), 0.0), ends_(padded()), starts_(padded()) {}

    template <typename Value> void sum(const Value& value, double* out) {
        double* middle = in_.data() + runs_.radius;
        for (std::int32_t i = 0; i < n_; ++i) middle[i] = value(i);

        const std::int32_t first = origin_ - runs_.radius; // absolute position of in_[0]
        std::int32_t place = runs_.place(first);
        double sum = 0;
        for (std::size_t i = 0; i < in_.size(); ++i) {
            sum = place == 0 ? in_[i] : sum + in_[i];
            starts_[i] = sum;
            place = place + 1 == runs_.length ? 0 : place + 1;
        }
        sum = 0;
        for (std::size_t i = in_.size(); i-- > 0;) {
            place = place == 0 ? runs_.length - 1 : place - 1;
            sum = place + 1 == runs_.length ? in_[i] : sum + in_[i];
            ends_[i] = sum;
        }
        for (std::int32_t i = 0; i < n_; ++i) {
            out[i] =
                place == 0 ? ends_[std::size_t(i)] : ends_[std::size_t(i)] + starts_[std::size_t(i + 2 * runs_.radius)];
            place = place + 1 == runs_.length ? 0 : place + 1;
        }
    }

private:
    [[nodiscard]] std::size_t padded() const { return std::size_t(n_ + 2 * runs_.radius); }
    Runs runs_;
    std::int32_t n_, origin_;
    std::vector<double> in_, ends_, starts_;
};

/// Sums of lines of `width` entries over runs of lines, side by side. read(i) gives line i in
/// [0, lines); write(i, ends, starts) is called for each i in turn, whose sums are
/// ends[x] + starts[x]. No line up to i + radius is first read after that.
template <typename Read, typename Write> void sum_lines(Runs runs, std::int32_t lines, std::int32_t origin,
                                                        std::size_t width, const Read& read, const Write& write) {
    std::vector<double> ends(std::size_t(runs.length) * width), starts(width);
    const auto add = [&](double* sum, std::int32_t line) {
        if (line < 0 || line >= lines) return;
        const double* in = read(line);
        for (std::size_t x = 0; x < width; ++x) sum[x] += in[x];
    };
    for (std::int32_t block = -runs.radius - runs.place(origin - runs.radius); block < lines - runs.radius;
         block += runs.length) {
        std::fill(ends.begin(), ends.end(), 0.0);
        for (std::int32_t o = runs.length - 1; o >= 0; --o) {
            double* sum = ends.data() + std::size_t(o) * width;
            if (o + 1 < runs.length) std::copy(sum + width, sum + 2 * width, sum);
            add(sum, block + o);
        }
        std::fill(starts.begin(), starts.end(), 0.0);
        for (std::int32_t o = 0; o < runs.length; ++o) {
            if (o > 0) add(starts.data(), block + runs.length + o - 1);
            const std::int32_t line = block + o + runs.radius;
            if (line >= 0 && line < lines) write(line, ends.data() + std::size_t(o) * width, starts.data());
        }
    }
}

/// How many pixels of `mask` lie in the square of 2 radius + 1 pixels around each pixel of `box`.
Image<std::int32_t> square_counts(const Mask& mask, Rect box, int radius) {
    const Rect read = box.grown(radius).intersected(mask.window());
    const auto width = std::size_t(box.width());
    Image<std::int32_t> counts(box);
    std::vector<std::int32_t> column(std::size_t(read.width())); // over the rows of the square
    const auto add_row = [&](std::int32_t y, std::int32_t sign) {
        if (y < read.y0 || y >= read.y1) return;
        const std::uint8_t* row = mask.row(y) + (read.x0 - mask.window().x0);
        for (std::size_t x = 0; x < column.size(); ++x) column[x] += sign * row[x];
    };
    for (std::int32_t y = box.y0 - radius; y < box.y0 + radius; ++y) add_row(y, 1);
    for (std::int32_t y = box.y0; y < box.y1; ++y) {
        add_row(y + radius, 1);
        add_row(y - radius - 1, -1);
        const auto at = [&](std::int32_t x) {
            return x < read.x0 || x >= read.x1 ? 0 : column[std::size_t(x - read.x0)];
        };
        std::int32_t sum = 0;
        for (std::int32_t x = box.x0 - radius; x < box.x0 + radius; ++x) sum += at(x);
        std::int32_t* out = counts.row(y);
        for (std::size_t i = 0; i < width; ++i) {
            const std::int32_t x = box.x0 + std::int32_t(i);
            sum += at(x + radius) - at(x - radius - 1);
            out[i] = sum;
        }
    }
    return counts;
}

/// Sums over squares of 2 radius + 1 pixels of sums over such squares, of what value(x, y) is in
/// `read`; zero beyond. Exact to the last bit in the same way as Runs.
template <typename Value> Image<double> sum_squares_twice(Rect read, int radius, const Value& value) {
    const Runs runs(radius);
    const auto width = std::size_t(read.width());
    Image<double> sums(read), lines(read);
    RowSums row_sums(runs, read.width(), read.x0);
    std::vector<double> once(width);
    for (std::int32_t y = read.y0; y < read.y1; ++y) {
        row_sums.sum([&](std::int32_t i) { return value(read.x0 + i, y); }, once.data());
        row_sums.sum([&](std::int32_t i) { return once[std::size_t(i)]; }, sums.row(y));
    }
    const auto add_lines = [&](const Image<double>* from, Image<double>* to) {
        const auto read_line = [&](std::int32_t line) { return static_cast<const double*>(from->row(read.y0 + line)); };
        const auto write_line = [&](std::int32_t line, const double* ends, const double* starts) {
            double* out = to->row(read.y0 + line);
            for (std::size_t x = 0; x < width; ++x) out[x] = ends[x] + starts[x];
        };
        sum_lines(runs, read.height(), read.y0, width, read_line, write_line);
    };
    add_lines(&sums, &lines);
    add_lines(&lines, &sums);
    return sums;
}

} // namespace

void smooth_over(Image<float>& map, const Mask& known, Rect box, int radius, Fit fit) {
    box = box.intersected(known.window());
    if (box.empty()) return;
    // The maps change little within a cell, so that sums over cells do.
    const int cell = radius >= 16 ? 4 : radius >= 8 ? 2 : 1;
    const int cells = std::max(1, (radius + cell / 2) / cell);
    const auto cell_of = [&](std::int32_t p) { return p >= 0 ? p / cell : -((cell - 1 - p) / cell); };
    const Rect wanted =
        Rect{cell_of(box.x0), cell_of(box.y0), cell_of(box.x1 - 1) + 1, cell_of(box.y1 - 1) + 1}.grown(1);
    const Rect read = wanted.grown(2 * cells);

    // Of each cell's known pixels: how many, and the sums of v, x, y, xx, xy, yy, xv, yv.
    constexpr int kMean = 2, kPlane = 9;
    const int moments = fit == Fit::plane ? kPlane : kMean;
    std::vector<Image<double>> sums{std::size_t(moments), Image<double>(read)};
    const Rect pixels =
        Rect{read.x0 * cell, read.y0 * cell, read.x1 * cell, read.y1 * cell}.intersected(known.window());
    for (std::int32_t y = pixels.y0; y < pixels.y1; ++y)
        for (std::int32_t x = pixels.x0; x < pixels.x1; ++x) {
            if (!known(x, y)) continue;
            const double v = map(x, y), dx = x, dy = y;
            const double terms[kPlane] = {1, v, dx, dy, dx * dx, dx * dy, dy * dy, dx * v, dy * v};
            const std::size_t at = sums[0].index(cell_of(x), cell_of(y));
            for (int m = 0; m < moments; ++m) sums[std::size_t(m)].pixels()[at] += terms[m];
        }
    for (Image<double>& s : sums)
        s = sum_squares_twice(read, cells, [&](std::int32_t x, std::int32_t y) { return s(x, y); });

    // Values at the cells' centres, then between them.
    Image<double> at_cell(wanted);
    const double ridge = 0.02 * radius * radius;
    for (std::int32_t y = wanted.y0; y < wanted.y1; ++y)
        for (std::int32_t x = wanted.x0; x < wanted.x1; ++x) {
            const auto s = [&](int m) { return sums[std::size_t(m)](x, y); };
            const double n = s(0);
            double& value = at_cell(x, y);
            value = n > 0 ? s(1) / n : double(kInfinity);
            if (!(n > 0) || fit != Fit::plane) continue;
            const double mx = s(2) / n, my = s(3) / n;
            const double xx = s(4) / n - mx * mx + ridge, xy = s(5) / n - mx * my, yy = s(6) / n - my * my + ridge;
            const double xv = s(7) / n - mx * value, yv = s(8) / n - my * value;
            const double determinant = xx * yy - xy * xy; // at least ridge^2
            if (!(determinant > 0)) continue;
            const double middle = 0.5 * (cell - 1);
            value += ((xv * yy - yv * xy) * (x * cell + middle - mx) + (yv * xx - xv * xy) * (y * cell + middle - my)) /
                     determinant;
        }
    for (std::int32_t y = box.y0; y < box.y1; ++y)
        for (std::int32_t x = box.x0; x < box.x1; ++x) {
            const double cx = (x - 0.5 * (cell - 1)) / cell, cy = (y - 0.5 * (cell - 1)) / cell;
            const auto x0 = std::int32_t(std::floor(cx)), y0 = std::int32_t(std::floor(cy));
            const double ax = cx - x0, ay = cy - y0;
            double sum = 0, weights = 0;
            for (int i = 0; i < 4; ++i) {
                const double weight = (i & 1 ? ax : 1 - ax) * (i & 2 ? ay : 1 - ay);
                const double value = at_cell(x0 + (i & 1), y0 + (i >> 1));
                if (weight > 0 && value < double(kInfinity)) sum += weight * value, weights += weight;
            }
            map(x, y) = weights > 0 ? float(sum / weights) : kInfinity;
        }
}

Image<float> blur_floor(Image<float> depth, const Mask& mask, const Image<PartId>& targets, Rect box, int radius,
                        int times) {
    if (radius == 0 || box.empty()) return depth;
    const Image<std::int32_t> counts = square_counts(mask, box, radius);
    const Rect w = depth.window(), read = box.grown(radius).intersected(w);
    const Runs runs(radius);
    const auto width = std::size_t(read.width());
    RowSums row_sums(runs, read.width(), read.x0);
    // Sums along the rows of two blocks: every row is read before it is written, once.
    const std::int32_t kept = 2 * runs.length;
    std::vector<double> across(std::size_t(kept) * width);
    for (; times > 0; --times) {
        std::int32_t ready = 0;
        const auto row = [&](std::int32_t line) { return across.data() + std::size_t(line % kept) * width; };
        const auto read_line = [&](std::int32_t line) {
            for (; ready <= line; ++ready) {
                const std::int32_t y = read.y0 + ready;
                const float* in = depth.row(y) + (read.x0 - w.x0);
                const std::uint8_t* used = mask.row(y) + (read.x0 - w.x0);
                row_sums.sum([&](std::int32_t i) { return used[i] ? double(in[i]) : 0.0; }, row(ready));
            }
            return row(line);
        };
        const auto write_line = [&](std::int32_t line, const double* ends, const double* starts) {
            const std::int32_t y = read.y0 + line;
            if (y < box.y0 || y >= box.y1) return;
            float* out = depth.row(y) - w.x0;
            const std::uint8_t* inside = mask.row(y) - w.x0;
            const PartId* target = targets.row(y) - w.x0;
            const std::int32_t* count = counts.row(y) - box.x0;
            for (std::int32_t x = box.x0; x < box.x1; ++x)
                if (inside[x] && target[x] == kNoPart)
                    out[x] = float((ends[x - read.x0] + starts[x - read.x0]) / count[x]);
        };
        sum_lines(runs, read.height(), read.y0, width, read_line, write_line);
    }
    return depth;
}

} // namespace porthole
