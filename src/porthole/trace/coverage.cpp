#include "porthole/trace/coverage.h"

#include <immintrin.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <cstring>
#include <optional>

#include "porthole/trace/packet.h"

namespace porthole {

namespace {

constexpr double kUlp = 1.0 / (1 << 24);       ///< most that rounding to float changes, relative
constexpr int kTrianglesPerPixel = 8;          ///< of a part: from then on its pixels are traced
constexpr std::size_t kChunkTriangles = 32768; ///< worth a thread

using Matrix = double[3][3];

/// The linear part, by row and column.
void columns_of(const Affine3d& a, Matrix& m) {
    const Vec3d columns[3] = {a.x, a.y, a.z};
    for (int j = 0; j < 3; ++j) m[0][j] = columns[j].x, m[1][j] = columns[j].y, m[2][j] = columns[j].z;
}

/// Bounds of what rounding in the tracer does to a ray on its way into a part's coordinates.
struct RayErrors {
    double shift = 0;    ///< of the origin, metres, in world coordinates
    double turn = 0;     ///< of the direction, per metre along the ray
    double stretch = 1;  ///< by how much more an edge function loses in the part's coordinates
    bool usable = false; ///< false: coordinates so small or large that products leave the range of float
};

/// @param place  of the part, as the tracer has it: rounded to float.
/// @param reach  greatest distance between the eye and the part, metres.
RayErrors ray_errors(const Affine3d& place, const View& view, double reach, Rect window) {
    Matrix m, inverse_m;
    columns_of(place, m);
    columns_of(inverse(place), inverse_m);
    const double determinant = std::abs(place.determinant());

    // The tracer inverts in float: cofactors, differences of two products, over the determinant, a sum
    // of six. Componentwise, so that scales along the axes cost nothing.
    double terms = 0; // the determinant's, without their signs
    Matrix delta;
    for (int i = 0; i < 3; ++i)
        for (int j = 0; j < 3; ++j) {
            const int r0 = (j + 1) % 3, r1 = (j + 2) % 3, c0 = (i + 1) % 3, c1 = (i + 2) % 3;
            const double cofactor = std::abs(m[r0][c0] * m[r1][c1]) + std::abs(m[r0][c1] * m[r1][c0]);
            delta[i][j] = cofactor / determinant;
            if (i == 0) terms += std::abs(m[j][0]) * cofactor;
        }
    Matrix gram; // of the inverse
    for (int i = 0; i < 3; ++i)
        for (int j = 0; j < 3; ++j) {
            delta[i][j] = kUlp * (4 * delta[i][j] + std::abs(inverse_m[i][j]) * (8 + 6 * terms / determinant));
            gram[i][j] = 0;
            for (int k = 0; k < 3; ++k) gram[i][j] += inverse_m[k][i] * inverse_m[k][j];
        }
    // The eighth root of the trace of the eighth power bounds the greatest eigenvalue from above.
    double size = std::max({gram[0][0], gram[1][1], gram[2][2]}), norm2 = 0;
    for (auto& row : gram)
        for (double& v : row) v /= size;
    for (int step = 0; step < 2; ++step) {
        Matrix square;
        for (int i = 0; i < 3; ++i)
            for (int j = 0; j < 3; ++j) {
                square[i][j] = 0;
                for (int k = 0; k < 3; ++k) square[i][j] += gram[i][k] * gram[k][j];
            }
        std::memcpy(gram, square, sizeof gram);
    }
    for (const auto& row : gram)
        for (const double v : row) norm2 += v * v; // of a symmetric matrix, the trace of its square
    norm2 = size * std::sqrt(std::sqrt(std::sqrt(norm2)));

    // Back in the world: what the inverse gets wrong of the eye's and the part's place, or of a direction.
    const Affine3f& camera = view.world_from_camera;
    double eye[3] = {std::abs(camera.p.x), std::abs(camera.p.y), std::abs(camera.p.z)};
    double away = 0; // of an orthographic ray's origin from the camera
    if (view.orthographic) {
        const double x = std::max(std::abs(window.x0 - 0.5 * view.width), std::abs(window.x1 - 0.5 * view.width));
        const double y = std::max(std::abs(window.y0 - 0.5 * view.height), std::abs(window.y1 - 0.5 * view.height));
        away = (x + y) * view.pixel_scale();
        for (double& e : eye) e += away;
    }
    const double origin[3] = {eye[0] + std::abs(place.p.x), eye[1] + std::abs(place.p.y), eye[2] + std::abs(place.p.z)};
    double shift2 = 0, turn2 = 0;
    for (int i = 0; i < 3; ++i) {
        double shift = view.orthographic ? 6 * kUlp * eye[i] : 0, turn = 0;
        for (int k = 0; k < 3; ++k)
            for (int j = 0; j < 3; ++j) {
                shift += std::abs(m[i][k]) * delta[k][j] * origin[j];
                turn += std::abs(m[i][k]) * delta[k][j];
            }
        shift2 += shift * shift, turn2 += turn * turn;
    }
    RayErrors errors;
    errors.shift = std::sqrt(shift2);
    errors.turn = std::sqrt(turn2) + 12 * kUlp;
    errors.stretch = determinant * norm2 * std::sqrt(norm2);
    const double near_unit = std::sqrt(norm2) * reach; // distances as the tracer sees them
    errors.usable = near_unit < 1e8 && near_unit > 1e-8 && std::isfinite(errors.shift + errors.turn + errors.stretch);
    return errors;
}

/// Margins for the triangles of one cluster.
struct Margins {
    float shift = 0;  ///< pixels between a centre and where its ray is, or a corner and where it is
    float round = 0;  ///< pixels by which an edge function is off, per length of its edge in space
    float place = 0;  ///< pixels by which a projected corner is off by itself; in `shift` as well
    float depth = 0;  ///< pixels per metre of depth: the third side of an edge's length
    float around = 0; ///< pixels away from which a ray cannot hit a triangle that is no sliver
};

/// A corner: x, y in pixels, depth in metres, nothing.
using Corner = __m128;

/// What is known of the pixels of a window.
struct Known {
    Bits inside; ///< a ray hits
    Bits doubt;  ///< where it is not inside, only a ray can tell
    explicit Known(Rect window) : inside(window), doubt(window) {}
};

/// Scan conversion with margins into a share of what is known.
class Converter {
public:
    Converter(const View& view, Rect window, Doubt doubt)
        : view_(view), guess_(doubt == Doubt::guess), known_(window) {}

