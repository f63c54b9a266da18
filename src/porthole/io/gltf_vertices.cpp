// Vertices and triangles of a primitive, decoded in ranges so that threads share large ones.
#include <algorithm>
#include <cmath>
#include <limits>

#include "porthole/io/gltf_mesh.h"

namespace porthole::gltf {
namespace {

static_assert(sizeof(Vec2f) == 8 && sizeof(Vec3f) == 12 && sizeof(Vec4f) == 16 && sizeof(Vec3u) == 12,
              "accessors are read straight into arrays of these");

constexpr float kNaN = std::numeric_limits<float>::quiet_NaN();

// Adds weight * difference of every morph target that has the attribute `pick` chooses.
template <typename Pick> void add_targets(const Primitive& p, const MeshRequest& request, std::size_t first,
                                          std::size_t count, int width, int stride, float* out, const Pick& pick) {
    std::vector<float> difference;
    for (std::size_t t = 0; t < p.targets.size() && t < request.weights.size(); ++t) {
        const Accessor* accessor = pick(p.targets[t]);
        const float weight = request.weights[t];
        if (!accessor || weight == 0) continue;
        difference.resize(count * std::size_t(width));
        read_floats(*accessor, first, count, width, difference.data());
        for (std::size_t i = 0; i < count; ++i)
            for (int k = 0; k < width; ++k)
                out[i * std::size_t(stride) + std::size_t(k)] +=
                    weight * difference[i * std::size_t(width) + std::size_t(k)];
    }
}

// Blends the joints' transforms and applies them to positions, normals and tangents.
std::uint64_t skin_vertices(const Primitive& p, const MeshRequest& request, std::size_t first, std::size_t count,
                            Vec3f* positions, Vec3f* normals, Vec4f* tangents) {
    const std::size_t sets = p.attributes.joints.size();
    std::vector<std::uint32_t> joints(sets * count * 4);
    std::vector<float> weights(sets * count * 4);
    for (std::size_t s = 0; s < sets; ++s) {
        read_uints(*p.attributes.joints[s], first, count, joints.data() + s * count * 4);
        read_floats(*p.attributes.weights[s], first, count, 4, weights.data() + s * count * 4);
    }
    const std::vector<Affine3d>& world_from_bind = *request.world_from_bind;
    std::uint64_t unknown = 0;
    for (std::size_t i = 0; i < count; ++i) {
        Affine3d blend{{}, {}, {}, {}};
        double total = 0;
        bool known = true;
        const auto add = [&](std::uint32_t joint, double w) {
            if (joint >= world_from_bind.size()) {
                joint = 0;
                known = false;
            }
            const Affine3d& m = world_from_bind[joint];
            blend.x += m.x * w;
            blend.y += m.y * w;
            blend.z += m.z * w;
            blend.p += m.p * w;
            total += w;
        };
        for (std::size_t s = 0; s < sets; ++s)
            for (std::size_t k = 0; k < 4; ++k) {
                const double w = double(weights[(s * count + i) * 4 + k]);
                if (w > 0) add(joints[(s * count + i) * 4 + k], w);
            }
        if (!(total > 0)) add(joints[i * 4], 1); // no weights: rigidly with the first joint named
        if (total != 1) {
            const double scale = 1 / total;
            blend.x *= scale;
            blend.y *= scale;
            blend.z *= scale;
            blend.p *= scale;
        }
        if (!known) ++unknown;
        positions[i] = Vec3f(blend.point(Vec3d(positions[i])));
        if (normals) {
            const double side = blend.determinant() < 0 ? -1 : 1;
            normals[i] = Vec3f(normalize(transform_normal(blend, Vec3d(normals[i])) * side, Vec3d{0, 0, 0}));
        }
        if (tangents) {
            const Vec3d t = blend.vector({tangents[i].x, tangents[i].y, tangents[i].z});
            tangents[i] = {float(t.x), float(t.y), float(t.z), tangents[i].w};
        }
    }
    return unknown;
}

// Unit length; NaN where there is none, which repair_normals finds.
bool normalize_normals(Vec3f* normals, std::size_t count) {
    bool all = true;
    for (std::size_t i = 0; i < count; ++i) {
        normals[i] = normalize(normals[i], Vec3f{kNaN, kNaN, kNaN});
        all &= normals[i].x == normals[i].x;
    }
    return all;
}

void normalize_tangents(Vec4f* tangents, const Vec3f* normals, std::size_t count) {
    for (std::size_t i = 0; i < count; ++i) {
        const Vec4f t = tangents[i];
        Vec3f unit = normalize(Vec3f{t.x, t.y, t.z}, Vec3f{0, 0, 0});
        if (unit == Vec3f{0, 0, 0}) unit = is_finite(normals[i]) ? Frame3(normals[i]).x : Vec3f{1, 0, 0};
        tangents[i] = {unit.x, unit.y, unit.z, t.w < 0 ? -1.0f : 1.0f};
    }
}

// One corner after the other, whatever the topology stores them as.
class Corners {
public:
    Corners(const Primitive& p, std::size_t first, std::size_t count) : first_(first), values_(count) {
        if (p.indices)
            read_uints(*p.indices, first, count, values_.data());
        else
            for (std::size_t i = 0; i < count; ++i) values_[i] = static_cast<std::uint32_t>(first + i);
    }
    std::uint32_t operator[](std::size_t corner) const { return values_[corner - first_]; }

private:
    std::size_t first_;
    std::vector<std::uint32_t> values_;
};

constexpr Vec3u kDropped{0xFFFFFFFFu, 0xFFFFFFFFu, 0xFFFFFFFFu};

} // namespace

VertexFaults fill_vertices(const Primitive& p, const MeshRequest& request, std::size_t base, std::size_t first,
                           std::size_t count, Mesh& mesh) {
    const Attributes& a = p.attributes;
    const std::size_t at = base + first;
    VertexFaults faults;

    Vec3f* positions = mesh.positions.data() + at;
    read_floats(*a.position, first, count, 3, &positions->x);
    add_targets(p, request, first, count, 3, 3, &positions->x, [](const Attributes& t) { return t.position; });

    Vec3f* normals = mesh.normals.empty() ? nullptr : mesh.normals.data() + at;
    if (normals && a.normal) {
        read_floats(*a.normal, first, count, 3, &normals->x);
        add_targets(p, request, first, count, 3, 3, &normals->x, [](const Attributes& t) { return t.normal; });
    } else if (normals) {
        std::fill_n(normals, count, Vec3f{kNaN, kNaN, kNaN});
    }
    Vec4f* tangents = mesh.tangents.empty() ? nullptr : mesh.tangents.data() + at;
    if (tangents && a.tangent) {
        read_floats(*a.tangent, first, count, 4, &tangents->x);
        add_targets(p, request, first, count, 3, 4, &tangents->x, [](const Attributes& t) { return t.tangent; });
    } // else zero, which normalize_tangents replaces

    for (int set = 0; set < 2; ++set) {
        if (mesh.uv[set].empty() || !a.uv[set]) continue; // zero where missing
        float* uv = &mesh.uv[set][at].x;
        read_floats(*a.uv[set], first, count, 2, uv);
        add_targets(p, request, first, count, 2, 2, uv, [set](const Attributes& t) { return t.uv[set]; });
        for (std::size_t k = 0; k < count * 2; ++k)
            if (!std::isfinite(uv[k])) uv[k] = 0;
    }
    if (!mesh.colors.empty() && a.color) {
        float* colors = &mesh.colors[at].x;
        read_floats(*a.color, first, count, 4, colors);
        add_targets(p, request, first, count, 4, 4, colors, [](const Attributes& t) { return t.color; });
        for (std::size_t k = 0; k < count * 4; ++k) colors[k] = colors[k] > 0 ? std::min(colors[k], 1.0f) : 0.0f;
    } // else white

    if (request.skin != kNone && !a.joints.empty())
        faults.unknown_joints = skin_vertices(p, request, first, count, positions, normals, tangents);
    if (normals && a.normal) faults.no_normal = !normalize_normals(normals, count);
    if (tangents && normals) normalize_tangents(tangents, normals, count);
    return faults;
}

BadIndices fill_triangles(const Primitive& p, std::uint32_t base, std::size_t first, std::size_t count, Vec3u* out) {
    const auto vertices = static_cast<std::uint32_t>(p.vertices);
    BadIndices bad;
    std::uint32_t largest = 0;
    if (p.topology == Topology::triangles) {
        std::uint32_t* flat = &out->x;
        if (p.indices)
            read_uints(*p.indices, first * 3, count * 3, flat);
        else
            for (std::size_t i = 0; i < count * 3; ++i) flat[i] = static_cast<std::uint32_t>(first * 3 + i);
        for (std::size_t i = 0; i < count * 3; ++i) largest = std::max(largest, flat[i]);
    } else if (p.topology == Topology::strip) {
        const Corners corners(p, first, count + 2);
        for (std::size_t i = 0; i < count; ++i) {
            const std::size_t t = first + i, odd = t % 2;
            out[i] = {corners[t], corners[t + 1 + odd], corners[t + 2 - odd]};
            largest = std::max({largest, out[i].x, out[i].y, out[i].z});
        }
    } else {
        const Corners center(p, 0, 1), corners(p, first + 1, count + 1);
        for (std::size_t i = 0; i < count; ++i) {
            out[i] = {corners[first + i + 1], corners[first + i + 2], center[0]};
            largest = std::max({largest, out[i].x, out[i].y, out[i].z});
        }
    }
    if (largest >= vertices) {
        for (std::size_t i = 0; i < count; ++i) {
            const std::uint32_t worst = std::max({out[i].x, out[i].y, out[i].z});
            if (worst < vertices) {
                out[i] = {out[i].x + base, out[i].y + base, out[i].z + base};
                continue;
            }
            if (bad.triangles++ == 0) {
                bad.first_triangle = first + i;
                bad.first_index = worst;
            }
            out[i] = kDropped;
        }
    } else if (base != 0) {
        for (std::size_t i = 0; i < count; ++i) out[i] = {out[i].x + base, out[i].y + base, out[i].z + base};
    }
    return bad;
}

void flatten_submeshes(Mesh& mesh, std::span<const std::uint8_t> flat) {
    const auto append = [](auto& array, std::uint32_t from) {
        if (!array.empty()) array.push_back(typename std::decay_t<decltype(array)>::value_type(array[from]));
    };
    for (std::size_t s = 0; s < mesh.submeshes.size(); ++s) {
        if (!flat[s]) continue;
        const Submesh& run = mesh.submeshes[s];
        for (std::uint32_t i = 0; i < run.triangle_count; ++i) {
            Vec3u& t = mesh.triangles[run.first_triangle + i];
            if (t == kDropped) continue;
            const Vec3f a = mesh.positions[t.x], b = mesh.positions[t.y], c = mesh.positions[t.z];
            const Vec3f normal = normalize(cross(b - a, c - a));
            const auto corner = static_cast<std::uint32_t>(mesh.positions.size());
            for (const std::uint32_t from : {t.x, t.y, t.z}) {
                append(mesh.positions, from);
                mesh.normals.push_back(normal);
                append(mesh.tangents, from);
                append(mesh.uv[0], from);
                append(mesh.uv[1], from);
                append(mesh.colors, from);
            }
            t = {corner, corner + 1, corner + 2};
        }
    }
}

void repair_normals(Mesh& mesh) {
    const std::size_t vertices = mesh.normals.size();
    const auto missing = [&](std::uint32_t v) { return v < vertices && !(mesh.normals[v].x == mesh.normals[v].x); };
    std::vector<Vec3d> sum(vertices);
    for (const Vec3u& t : mesh.triangles) {
        if (!missing(t.x) && !missing(t.y) && !missing(t.z)) continue;
        if (t.x >= vertices || t.y >= vertices || t.z >= vertices) continue;
        const Vec3d a(mesh.positions[t.x]), b(mesh.positions[t.y]), c(mesh.positions[t.z]);
        const Vec3d n = cross(b - a, c - a);
        if (!is_finite(n)) continue;
        sum[t.x] += n;
        sum[t.y] += n;
        sum[t.z] += n;
    }
    for (std::size_t v = 0; v < vertices; ++v)
        if (missing(static_cast<std::uint32_t>(v)))
            mesh.normals[v] = normalize(Vec3f(normalize(sum[v], Vec3d{0, 0, 1})));
}

} // namespace porthole::gltf
