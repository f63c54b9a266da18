// Lines against unit shapes, and the interval arithmetic of trees of them.
#include <algorithm>
#include <array>
#include <cassert>

#include "porthole/scene/primitive.h"

namespace porthole {

namespace {

/// In multiples of the distance to the far side of a tree: surfaces nearer to each other are one.
/// Above the rounding of double, below the resolution of the float that a hit's t becomes.
constexpr double kCoincident = 1e-9;

/// A place where a line enters or leaves a unit shape; `face` is 0-based within the shape.
struct Entry {
    double t;
    std::uint32_t face;
};
/// Up to two stretches of a line inside a unit shape: entry, exit, entry, exit.
struct Stretches {
    std::array<Entry, 4> at;
    int count = 0;
    void add(Entry in, Entry out) { at[std::size_t(count++)] = in, at[std::size_t(count++)] = out; }
};

// Lines o + t d. Shapes are handed lines whose o is the point nearest to the shape's centre.

void cross_sphere(Vec3d o, Vec3d d, Stretches& out) {
    const double room = 1 - dot(o, o);
    if (!(room > 0)) return;
    const double half = std::sqrt(room / dot(d, d));
    out.add({-half, 0}, {half, 0});
}

void cross_box(Vec3d o, Vec3d d, Stretches& out) {
    Entry in{-std::numeric_limits<double>::infinity(), 0}, leave{std::numeric_limits<double>::infinity(), 0};
    for (int axis = 0; axis < 3; ++axis) {
        if (d[axis] == 0) {
            // Lines in a face's own plane belong to one of two boxes that share the face.
            if (!(o[axis] >= -1 && o[axis] < 1)) return;
            continue;
        }
        const double low = (-1 - o[axis]) / d[axis], high = (1 - o[axis]) / d[axis];
        const auto face = std::uint32_t(2 * axis);
        const Entry near = low < high ? Entry{low, face} : Entry{high, face + 1};
        const Entry far = low < high ? Entry{high, face + 1} : Entry{low, face};
        if (near.t > in.t) in = near;
        if (far.t < leave.t) leave = far;
    }
    if (in.t < leave.t) out.add(in, leave);
}

void cross_frustum(double ratio, Vec3d o, Vec3d d, Stretches& out) {
    // Between the planes of bottom and top.
    constexpr std::uint32_t kSide = 0, kBottom = 1, kTop = 2;
    Entry in{-std::numeric_limits<double>::infinity(), kSide}, leave{std::numeric_limits<double>::infinity(), kSide};
    if (d.y != 0) {
        const double low = (-1 - o.y) / d.y, high = (1 - o.y) / d.y;
        in = low < high ? Entry{low, kBottom} : Entry{high, kTop};
        leave = low < high ? Entry{high, kTop} : Entry{low, kBottom};
    } else if (!(o.y >= -1 && o.y < 1)) {
        return;
    }
    // Inside the cone: a t^2 + 2 b t + c <= 0.
    const double slope = 0.5 * (ratio - 1);
    const double r = frustum_radius(ratio, o.y), s = slope * d.y;
    const double a = d.x * d.x + d.z * d.z - s * s;
    const double b = o.x * d.x + o.z * d.z - r * s;
    const double c = o.x * o.x + o.z * o.z - r * r;
    const double discriminant = b * b - a * c;
    double first, second;
    if (a == 0) {
        if (b == 0) {
            if (!(c < 0)) return;
            out.add(in, leave);
            return;
        }
        first = second = -c / (2 * b);
    } else {
        if (!(discriminant > 0) && a > 0) return;
        const double root = std::sqrt(std::max(0.0, discriminant));
        const double q = b > 0 ? -(b + root) : root - b;
        first = q / a, second = q == 0 ? first : c / q;
        if (first > second) std::swap(first, second);
    }
    const auto keep = [](Entry& i, Entry& l, double from, double to) {
        if (from > i.t) i = {from, kSide};
        if (to < l.t) l = {to, kSide};
        return i.t < l.t;
    };
    constexpr double kEver = std::numeric_limits<double>::infinity();
    if (a > 0) {
        if (keep(in, leave, first, second)) out.add(in, leave);
        return;
    }
    // A line steeper than the side leaves one cone of the double cone for good and comes back in
    // the other. One of the two ends between bottom and top; of rounding errors at the tip, the
    // longer one counts.
    Entry in_before = in, leave_before = leave, in_after = in, leave_after = leave;
    const bool opens = a == 0 && b < 0, closes = a == 0 && b > 0;
    const bool before = !opens && keep(in_before, leave_before, -kEver, first);
    const bool after = !closes && keep(in_after, leave_after, second, kEver);
    if (before && (!after || leave_before.t - in_before.t >= leave_after.t - in_after.t))
        out.add(in_before, leave_before);
    else if (after)
        out.add(in_after, leave_after);
}

/// The zero between a and b of a function that is monotone there and changes its sign: Newton's
/// steps, halving where they would leave the interval.
template <typename F, typename D> double zero_between(const F& f, const D& derivative, double a, double b) {
    const bool rising = f(a) < 0;
    double x = 0.5 * (a + b);
    for (int i = 0; i < 200; ++i) {
        const double y = f(x);
        if (y == 0) return x;
        ((y < 0) == rising ? a : b) = x;
        const double slope = derivative(x);
        double next = x - y / slope;
        if (!(next > a && next < b)) next = 0.5 * (a + b);
        if (std::abs(next - x) <= 1e-16 || next == a || next == b) return next;
        x = next;
    }
    return x;
}

/// Points of `at`, which are in order, and the zeros of a function that is monotone between them.
template <typename F, typename D>
std::array<double, 6> with_zeros(const std::array<double, 6>& at, int& count, const F& f, const D& derivative) {
    std::array<double, 6> out;
    int n = 0;
    out[std::size_t(n++)] = at[0];
    for (int i = 0; i + 1 < count; ++i) {
        const double a = at[std::size_t(i)], b = at[std::size_t(i + 1)];
        if ((f(a) < 0) != (f(b) < 0)) out[std::size_t(n++)] = zero_between(f, derivative, a, b);
    }
    out[std::size_t(n++)] = at[std::size_t(count - 1)];
    count = n;
    return out;
}

void cross_torus(double tube, Vec3d o, Vec3d d, Stretches& out) {
    // Per unit of length from the point nearest to the centre the quartic has no cubic term:
    // (s^2 + m + 1 - tube^2)^2 = 4 (x^2 + z^2).
    const double speed = length(d);
    const Vec3d w = d / speed;
    const double m = dot(o, o);
    const double k = m + 1 - tube * tube;
    const double p = 2 * k - 4 * (1 - w.y * w.y), q = 8 * o.y * w.y, c = k * k - 4 * (m - o.y * o.y);
    const auto f = [&](double s) { return ((s * s + p) * s + q) * s + c; };
    const auto f1 = [&](double s) { return (4 * s * s + 2 * p) * s + q; };
    const auto f2 = [&](double s) { return 12 * s * s + 2 * p; };

    // All of the torus lies in a sphere and between two planes, a little wider so that the
    // quartic is not negative at the ends.
    const double room = (1 + tube) * (1 + tube) * (1 + 1e-9) - m;
    if (!(room > 0)) return;
    double low = -std::sqrt(room), high = -low;
    const double rim = tube * (1 + 1e-9);
    if (w.y != 0) {
        const double one = (-rim - o.y) / w.y, two = (rim - o.y) / w.y;
        low = std::max(low, std::min(one, two)), high = std::min(high, std::max(one, two));
    } else if (!(std::abs(o.y) < rim)) {
        return;
    }
    if (!(low < high)) return;

    // Zeros of the second derivative part the line into pieces where the first is monotone; its
    // zeros, into pieces where the quartic is.
    std::array<double, 6> at{low};
    int count = 1;
    if (p < 0) {
        const double bend = std::sqrt(-p / 6);
        for (const double s : {-bend, bend})
            if (s > low && s < high) at[std::size_t(count++)] = s;
    }
    at[std::size_t(count++)] = high;
    at = with_zeros(at, count, f1, f2);
    // Both ends are outside: rounding must not make them the inside of a torus just touched.
    std::array<double, 4> zeros{};
    int found = 0;
    const auto inside = [&](int i) { return i > 0 && i < count - 1 && f(at[std::size_t(i)]) < 0; };
    for (int i = 0; i + 1 < count && found < 4; ++i) {
        if (inside(i) == inside(i + 1)) continue;
        const double a = at[std::size_t(i)], b = at[std::size_t(i + 1)];
        zeros[std::size_t(found++)] = (f(a) < 0) != (f(b) < 0) ? zero_between(f, f1, a, b) : inside(i) ? b : a;
    }
    for (int i = 0; i + 1 < found; i += 2)
        if (zeros[std::size_t(i)] < zeros[std::size_t(i + 1)])
            out.add({zeros[std::size_t(i)] / speed, 0}, {zeros[std::size_t(i + 1)] / speed, 0});
}

/// Squared radius of a sphere around a unit shape.
double reach2(const PrimitiveLeaf& leaf) {
    switch (leaf.kind) {
    case PrimitiveKind::sphere: return 1;
    case PrimitiveKind::box: return 3;
    case PrimitiveKind::frustum: return 2;
    case PrimitiveKind::torus: break;
    }
    return (1 + leaf.ratio) * (1 + leaf.ratio);
}

void add_crossings(const PrimitiveLeaf& leaf, Vec3d origin, Vec3d direction, std::vector<PrimitiveCrossing>& out) {
    Vec3d o = leaf.leaf_from_mesh.point(origin);
    const Vec3d d = leaf.leaf_from_mesh.vector(direction);
    const double t0 = -dot(o, d) / dot(d, d);
    o = o + d * t0;
    if (!(dot(o, o) < reach2(leaf))) return;
    Stretches s;
    switch (leaf.kind) {
    case PrimitiveKind::sphere: cross_sphere(o, d, s); break;
    case PrimitiveKind::box: cross_box(o, d, s); break;
    case PrimitiveKind::frustum: cross_frustum(leaf.ratio, o, d, s); break;
    case PrimitiveKind::torus: cross_torus(leaf.ratio, o, d, s); break;
    }
    for (int i = 0; i < s.count; ++i) {
        const Entry e = s.at[std::size_t(i)];
        out.push_back({t0 + e.t, leaf.first_surface + e.face, i % 2 == 0});
    }
}

/// A stretch of a line, ready for boxes.
struct Segment {
    Vec3d origin, per_direction;
    double t0, t1;
    Segment(Vec3d o, Vec3d d, double from, double to) : origin(o), t0(from), t1(to) {
        // A finite number for lines in a box's plane: 0 times infinity would be no number.
        for (int axis = 0; axis < 3; ++axis) per_direction[axis] = std::abs(d[axis]) > 1e-300 ? 1 / d[axis] : 1e300;
    }
    [[nodiscard]] bool meets(const Bounds3d& box) const {
        double low = t0, high = t1;
        for (int axis = 0; axis < 3; ++axis) {
            // Wider than rounding; a box too many only costs time.
            const double slack =
                1e-9 * (std::abs(box.lower[axis]) + std::abs(box.upper[axis]) + std::abs(origin[axis]));
            const double a = (box.lower[axis] - slack - origin[axis]) * per_direction[axis];
            const double b = (box.upper[axis] + slack - origin[axis]) * per_direction[axis];
            low = std::max(low, std::min(a, b)), high = std::min(high, std::max(a, b));
        }
        return low <= high;
    }
};

/// Added to the surface numbers of all children but the first while their parent waits for them.
constexpr std::uint32_t kOther = 0x80000000u;

/// Turns the crossings from `begin` on, of an operation's children, into those of the operation.
void apply(const PrimitiveNode& node, std::size_t begin, double tolerance, std::vector<PrimitiveCrossing>& list) {
    const auto first = list.begin() + std::ptrdiff_t(begin);
    std::sort(first, list.end(), [](const PrimitiveCrossing& a, const PrimitiveCrossing& b) {
        return a.t != b.t ? a.t < b.t : a.surface < b.surface;
    });
    std::uint32_t in_first = 0, in_others = 0;
    const auto inside = [&] {
        switch (node.operation) {
        case CsgOperation::intersect: return in_first + in_others == node.children;
        case CsgOperation::subtract: return in_first > 0 && in_others == 0;
        default: return in_first + in_others > 0;
        }
    };
    auto out = first;
    for (auto i = first; i != list.end();) {
        const bool was = inside();
        auto end = i;
        for (; end != list.end() && end->t - i->t <= tolerance; ++end)
            ((end->surface & kOther) ? in_others : in_first) += end->entering ? 1u : ~0u;
        if (const bool is = inside(); is != was) {
            // Of surfaces that coincide the first child's is seen.
            const PrimitiveCrossing* seen = nullptr;
            for (auto k = i; k != end; ++k) {
                const bool turned = node.operation == CsgOperation::subtract && (k->surface & kOther);
                if ((k->entering != turned) == is && (!seen || k->surface < seen->surface)) seen = &*k;
            }
            assert(seen);
            const PrimitiveCrossing kept{seen->t, seen->surface & ~kOther, is};
            *out++ = kept;
        }
        i = end;
    }
    list.erase(out, list.end());
}

/// An operation whose children are being evaluated.
struct Pending {
    std::uint32_t node;
    std::uint32_t done; ///< children
    std::size_t begin;  ///< of their crossings
};

} // namespace

void find_crossings(const PrimitiveTree& tree, Vec3d origin, Vec3d direction, double t0, double t1,
                    std::vector<PrimitiveCrossing>& list) {
    list.clear();
    const Bounds3d box = tree.bounds();
    if (box.empty()) return;
    const double tolerance = kCoincident * (length(box.center() - origin) + 0.5 * box.diagonal()) / length(direction);
    // A solid whose box the stretch does not touch is not there; what may coincide with
    // something at the ends of the stretch is.
    const Segment segment(origin, direction, t0 - 2 * tolerance, t1 + 2 * tolerance);
    std::array<Pending, kMaxTreeDepth> open;
    std::size_t depth = 0;
    for (std::uint32_t i = 0;;) {
        const PrimitiveNode& node = tree.nodes[i];
        std::size_t begin = list.size();
        if (!node.box.empty() && segment.meets(node.box)) {
            if (node.operation != CsgOperation::leaf) {
                open[depth++] = {i++, 0, begin};
                continue;
            }
            add_crossings(tree.leaves[node.leaf], origin, direction, list);
        }
        i = node.end;
        // A child's crossings are complete, which may complete its parent's, and so on.
        for (; depth > 0; --depth) {
            Pending& up = open[depth - 1];
            const PrimitiveNode& parent = tree.nodes[up.node];
            const bool nothing = list.size() == begin;
            if (up.done++ > 0)
                for (std::size_t k = begin; k < list.size(); ++k) list[k].surface |= kOther;
            if (nothing && (parent.operation == CsgOperation::intersect ||
                            (parent.operation == CsgOperation::subtract && up.done == 1))) {
                list.resize(up.begin);
                i = parent.end;
            } else if (i < parent.end) {
                break;
            } else {
                apply(parent, up.begin, tolerance, list);
            }
            begin = up.begin;
        }
        if (depth == 0) break;
    }
    std::erase_if(list, [&](const PrimitiveCrossing& c) { return !(c.t >= t0 && c.t <= t1); });
}

} // namespace porthole
