#include "porthole/render/lines.h"

namespace porthole {

namespace {

constexpr int kBisections = 4;         ///< of half a pixel
constexpr float kSuspectTurn = 0.985f; ///< cosine between neighbouring pixels' normals that asks for a closer look
constexpr float kSuspectStep = 0.25f;  ///< the same for how far off the tangent plane, pixels
// Creases fade in between these cosines of the angle between the faces, 20 and 40 degrees.
constexpr float kCreaseFrom = 0.94f, kCreaseTo = 0.766f;
// Faces that smooth normals hide, 50 and 70 degrees.
constexpr float kHiddenFrom = 0.64f, kHiddenTo = 0.34f;
// Steps fade in between these heights, pixels.
constexpr float kStepFrom = 0.75f, kStepTo = 2.0f;

// Where so many links of a square of seven by seven points carry a line, lines fade out, those
// without a step first: surfaces that coincide, or a grain that is finer than the picture. A
// straight line has some ten.
constexpr int kCrowd = 3;
constexpr float kFlushFrom = 22, kFlushTo = 34, kStepsFrom = 36, kStepsTo = 52;

/// Pixels off the tile whose lines matter to it.
int reach_of(const LineRules& rules) {
    return int(std::ceil(std::max(rules.half_width, rules.rim > 0 ? rules.rim_half_width : 0.0f) +
                         0.5f * float(kCrowd) + 0.7f));
}

float fade(float from, float to, float v) {
    const float t = clamp01((v - from) / (to - from));
    return t * t * (3 - 2 * t);
}

/// How far off each other's tangent planes two points lie, the lesser of both, in pixels.
float step_px(const View& view, const LineSample& a, const LineSample& b) {
    const Vec3f d = b.position - a.position;
    const float off = std::min(std::abs(dot(d, a.flat_normal)), std::abs(dot(d, b.flat_normal)));
    return off / view.pixel_size(std::min(a.depth, b.depth));
}

float crease_strength(const LineSample& a, const LineSample& b) {
    const float smooth = dot(a.normal, b.normal), flat = dot(a.flat_normal, b.flat_normal);
    return std::max(fade(kCreaseFrom, kCreaseTo, std::max(smooth, flat)), fade(kHiddenFrom, kHiddenTo, flat));
}

bool same_thing(const LineSample& a, const LineSample& b) { return a.part == b.part && a.cap == b.cap; }

/// What may turn out to be a line on a closer look.
bool suspect(const View& view, const LineSample& a, const LineSample& b) {
    if (!same_thing(a, b)) return true;
    if (a.part == kNoPart) return false;
    return dot(a.normal, b.normal) < kSuspectTurn || dot(a.flat_normal, b.flat_normal) < kSuspectTurn ||
           step_px(view, a, b) > kSuspectStep;
}

/// Whether `m`, between `a` and `b`, is on a's side of the change.
bool on_side_of(const View& view, const LineSample& m, const LineSample& a, const LineSample& b) {
    const bool like_a = same_thing(m, a), like_b = same_thing(m, b);
    if (like_a != like_b) return like_a;
    if (!like_a || m.part == kNoPart) return false; // something third: the change nearest to a
    const float step_a = step_px(view, a, m), step_b = step_px(view, m, b);
    if (std::max(step_a, step_b) > kSuspectStep * 0.5f) return step_a < step_b;
    return dot(a.normal, m.normal) + dot(a.flat_normal, m.flat_normal) >
           dot(b.normal, m.normal) + dot(b.flat_normal, m.flat_normal);
}

struct LinePoint {
    Vec2f at;
    float darkness = 0, half_width = 0;
    bool shy = false;
    bool found = false;
    bool flush = false; ///< the surfaces on both sides meet
};

/// Samples on a grid of half pixels; the point (i, j) lies at (i / 2, j / 2), so that pixel
/// centres have odd coordinates.
class Lattice {
public:
    Lattice(const View& view, Rect tile, const LineTrace& trace, const LineRules& rules)
        : view_(view), trace_(trace), rules_(rules), tile_(tile), reach_(reach_of(rules)),
          coarse_(tile.grown(reach_ + 2)), fine_{2 * coarse_.x0, 2 * coarse_.y0, 2 * coarse_.x1 + 1,
                                                 2 * coarse_.y1 + 1},
          slot_(fine_, kNotTraced), close_(tile.grown(reach_)), busy_{fine_.x1, fine_.y1, fine_.x0, fine_.y0},
          caps_only_(rules.caps_only()) {}