    Known& known() { return known_; }

    /// The corners of a run of triangles, all of them before the eye.
    void project(std::span<const Vec3f> vertices, const Affine3d& camera_from_mesh) {
        const double scale = view_.pixel_scale();
        const Affine3d& a = camera_from_mesh;
        const auto all = [](double v) { return _mm256_set1_pd(v); };
        const __m256d one = all(1 / scale), middle_x = all(0.5 * view_.width), middle_y = all(0.5 * view_.height);
        for (std::size_t i = 0; i < vertices.size(); i += 4) {
            double vx[4], vy[4], vz[4];
            for (std::size_t k = 0; k < 4; ++k) {
                const Vec3f v = vertices[std::min(i + k, vertices.size() - 1)];
                vx[k] = v.x, vy[k] = v.y, vz[k] = v.z;
            }
            const __m256d px = _mm256_loadu_pd(vx), py = _mm256_loadu_pd(vy), pz = _mm256_loadu_pd(vz);
            const __m256d x = all(a.x.x) * px + all(a.y.x) * py + all(a.z.x) * pz + all(a.p.x);
            const __m256d y = all(a.x.y) * px + all(a.y.y) * py + all(a.z.y) * pz + all(a.p.y);
            const __m256d depth = -(all(a.x.z) * px + all(a.y.z) * py + all(a.z.z) * pz + all(a.p.z));
            const __m256d s = view_.orthographic ? one : one / depth;
            __m128 c0 = _mm256_cvtpd_ps(middle_x + x * s), c1 = _mm256_cvtpd_ps(middle_y - y * s),
                   c2 = _mm256_cvtpd_ps(depth), c3 = _mm_setzero_ps();
            _MM_TRANSPOSE4_PS(c0, c1, c2, c3);
            corners_[i] = c0, corners_[i + 1] = c1, corners_[i + 2] = c2, corners_[i + 3] = c3;
        }
    }

