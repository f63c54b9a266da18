#include "porthole/trace/clusters.h"

#include <algorithm>
#include <cmath>

namespace porthole {

namespace {

constexpr std::size_t kCluster = 64; ///< triangles of a run; their vertices must be countable in a byte

int floor_div4(int a) { return a >> 2; } // arithmetic shift: rounds down for negative pixels too

/// Sixteen bits of a coordinate spread to every third bit.
std::uint32_t spread(std::uint32_t v) {
    v = (v | (v << 16)) & 0x030000FFu;
    v = (v | (v << 8)) & 0x0300F00Fu;
    v = (v | (v << 4)) & 0x030C30C3u;
    return (v | (v << 2)) & 0x09249249u;
}

/// The mesh's triangles along a Morton curve of their centroids.
std::vector<std::uint32_t> along_a_curve(const Mesh& mesh) {
    const std::size_t n = mesh.triangles.size();
    std::vector<std::pair<std::uint32_t, std::uint32_t>> order(n);
    const Vec3f size = mesh.bounds.size();
    const auto cell = [](float v, float lower, float extent) {
        return extent > 0 ? std::uint32_t(std::clamp((v - lower) / extent, 0.0f, 1.0f) * 1023.0f) : 0u;
    };
    for (std::uint32_t i = 0; i < n; ++i) {
        const Vec3u t = mesh.triangles[i];
        const Vec3f c = mesh.positions[t.x] / 3.0f + mesh.positions[t.y] / 3.0f + mesh.positions[t.z] / 3.0f;
        order[i] = {spread(cell(c.x, mesh.bounds.lower.x, size.x)) |
                        spread(cell(c.y, mesh.bounds.lower.y, size.y)) << 1 |
                        spread(cell(c.z, mesh.bounds.lower.z, size.z)) << 2,
                    i};
    }
    std::sort(order.begin(), order.end());
    std::vector<std::uint32_t> sorted(n);
    std::transform(order.begin(), order.end(), sorted.begin(), [](const auto& o) { return o.second; });
    return sorted;
}

void make_clusters(const Mesh& mesh, std::vector<Bounds3f>& boxes, TriangleClusters& clusters) {
    if (!mesh.primitives.empty()) {
        boxes = {mesh.bounds};
        return;
    }
    const std::vector<std::uint32_t> order = along_a_curve(mesh);
    const std::size_t n = order.size();
    boxes.resize((n + kCluster - 1) / kCluster);
    clusters.runs.resize(boxes.size());
    clusters.triangles.resize(n);
    clusters.vertices.reserve(n);
    // By vertex of the mesh the last run that used it, plus one, and where.
    std::vector<std::pair<std::uint32_t, std::uint32_t>> last(mesh.positions.size());
    for (std::size_t k = 0; k < boxes.size(); ++k) {
        TriangleClusters::Run& run = clusters.runs[k];
        run.first_vertex = std::uint32_t(clusters.vertices.size());
        run.first_triangle = std::uint32_t(k * kCluster);
        run.triangles = std::uint32_t(std::min(kCluster, n - k * kCluster));
        for (std::size_t i = 0; i < run.triangles; ++i) {
            const Vec3u t = mesh.triangles[order[k * kCluster + i]];
            const std::uint32_t corners[3] = {t.x, t.y, t.z};
            for (std::size_t c = 0; c < 3; ++c) {
                auto& [used_by, place] = last[corners[c]];
                if (used_by != k + 1) {
                    used_by = std::uint32_t(k + 1);
                    place = std::uint32_t(clusters.vertices.size()) - run.first_vertex;
                    clusters.vertices.push_back(mesh.positions[corners[c]]);
                    boxes[k].extend(mesh.positions[corners[c]]);
                }
                clusters.triangles[k * kCluster + i][c] = std::uint8_t(place);
            }
        }
        run.vertices = std::uint32_t(clusters.vertices.size()) - run.first_vertex;
    }
    clusters.vertices.shrink_to_fit();
}

} // namespace

ClusterBoxes cluster_boxes(const Scene& scene, std::span<const PartId> parts, const Control& control) {
    ClusterBoxes boxes;
    boxes.by_mesh.resize(scene.meshes.size());
    boxes.triangles.resize(scene.meshes.size());
    std::vector<std::uint32_t> meshes;
    for (const PartId id : parts) meshes.push_back(scene.parts[index(id)].mesh);
    std::sort(meshes.begin(), meshes.end());
    meshes.erase(std::unique(meshes.begin(), meshes.end()), meshes.end());
    parallel_for(meshes.size(), control, [&](std::size_t i) {
        make_clusters(scene.meshes[meshes[i]], boxes.by_mesh[meshes[i]], boxes.triangles[meshes[i]]);
    });
    return boxes;
}

ProjectedBox project_box(const Bounds3f& box, const Affine3d& camera_from_mesh, const View& view, Rect window) {
    double x0 = 1e300, y0 = 1e300, x1 = -1e300, y1 = -1e300;
    ProjectedBox projected{{}, true, 1e300, -1e300, 0};
    Vec3d corners[8];
    for (int i = 0; i < 8; ++i) {
        corners[i] = camera_from_mesh.point(Vec3d(box.corner(i)));
        projected.nearest = std::min(projected.nearest, -corners[i].z);
        projected.farthest = std::max(projected.farthest, -corners[i].z);
    }
    const double scale = view.pixel_scale();
    if (!view.orthographic) {
        if (projected.farthest < 0) return projected;
        if (!(projected.nearest > 1e-4 * projected.farthest)) {
            projected.pixels = window;
            projected.finite = false;
            return projected;
        }
    }
    for (const Vec3d& c : corners) {
        const double s = 1.0 / (view.orthographic ? scale : scale * -c.z);
        const double x = 0.5 * view.width + c.x * s, y = 0.5 * view.height - c.y * s;
        x0 = std::min(x0, x), x1 = std::max(x1, x);
        y0 = std::min(y0, y), y1 = std::max(y1, y);
    }
    const auto pixel = [](double v) { return int(std::clamp(std::floor(v), -1e9, 1e9)); };
    projected.pixels = Rect{pixel(x0) - 1, pixel(y0) - 1, pixel(x1) + 2, pixel(y1) + 2}.intersected(window);
    const double middle_x = 0.5 * view.width, middle_y = 0.5 * view.height;
    projected.extent_px = std::hypot(std::max(std::abs(x0 - middle_x), std::abs(x1 - middle_x)),
                                     std::max(std::abs(y0 - middle_y), std::abs(y1 - middle_y)));
    return projected;
}

std::int64_t BlockMask::count() const {
    return std::count(marked.pixels().begin(), marked.pixels().end(), std::uint8_t{1});
}

BlockMask no_blocks(Rect window) {
    const Rect blocks{floor_div4(window.x0), floor_div4(window.y0), floor_div4(window.x1 - 1) + 1,
                      floor_div4(window.y1 - 1) + 1};
    return {blocks, Mask(blocks, 0)};
}

BlockMask mark_blocks(const Scene& scene, std::span<const PartId> parts, const ClusterBoxes& boxes, const View& view,
                      Rect window) {
    BlockMask mask = no_blocks(window);
    const Affine3d camera_from_world = inverse(Affine3d(view.world_from_camera));
    for (const PartId id : parts) {
        const Part& part = scene.parts[index(id)];
        const Affine3d camera_from_mesh = camera_from_world * part.world_from_mesh;
        for (const Bounds3f& box : boxes.by_mesh[part.mesh]) {
            const Rect r = project_box(box, camera_from_mesh, view, window).pixels;
            if (r.empty()) continue;
            for (int by = floor_div4(r.y0); by <= floor_div4(r.y1 - 1); ++by)
                std::fill_n(&mask.marked(floor_div4(r.x0), by), floor_div4(r.x1 - 1) - floor_div4(r.x0) + 1,
                            std::uint8_t{1});
        }
    }
    return mask;
}

Rect pixel_rect(const BlockMask& blocks, Rect window) {
    const Rect w = blocks.blocks;
    Rect b{w.x1, w.y1, w.x0, w.y0};
    for (int y = w.y0; y < w.y1; ++y)
        for (int x = w.x0; x < w.x1; ++x)
            if (blocks.marked(x, y))
                b = {std::min(b.x0, x), std::min(b.y0, y), std::max(b.x1, x + 1), std::max(b.y1, y + 1)};
    if (b.empty()) return {};
    return Rect{4 * b.x0, 4 * b.y0, 4 * b.x1, 4 * b.y1}.intersected(window);
}

} // namespace porthole