    void run(const std::function<bool(int, int)>& inside, LineInk& ink) {
        look_at_pixels(inside);
        if (!find_suspects()) return;
        look_closely(inside);
        // Links end a point off the pixels that are looked at closely, their cells one further.
        busy_ = busy_.grown(2).intersected(fine_);
        across_ = down_ = Image<LinePoint>(busy_);
        find_crossings();
        thin_out();
        join(ink);
    }

private:
    /// Traces lattice points that are not yet known, sixteen at a time.
    class Batch {
    public:
        explicit Batch(Lattice& lattice) : lattice_(lattice) {}
        void add(int i, int j) {
            if (lattice_.known(i, j)) return;
            lattice_.slot_(i, j) = std::int32_t(lattice_.samples_.size()) + n_;
            samples_.x[n_] = 0.5f * float(i), samples_.y[n_] = 0.5f * float(j);
            samples_.active[n_] = true;
            if (++n_ == kLanes) flush();
        }
        void flush() {
            if (n_ == 0) return;
            for (int k = n_; k < kLanes; ++k) samples_.active[k] = false;
            std::array<LineSample, kLanes> seen;
            lattice_.trace_(samples_, seen.data());
            lattice_.samples_.insert(lattice_.samples_.end(), seen.begin(), seen.begin() + n_);
            n_ = 0;
        }

    private:
        Lattice& lattice_;
        Samples16 samples_;
        int n_ = 0;
    };

    [[nodiscard]] bool known(int i, int j) const { return slot_(i, j) != kNotTraced; }
    [[nodiscard]] const LineSample& sample(int i, int j) const { return samples_[std::size_t(slot_(i, j))]; }

    [[nodiscard]] bool may_be_line(const LineSample& a, const LineSample& b) const {
        return (!caps_only_ || a.cap || b.cap) && suspect(view_, a, b);
    }

    void look_at_pixels(const std::function<bool(int, int)>& inside) {
        Batch batch(*this);
        for (int y0 = coarse_.y0; y0 < coarse_.y1; y0 += 4)
            for (int x0 = coarse_.x0; x0 < coarse_.x1; x0 += 4)
                for (int y = y0; y < std::min(y0 + 4, coarse_.y1); ++y)
                    for (int x = x0; x < std::min(x0 + 4, coarse_.x1); ++x)
                        if (inside(x, y)) batch.add(2 * x + 1, 2 * y + 1);
        batch.flush();
    }

    /// Marks the pixels around changes. @return whether there are any.
    bool find_suspects() {
        bool any = false;
        const Rect r = coarse_;
        const auto compare = [&](int x, int y, int dx, int dy) {
            const int i = 2 * x + 1, j = 2 * y + 1, k = i + 2 * dx, l = j + 2 * dy;
            if (x + dx >= r.x1 || y + dy >= r.y1 || !known(i, j) || !known(k, l)) return;
            if (!may_be_line(sample(i, j), sample(k, l))) return;
            any = true;
            busy_ = {std::min(busy_.x0, 2 * (x - 1)), std::min(busy_.y0, 2 * (y - 1)),
                     std::max(busy_.x1, 2 * (x + dx + 2) + 1), std::max(busy_.y1, 2 * (y + dy + 2) + 1)};
            for (int v = y - 1; v <= y + dy + 1; ++v)
                for (int u = x - 1; u <= x + dx + 1; ++u)
                    if (close_.contains(u, v)) close_(u, v) = 1;
        };
        for (int y = r.y0; y < r.y1; ++y)
            for (int x = r.x0; x < r.x1; ++x) {
                compare(x, y, 1, 0);
                compare(x, y, 0, 1);
            }
        return any;
    }

    void look_closely(const std::function<bool(int, int)>& inside) {
        Batch batch(*this);
        const Rect r = close_.window();
        for (int y = r.y0; y < r.y1; ++y)
            for (int x = r.x0; x < r.x1; ++x) {
                if (!close_(x, y) || !inside(x, y)) continue;
                for (int j = 2 * y; j <= 2 * y + 2; ++j)
                    for (int i = 2 * x; i <= 2 * x + 2; ++i) batch.add(i, j);
            }
        batch.flush();
    }

    struct Link {
        Vec2i point;
        bool is_across = false;
        LineSample a, b;
        float ta = 0, tb = 1; ///< where a and b lie on it
        float crease = 0;     ///< strength over the whole link
    };