    /// @param solid  false: the surface may let rays pass, so that a hit is in doubt as well.
    void convert(std::span<const std::array<std::uint8_t, 3>> triangles, const Margins& m, bool solid) {
        Bits& inside = solid ? known_.inside : known_.doubt;
        for (const auto& t : triangles) {
            const Corner a = corners_[t[0]], b = corners_[t[1]], c = corners_[t[2]];
            // Most triangles of a fine mesh lie behind others, or between the centres.
            if (known_.inside.all(pixels_around(a, b, c, 1))) continue;
            Rect near = known_.inside.rows_to_go(pixels_around(a, b, c, m.around));
            if (near.empty() && !is_sliver(a, b, c, m)) continue;
            Edges edges = edges_of(a, b, c, near, m);
            if (edges.sliver) {
                near = known_.inside.rows_to_go(pixels_around(a, b, c, 1));
                edges = edges_of(a, b, c, near, m);
            }
            if (near.width() <= kNarrow)
                convert_narrow(edges, near, inside);
            else
                convert_wide(edges, near, inside);
        }
    }

private:
    static constexpr int kNarrow = 24; ///< columns evaluated one by one

    /// The edge functions of a triangle, positive inside; lane 3 is not used.
    struct Edges {
        __m128 x, y;   ///< per column and row
        __m128 value;  ///< at the first pixel's centre
        __m128 margin; ///< values nearer to 0 are in doubt
        bool sliver;   ///< by rounding a ray may hit the triangle farther away than Margins::around
    };

    /// The pixels whose centres are no farther from the triangle's box.
    [[nodiscard]] Rect pixels_around(Corner a, Corner b, Corner c, float distance) const {
        const __m128 lower = _mm_min_ps(_mm_min_ps(a, b), c), upper = _mm_max_ps(_mm_max_ps(a, b), c);
        const __m128i from = _mm_cvttps_epi32(_mm_ceil_ps(lower - _mm_set1_ps(distance + 0.5f)));
        const __m128i to = _mm_cvttps_epi32(_mm_floor_ps(upper + _mm_set1_ps(distance - 0.5f)));
        return Rect{_mm_cvtsi128_si32(from), _mm_extract_epi32(from, 1), _mm_cvtsi128_si32(to) + 1,
                    _mm_extract_epi32(to, 1) + 1}
            .intersected(known_.inside.window());
    }

    /// @param length2  greatest square of an edge's length in space
    static bool is_sliver(float area2, float length2, const Margins& m) {
        // At a distance outside, some edge function is below minus the distance times the triangle's
        // double area over twice its longest edge: beyond m.around that has to be more than rounding.
        return !(12 * m.round * length2 < (m.around - m.shift) * area2) ||
               !(area2 * area2 > 256 * m.place * m.place * length2);
    }

    static bool is_sliver(Corner a, Corner b, Corner c, const Margins& m) {
        const __m128 depth = _mm_setr_ps(1, 1, m.depth, 0);
        const __m128 ab = (b - a) * depth, bc = (c - b) * depth, ca = (a - c) * depth;
        const __m128 longest =
            _mm_max_ps(_mm_dp_ps(ab, ab, 0x71), _mm_max_ps(_mm_dp_ps(bc, bc, 0x71), _mm_dp_ps(ca, ca, 0x71)));
        const __m128 cross = ab * _mm_shuffle_ps(ca, ca, _MM_SHUFFLE(3, 2, 0, 1)); // x0 y1, y0 x1
        const float area2 = _mm_cvtss_f32(cross) - _mm_cvtss_f32(_mm_movehdup_ps(cross));
        return is_sliver(std::abs(area2), _mm_cvtss_f32(longest), m);
    }

    [[nodiscard]] Edges edges_of(Corner a, Corner b, Corner c, Rect near, const Margins& m) const {
        __m128 x = a, y = b, z = c, none = _mm_setzero_ps();
        _MM_TRANSPOSE4_PS(x, y, z, none);
        const auto next = [](__m128 v) { return _mm_shuffle_ps(v, v, _MM_SHUFFLE(3, 0, 2, 1)); };
        const auto all = [](float v) { return _mm_set1_ps(v); };
        const auto greatest = [&](__m128 v) {
            return _mm_cvtss_f32(_mm_max_ps(_mm_max_ps(v, next(v)), next(next(v))));
        };
        const auto sum = [&](__m128 v) { return _mm_cvtss_f32(v + next(v) + next(next(v))); };
        const __m128 absolute = _mm_castsi128_ps(_mm_set1_epi32(0x7FFFFFFF));
        const __m128 dx = next(x) - x, dy = next(y) - y, dz = (next(z) - z) * all(m.depth);
        const __m128 plane2 = dx * dx + dy * dy, length2 = plane2 + dz * dz;
        const float area2 = _mm_cvtss_f32(dx * next(dy) - dy * next(dx));
        const __m128 sign = all(area2 < 0 ? -1.0f : 1.0f);
        Edges e;
        e.sliver = is_sliver(std::abs(area2), greatest(length2), m);
        e.x = _mm_setzero_ps() - sign * dy;
        e.y = sign * dx;
        e.value = e.x * (all(float(near.x0) + 0.5f) - x) + e.y * (all(float(near.y0) + 0.5f) - y);
        // Half the way around the triangle is its width, and its height.
        const float span = 0.5f * sum(_mm_and_ps(dx, absolute) + _mm_and_ps(dy, absolute)) + 4;
        // What is less than the triangle's area cannot turn the other two edge functions as well.
        const __m128 length = _mm_sqrt_ps(length2);
        const float around = sum(length);
        const __m128 rounding = std::abs(area2) > 1.5f * m.round * around ? length : all(around);
        e.margin = _mm_sqrt_ps(plane2) * all(m.shift + 16 * float(kUlp) * span) + rounding * all(m.round) +
                   all(2 * m.place * span);
        if (guess_) e.margin = _mm_setzero_ps();
        return e;
    }

    /// Eight columns at a time.
    void convert_narrow(const Edges& edges, Rect near, Bits& inside) {
        const __m256i columns = _mm256_setr_epi32(0, 1, 2, 3, 4, 5, 6, 7);
        alignas(16) float ex[4], ey[4], value[4], margin[4];
        _mm_store_ps(ex, edges.x), _mm_store_ps(ey, edges.y);
        _mm_store_ps(value, edges.value), _mm_store_ps(margin, edges.margin);
        const auto all = [](float v) { return _mm256_set1_ps(v); };
        const __m256 zero = _mm256_setzero_ps();
        const __m256 two0 = all(2 * margin[0]), two1 = all(2 * margin[1]), two2 = all(2 * margin[2]);
        const std::size_t stride = inside.bytes_a_row();
        for (int x = near.x0 & ~7; x < near.x1; x += 8) {
            const int before = std::max(0, near.x0 - x), after = std::max(0, x + 8 - near.x1);
            const int used = (0xFF << before) & (0xFF >> after);
            const __m256 c = _mm256_cvtepi32_ps(_mm256_add_epi32(columns, _mm256_set1_epi32(x - near.x0)));
            __m256 u0 = all(value[0] - margin[0]) + all(ex[0]) * c, u1 = all(value[1] - margin[1]) + all(ex[1]) * c,
                   u2 = all(value[2] - margin[2]) + all(ex[2]) * c;
            std::uint8_t *in = &inside.eight(x, near.y0), *doubt = &known_.doubt.eight(x, near.y0);
            for (int i = 0; i < near.height(); ++i, in += stride, doubt += stride) {
                const float row = float(i);
                const __m256 v0 = u0 + all(ey[0] * row), v1 = u1 + all(ey[1] * row), v2 = u2 + all(ey[2] * row);
                const __m256 most = _mm256_min_ps(_mm256_min_ps(v0 + two0, v1 + two1), v2 + two2);
                const int may = _mm256_movemask_ps(_mm256_cmp_ps(most, zero, _CMP_GE_OQ)) & used;
                const __m256 least = _mm256_min_ps(_mm256_min_ps(v0, v1), v2);
                const int hit = _mm256_movemask_ps(_mm256_cmp_ps(least, zero, _CMP_GE_OQ)) & may;
                *in = std::uint8_t(*in | hit);
                *doubt = std::uint8_t(*doubt | (may & ~hit));
            }
        }
    }