    void find_crossings() {
        std::vector<Link> links;
        const auto add = [&](int i, int j, bool is_across) {
            const int k = is_across ? i + 1 : i, l = is_across ? j : j + 1;
            if (!known(i, j) || !known(k, l)) return;
            const LineSample &a = sample(i, j), &b = sample(k, l);
            if (!may_be_line(a, b)) return;
            // The rim has its own line, which is smoother than where rays happen to meet it.
            if (a.in_hole != b.in_hole && (a.part == b.part || !(a.on_target || b.on_target))) return;
            links.push_back(
                {{i, j}, is_across, a, b, 0, 1, same_thing(a, b) && a.part != kNoPart ? crease_strength(a, b) : 0.0f});
        };
        for (int j = busy_.y0; j < busy_.y1; ++j)
            for (int i = busy_.x0; i < busy_.x1; ++i) {
                if (i + 1 < busy_.x1) add(i, j, true);
                if (j + 1 < busy_.y1) add(i, j, false);
            }
        for (std::size_t begin = 0; begin < links.size(); begin += kLanes) {
            const std::size_t n = std::min<std::size_t>(kLanes, links.size() - begin);
            for (int step = 0; step < kBisections; ++step) bisect(std::span(links.data() + begin, n));
        }
        for (const Link& link : links) {
            if (same_thing(link.a, link.b) && link.a.part == kNoPart) continue;
            const float t = 0.5f * (link.ta + link.tb);
            LinePoint& c = (link.is_across ? across_ : down_)(link.point.x, link.point.y);
            c = weigh(link);
            c.at = {0.5f * (float(link.point.x) + (link.is_across ? t : 0.0f)),
                    0.5f * (float(link.point.y) + (link.is_across ? 0.0f : t))};
        }
    }

    void bisect(std::span<Link> links) {
        Samples16 middle;
        for (std::size_t k = 0; k < links.size(); ++k) {
            const Link& link = links[k];
            const float t = 0.5f * (link.ta + link.tb);
            middle.x[k] = 0.5f * (float(link.point.x) + (link.is_across ? t : 0.0f));
            middle.y[k] = 0.5f * (float(link.point.y) + (link.is_across ? 0.0f : t));
            middle.active[k] = true;
        }
        std::array<LineSample, kLanes> seen;
        trace_(middle, seen.data());
        for (std::size_t k = 0; k < links.size(); ++k) {
            Link& link = links[k];
            const float t = 0.5f * (link.ta + link.tb);
            if (on_side_of(view_, seen[k], link.a, link.b))
                link.a = seen[k], link.ta = t;
            else
                link.b = seen[k], link.tb = t;
        }
    }

    /// How dark the line at the end of a bisection is.
    [[nodiscard]] LinePoint weigh(const Link& link) const {
        const LineSample &a = link.a, &b = link.b;
        const bool a_first = a.depth <= b.depth;
        const LineSample &nearer = a_first ? a : b, &farther = a_first ? b : a;
        LinePoint c;
        c.half_width = rules_.half_width;
        if (a.masked || b.masked) return c;
        if (rules_.wanted && !rules_.wanted(nearer, farther)) return c;
        const bool background = a.part == kNoPart || b.part == kNoPart;
        const float step = background ? 1.0f : fade(kStepFrom, kStepTo, step_px(view_, a, b));
        float crease = 0;
        if (same_thing(a, b)) {
            crease = link.crease;
            c.darkness = std::max(rules_.step * step, rules_.crease * crease);
        } else if (background) {
            c.darkness = rules_.outline;
        } else if (a.part != b.part) {
            c.darkness = std::max(rules_.part, rules_.step * step);
        }
        if (a.cap || b.cap) {
            const float cap = a.cap != b.cap     ? rules_.cap
                              : a.part != b.part ? std::max(rules_.cap_part, rules_.cap * step)
                                                 : rules_.cap * std::max(step, crease);
            if (cap >= c.darkness) c.darkness = cap, c.shy = true;
            const float outer = a.cap != b.cap ? std::max(a.outer, b.outer) * (1 - step) : 0.0f;
            c.darkness = std::max(c.darkness, c.darkness + (rules_.rim - c.darkness) * outer);
            c.half_width += (rules_.rim_half_width - c.half_width) * outer;
        }
        c.flush = step < 0.5f;
        c.found = c.darkness > 0;
        return c;
    }

    /// Fades lines where they crowd.
    void thin_out() {
        Image<std::uint8_t> count(busy_);
        for (int j = busy_.y0; j < busy_.y1; ++j)
            for (int i = busy_.x0; i < busy_.x1; ++i)
                count(i, j) = std::uint8_t((across_(i, j).found ? 1 : 0) + (down_(i, j).found ? 1 : 0));
        for (int j = busy_.y0; j < busy_.y1; ++j)
            for (int i = busy_.x0; i < busy_.x1; ++i) {
                if (count(i, j) == 0) continue;
                int crowd = 0;
                for (int v = j - kCrowd; v <= j + kCrowd; ++v)
                    for (int u = i - kCrowd; u <= i + kCrowd; ++u) crowd += count.at_or(u, v, 0);
                if (float(crowd) <= kFlushFrom) continue;
                for (LinePoint* c : {&across_(i, j), &down_(i, j)}) {
                    c->darkness *= 1.0f - (c->flush ? fade(kFlushFrom, kFlushTo, float(crowd))
                                                    : fade(kStepsFrom, kStepsTo, float(crowd)));
                    c->found = c->darkness > 0;
                }
            }
    }