    /// Four rows at a time, as spans.
    void convert_wide(const Edges& edges, Rect near, Bits& inside) {
        alignas(16) float ex[4], ey[4], value[4], margin[4];
        _mm_store_ps(ex, edges.x), _mm_store_ps(ey, edges.y);
        _mm_store_ps(value, edges.value), _mm_store_ps(margin, edges.margin);
        // Columns, from near.x0 on, where an edge function is the margin and minus the margin.
        struct Bound {
            double in, may, slope; ///< at the first row, and per row
            bool left;
        } bounds[3];
        for (int i = 0; i < 3; ++i) {
            // A level edge is far to the left or to the right, row by row.
            const double e = ex[i] == 0 ? 1e-30 : double(ex[i]);
            bounds[i] = {(double(margin[i]) - double(value[i])) / e, (-double(margin[i]) - double(value[i])) / e,
                         -double(ey[i]) / e, e > 0};
        }
        const auto all = [](double v) { return _mm256_set1_pd(v); };
        const __m256d first = all(0), last = all(near.width() - 1), before = all(-1), after = all(near.width());
        for (int y = near.y0; y < near.y1; y += 4) {
            const double r = y - near.y0;
            const __m256d rows = _mm256_setr_pd(r, r + 1, r + 2, r + 3);
            __m256d in0 = first, in1 = last, may0 = first, may1 = last;
            for (const Bound& b : bounds) {
                const __m256d lean = all(b.slope) * rows, in = all(b.in) + lean, may = all(b.may) + lean;
                if (b.left)
                    in0 = _mm256_max_pd(in0, in), may0 = _mm256_max_pd(may0, may);
                else
                    in1 = _mm256_min_pd(in1, in), may1 = _mm256_min_pd(may1, may);
            }
            alignas(16) int in_from[4], in_to[4], may_from[4], may_to[4];
            const auto store = [](int* out, __m256d v) {
                _mm_store_si128(reinterpret_cast<__m128i*>(out), _mm256_cvttpd_epi32(v));
            };
            store(in_from, _mm256_ceil_pd(_mm256_min_pd(in0, after)));
            store(in_to, _mm256_floor_pd(_mm256_max_pd(in1, before)));
            store(may_from, _mm256_ceil_pd(_mm256_min_pd(may0, after)));
            store(may_to, _mm256_floor_pd(_mm256_max_pd(may1, before)));
            for (int i = 0; i < std::min(4, near.y1 - y); ++i) {
                const int from = near.x0 + may_from[i], to = near.x0 + may_to[i] + 1;
                if (in_from[i] <= in_to[i]) {
                    inside.set(near.x0 + in_from[i], near.x0 + in_to[i] + 1, y + i);
                    known_.doubt.set(from, near.x0 + in_from[i], y + i);
                    known_.doubt.set(near.x0 + in_to[i] + 1, to, y + i);
                } else {
                    known_.doubt.set(from, to, y + i);
                }
            }
        }
    }

    const View& view_;
    bool guess_;
    Known known_;
    Corner corners_[192 + 4];
};

/// A part to be converted.
struct Job {
    const std::vector<Bounds3f>* boxes;
    const TriangleClusters* clusters;
    Affine3d camera_from_mesh;
    RayErrors errors;
    Rect pixels;
    bool solid;   ///< false: its surface may have holes
    bool by_rays; ///< only its clusters' boxes count
};

/// Clusters [first, last) of a part.
void convert(const Job& job, std::size_t first, std::size_t last, const View& view, Converter& converter) {
    Known& known = converter.known();
    const Rect window = known.inside.window();
    if (known.inside.all(job.pixels)) return;
    const double scale = view.pixel_scale();
    for (std::size_t k = first; k < last; ++k) {
        const ProjectedBox box = project_box((*job.boxes)[k], job.camera_from_mesh, view, window);
        if (box.pixels.empty() || known.inside.all(box.pixels)) continue;
        const bool before = box.finite && box.nearest > 1e-4 * std::abs(box.farthest);
        if (job.by_rays || !before) {
            known.doubt.set(box.pixels);
            continue;
        }
        // Depth of the nearest point turns lengths into pixels; an edge may be as near anywhere.
        const double pixel = view.orthographic ? scale : scale * box.nearest;
        const double ratio = view.orthographic ? 1 : box.farthest / box.nearest;
        const double tangent = view.orthographic ? 0 : box.extent_px * scale;
        const double distance = box.farthest * std::sqrt(1 + tangent * tangent);
        Margins m;
        m.place = float(2 * kUlp * (box.extent_px + view.width + view.height));
        m.shift = float((job.errors.shift + job.errors.turn * distance) / pixel) + m.place;
        m.round = float(10 * kUlp * job.errors.stretch * ratio * distance / pixel);
        m.depth = float((1 + tangent) / pixel);
        m.around = 0.1f + 2 * m.shift;
        if (!(m.around < 1) || !(m.round < 0.25f)) {
            known.doubt.set(box.pixels);
            continue;
        }
        const TriangleClusters::Run& run = job.clusters->runs[k];
        converter.project(std::span(job.clusters->vertices).subspan(run.first_vertex, run.vertices),
                          job.camera_from_mesh);
        converter.convert(std::span(job.clusters->triangles).subspan(run.first_triangle, run.triangles), m, job.solid);
    }
}

bool has_holes(const Scene& scene, const Mesh& mesh) {
    return std::any_of(mesh.submeshes.begin(), mesh.submeshes.end(),
                       [&](const Submesh& s) { return scene.materials[s.material].alpha_mode == AlphaMode::mask; });
}

/// Traces the 4x4 blocks with pixels in doubt: in the very packets of trace_ids(), as what becomes of a
/// ray along the edge of a box depends on the rays beside it.
/// @return rays
std::int64_t trace_doubts(const Bvh& bvh, const View& view, Rect window, Known& known, const Control& control) {
    const Rect w = known.inside.window();
    std::vector<Vec2i> blocks;
    std::vector<std::uint8_t> row(known.inside.bytes_a_row());
    for (int y0 = w.y0 & ~3; y0 < w.y1; y0 += 4) {
        std::fill(row.begin(), row.end(), std::uint8_t{0});
        for (int y = std::max(y0, w.y0); y < std::min(y0 + 4, w.y1); ++y) {
            const std::uint8_t *doubt = known.doubt.row(y), *inside = known.inside.row(y);
            for (std::size_t i = 0; i < row.size(); ++i) row[i] = std::uint8_t(row[i] | (doubt[i] & ~inside[i]));
        }
        for (std::size_t i = 0; i < row.size(); ++i) {
            if (row[i] & 0x0F) blocks.push_back({w.x0 + 8 * int(i), y0});
            if (row[i] & 0xF0) blocks.push_back({w.x0 + 8 * int(i) + 4, y0});
        }
    }

    std::vector<std::uint16_t> hits(blocks.size());
    constexpr std::size_t kPackets = 64; // handed to a thread at a time
    std::atomic<std::int64_t> rays{0};
    parallel_for((blocks.size() + kPackets - 1) / kPackets, control, [&](std::size_t chunk) {
        RayHit16 packet;
        float depth_per_t[kLanes];
        std::int64_t n = 0;
        for (std::size_t k = chunk * kPackets; k < std::min(blocks.size(), (chunk + 1) * kPackets); ++k) {
            n += set_block_rays(packet, depth_per_t, view, blocks[k].x, blocks[k].y, window);
            intersect(bvh, packet, Coherence::coherent);
            for (int i = 0; i < kLanes; ++i) hits[k] = std::uint16_t(hits[k] | int(packet.hit(i)) << i);
        }
        rays += n;
    });
    for (std::size_t k = 0; k < blocks.size(); ++k)
        for (int i = 0; i < 4; ++i) {
            const int y = blocks[k].y + i, shift = blocks[k].x & 4;
            if (y < w.y0 || y >= w.y1) continue;
            std::uint8_t& eight = known.inside.eight(blocks[k].x, y);
            eight = std::uint8_t((eight & ~(0xF << shift)) | (hits[k] >> (4 * i) & 0xF) << shift);
        }
    return rays;
}

} // namespace

Coverage cover(const Bvh& bvh, std::span<const PartId> parts, const ClusterBoxes& boxes, const View& view, Rect window,
               Doubt doubt, const Control& control, std::int64_t* rays) {
    const Scene& scene = bvh.scene();
    const Affine3d camera_from_world = inverse(Affine3d(view.world_from_camera));
    std::vector<Job> jobs;
    Rect touched{window.x1, window.y1, window.x0, window.y0};
    for (const PartId id : parts) {
        const Part& part = scene.parts[index(id)];
        const Mesh& mesh = scene.meshes[part.mesh];
        if (mesh.empty()) continue;
        const Affine3d place(Affine3f(part.world_from_mesh)); // as the tracer has it
        Job job{&boxes.by_mesh[part.mesh], &boxes.triangles[part.mesh], camera_from_world * place, {}, {}, true, false};
        const ProjectedBox box = project_box(mesh.bounds, job.camera_from_mesh, view, window);
        const Rect r = box.pixels;
        if (r.empty()) continue;
        touched = {std::min(touched.x0, r.x0), std::min(touched.y0, r.y0), std::max(touched.x1, r.x1),
                   std::max(touched.y1, r.y1)};
        job.pixels = r;
        job.errors = ray_errors(place, view, std::max(std::abs(box.nearest), std::abs(box.farthest)), window);
        job.solid = !has_holes(scene, mesh);
        job.by_rays = !mesh.primitives.empty() || !job.errors.usable ||
                      std::int64_t(mesh.triangles.size()) > kTrianglesPerPixel * r.width() * r.height();
        jobs.push_back(job);
    }
    if (touched.empty()) return {};
    touched = touched.grown(1).intersected(window);
    // Large parts first, rays last: what lies behind others by then costs little.
    std::stable_sort(jobs.begin(), jobs.end(), [](const Job& a, const Job& b) {
        if (a.by_rays != b.by_rays) return b.by_rays;
        return std::int64_t(a.pixels.width()) * a.pixels.height() > std::int64_t(b.pixels.width()) * b.pixels.height();
    });

    // Shares of the clusters, one a thread; what each finds out is joined.
    std::size_t triangles = 0;
    for (const Job& job : jobs) triangles += job.clusters->triangles.size();
    const std::size_t shares =
        std::clamp<std::size_t>(triangles / kChunkTriangles, 1, std::size_t(thread_count(control)));
    std::vector<std::optional<Known>> known(shares);
    parallel_for(shares, control, [&](std::size_t share) {
        Converter converter(view, {touched.x0 & ~7, touched.y0, touched.x1, touched.y1}, doubt);
        for (const Job& job : jobs) {
            if (control.stop.stop_requested()) throw Cancelled{};
            const std::size_t n = job.boxes->size();
            convert(job, n * share / shares, n * (share + 1) / shares, view, converter);
        }
        known[share] = std::move(converter.known());
    });
    Known& all = *known[0];
    for (std::size_t share = 1; share < shares; ++share) {
        all.inside |= known[share]->inside;
        all.doubt |= known[share]->doubt;
    }
    const std::int64_t traced = trace_doubts(bvh, view, window, all, control);
    if (rays) *rays += traced;
    return {std::move(all.inside), touched};
}

BlockMask blocks_of(const Coverage& coverage, Rect window) {
    BlockMask mask = no_blocks(window);
    const Rect w = coverage.window.intersected(window);
    for (int y = w.y0; y < w.y1; ++y)
        for (int x = w.x0; x < w.x1; ++x)
            if (coverage.hit(x, y)) mask.marked(x >> 2, y >> 2) = 1;
    return mask;
}

} // namespace porthole