    /// Joins the crossings of every cell.
    void join(LineInk& ink) const {
        for (int j = busy_.y0; j + 1 < busy_.y1; ++j)
            for (int i = busy_.x0; i + 1 < busy_.x1; ++i) {
                const LinePoint* on[4];
                std::size_t n = 0;
                for (const LinePoint* c : {&across_(i, j), &across_(i, j + 1), &down_(i, j), &down_(i + 1, j)})
                    if (c->found) on[n++] = c;
                if (n == 0) continue;
                if (n == 2) {
                    lay(*on[0], *on[1], ink);
                    continue;
                }
                // A junction, or an end.
                LinePoint middle;
                for (std::size_t k = 0; k < n; ++k) {
                    middle.at = middle.at + on[k]->at * (1.0f / float(n));
                    middle.darkness = std::max(middle.darkness, on[k]->darkness);
                }
                if (n == 1) {
                    middle.at = {0.5f * (float(i) + 0.5f), 0.5f * (float(j) + 0.5f)};
                    middle.darkness = 0;
                }
                for (std::size_t k = 0; k < n; ++k) {
                    middle.shy = on[k]->shy;
                    lay(*on[k], middle, ink);
                }
            }
    }

    void lay(const LinePoint& a, const LinePoint& b, LineInk& ink) const {
        Ink& to = rules_.shy || a.shy || b.shy ? ink.shy : ink.open;
        const Stroke stroke{a.at, b.at, std::max(a.half_width, b.half_width), a.darkness, b.darkness};
        if (rules_.dash_px > 0)
            to.add_dashed(stroke, rules_.dash_px);
        else
            to.add(stroke);
    }

    const View& view_;
    const LineTrace& trace_;
    const LineRules& rules_;
    Rect tile_;
    int reach_;
    Rect coarse_, fine_;
    static constexpr std::int32_t kNotTraced = -1;
    Image<std::int32_t> slot_; ///< of a lattice point in samples_
    std::vector<LineSample> samples_;
    Mask close_; ///< pixels to look at closely
    Rect busy_;  ///< lattice points of these
    bool caps_only_;
    Image<LinePoint> across_, down_; ///< on the link to the right and below
};

} // namespace

LineTrace plain_trace(const Bvh& bvh, const View& view, const std::vector<Placement>& placements, RayCounts& rays,
                      int layer) {
    return [&, layer](const Samples16& samples, LineSample* out) {
        RayHit16 packet;
        float depth_per_t[kLanes], tnear[kLanes] = {};
        for (int passed = 0;; ++passed) {
            for (int i = 0; i < kLanes; ++i) {
                packet.clear(i);
                if (!samples.active[i] || !(tnear[i] < kInfinity)) continue;
                const Ray ray = view.ray(samples.x[i], samples.y[i]);
                packet.set(i, ray.origin, ray.direction, tnear[i], kInfinity);
                depth_per_t[i] = ray.depth_per_t;
                ++rays.primary;
            }
            intersect(bvh, packet, Coherence::coherent);
            if (passed == layer) break;
            for (int i = 0; i < kLanes; ++i)
                tnear[i] =
                    packet.hit(i) ? packet.tfar[i] * (1 + 4e-6f) + placements[index(packet.part(i))].offset : kInfinity;
        }
        for (int i = 0; i < kLanes; ++i) {
            if (!samples.active[i]) continue;
            LineSample& s = out[i];
            s = {};
            if (!packet.hit(i)) continue;
            const Hit hit{packet.part(i), packet.triangle[i], packet.u[i], packet.v[i]};
            const SurfacePoint point = surface_point(placements[index(hit.part)], hit, packet.direction(i));
            s.part = hit.part;
            s.depth = packet.tfar[i] * depth_per_t[i];
            s.position = point.position;
            s.normal = point.normal;
            s.flat_normal = point.flat_normal;
        }
    };
}

void find_lines(const View& view, Rect tile, const std::function<bool(int x, int y)>& inside, const LineTrace& trace,
                const LineRules& rules, LineInk& ink) {
    Lattice(view, tile, trace, rules).run(inside, ink);
}

} // namespace porthole
