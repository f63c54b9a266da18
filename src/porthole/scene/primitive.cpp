#include "porthole/scene/primitive.h"

#include <algorithm>
#include <random>

namespace porthole {

namespace {

constexpr double kPiD = 3.14159265358979323846;

Bounds3d box_of(const PrimitiveLeaf& leaf, const Affine3d& map) {
    const Affine3d m = map * leaf.mesh_from_leaf;
    Bounds3d box;
    Vec3d low, high;
    for (int a = 0; a < 3; ++a) {
        const double x = std::abs(m.x[a]), y = std::abs(m.y[a]), z = std::abs(m.z[a]);
        const double ring = std::sqrt(x * x + z * z), ball = std::sqrt(x * x + y * y + z * z);
        double below = 0, above = 0;
        switch (leaf.kind) {
        case PrimitiveKind::sphere: below = above = ball; break;
        case PrimitiveKind::box: below = above = x + y + z; break;
        case PrimitiveKind::frustum:
            below = std::max(m.y[a] + ring, leaf.ratio * ring - m.y[a]);
            above = std::max(ring - m.y[a], leaf.ratio * ring + m.y[a]);
            break;
        case PrimitiveKind::torus: below = above = ring + leaf.ratio * ball; break;
        }
        low[a] = m.p[a] - below, high[a] = m.p[a] + above;
    }
    box.extend(low), box.extend(high);
    return box;
}

/// Calls body(child) for the children of node `i`, by index.
template <typename Body> void for_each_child(const PrimitiveTree& tree, std::uint32_t i, const Body& body) {
    for (std::uint32_t c = i + 1; c < tree.nodes[i].end; c = tree.nodes[c].end) body(c);
}

Bounds3d common(const Bounds3d& a, const Bounds3d& b) {
    const Bounds3d box{max(a.lower, b.lower), min(a.upper, b.upper)};
    return box.lower.x <= box.upper.x && box.lower.y <= box.upper.y && box.lower.z <= box.upper.z ? box : Bounds3d{};
}

/// Boxes of all nodes under a map.
std::vector<Bounds3d> boxes_of(const PrimitiveTree& tree, const Affine3d& map) {
    std::vector<Bounds3d> boxes(tree.nodes.size());
    for (auto i = std::uint32_t(boxes.size()); i-- > 0;) {
        const PrimitiveNode& node = tree.nodes[i];
        if (node.operation == CsgOperation::leaf) {
            boxes[i] = box_of(tree.leaves[node.leaf], map);
            continue;
        }
        boxes[i] = boxes[i + 1];
        if (node.operation == CsgOperation::subtract) continue;
        for_each_child(tree, i, [&](std::uint32_t c) {
            if (node.operation == CsgOperation::intersect)
                boxes[i] = common(boxes[i], boxes[c]);
            else
                boxes[i].extend(boxes[c]);
        });
    }
    return boxes;
}

void place(PrimitiveLeaf& leaf, const Affine3d& mesh_from_leaf) {
    const Affine3d& m = leaf.mesh_from_leaf = mesh_from_leaf;
    leaf.leaf_from_mesh = inverse(m);
    const double sign = m.determinant() < 0 ? -1 : 1;
    leaf.nx = cross(m.y, m.z) * sign, leaf.ny = cross(m.z, m.x) * sign, leaf.nz = cross(m.x, m.y) * sign;
}

/// Points around a profile in the half plane x >= 0, as (x, y), turned about the y axis: their
/// hull holds the body that the profile's hull makes.
void add_turned(const std::vector<Vec2d>& profile, const Affine3d& mesh_from_leaf, std::vector<Vec3d>& out) {
    constexpr int kAround = 32;
    const double wider = 1 / std::cos(kPiD / kAround);
    for (const Vec2d p : profile)
        for (int i = 0; i < kAround; ++i) {
            const double angle = 2 * kPiD * i / kAround;
            out.push_back(mesh_from_leaf.point({p.x * wider * std::cos(angle), p.y, p.x * wider * std::sin(angle)}));
        }
}

/// Points around a circle whose hull holds it, of x >= 0.
std::vector<Vec2d> around_circle(Vec2d center, double radius) {
    constexpr int kAround = 32;
    const double wider = radius / std::cos(kPiD / kAround);
    std::vector<Vec2d> out;
    for (int i = 0; i < kAround; ++i) {
        const double angle = 2 * kPiD * (i + 0.5) / kAround;
        out.push_back({std::max(0.0, center.x + wider * std::cos(angle)), center.y + wider * std::sin(angle)});
    }
    return out;
}

void add_hull(const PrimitiveLeaf& leaf, std::vector<Vec3d>& out) {
    switch (leaf.kind) {
    case PrimitiveKind::sphere: add_turned(around_circle({0, 0}, 1), leaf.mesh_from_leaf, out); break;
    case PrimitiveKind::box:
        for (int i = 0; i < 8; ++i)
            out.push_back(leaf.mesh_from_leaf.point(Bounds3d{{-1, -1, -1}, {1, 1, 1}}.corner(i)));
        break;
    case PrimitiveKind::frustum: add_turned({{1, -1}, {leaf.ratio, 1}}, leaf.mesh_from_leaf, out); break;
    case PrimitiveKind::torus: add_turned(around_circle({1, 0}, leaf.ratio), leaf.mesh_from_leaf, out); break;
    }
}

// A direction in the plane as one number in [-2, 2], without angles: the place on the square
// |x| + |y| = 1.
double turn_of(double x, double y) {
    const double s = std::abs(x) + std::abs(y);
    if (!(s > 0)) return 0;
    const double d = y / s;
    return x >= 0 ? d : y >= 0 ? 2 - d : -2 - d;
}
Vec2d direction_of(double turn) {
    double x, y;
    if (turn > 1)
        x = 1 - turn, y = 2 - turn;
    else if (turn < -1)
        x = 1 + turn, y = -2 - turn;
    else
        x = 1 - std::abs(turn), y = turn;
    const double l = std::sqrt(x * x + y * y);
    return {x / l, y / l};
}

/// The outward normal that a leaf's surface has in the mesh.
Vec3d mesh_normal(const PrimitiveLeaf& leaf, Vec3d n) {
    const Vec3d out = normalize(leaf.nx * n.x + leaf.ny * n.y + leaf.nz * n.z);
    return leaf.flipped ? -out : out;
}

} // namespace

std::uint32_t surface_count(PrimitiveKind kind) {
    switch (kind) {
    case PrimitiveKind::box: return 6;
    case PrimitiveKind::frustum: return 3;
    default: return 1;
    }
}

PrimitiveTree make_primitive(PrimitiveKind kind, double ratio, const Affine3d& mesh_from_leaf, std::uint32_t material) {
    PrimitiveTree tree;
    PrimitiveLeaf& leaf = tree.leaves.emplace_back();
    leaf.kind = kind;
    leaf.ratio = ratio;
    leaf.material = material;
    place(leaf, mesh_from_leaf);
    tree.leaf_of_surface.assign(surface_count(kind), 0);
    tree.nodes.push_back({.box = box_of(leaf, {})});
    tree.depth = 1;
    return tree;
}

PrimitiveTree combine(CsgOperation operation, std::span<const PrimitiveTree> children) {
    PrimitiveTree tree;
    tree.nodes.emplace_back();
    for (std::size_t i = 0; i < children.size(); ++i) {
        const PrimitiveTree& child = children[i];
        if (child.empty() || child.depth >= kMaxTreeDepth || tree.leaves.size() + child.leaves.size() > kMaxTreeLeaves)
            return {};
        const auto nodes = std::uint32_t(tree.nodes.size()), leaves = std::uint32_t(tree.leaves.size()),
                   surfaces = std::uint32_t(tree.leaf_of_surface.size());
        for (PrimitiveNode node : child.nodes) {
            node.leaf += leaves, node.end += nodes;
            tree.nodes.push_back(node);
        }
        for (PrimitiveLeaf leaf : child.leaves) {
            leaf.first_surface += surfaces;
            if (operation == CsgOperation::subtract && i > 0) leaf.flipped = !leaf.flipped;
            tree.leaves.push_back(leaf);
        }
        for (const std::uint32_t leaf : child.leaf_of_surface) tree.leaf_of_surface.push_back(leaf + leaves);
        tree.depth = std::max(tree.depth, child.depth + 1);
    }
    if (children.empty()) return {};
    PrimitiveNode& root = tree.nodes[0];
    root.operation = operation;
    root.end = std::uint32_t(tree.nodes.size());
    root.children = std::uint32_t(children.size());
    root.box = boxes_of(tree, {})[0];
    return tree;
}

PrimitiveTree placed(PrimitiveTree tree, const Affine3d& map) {
    for (PrimitiveLeaf& leaf : tree.leaves) place(leaf, map * leaf.mesh_from_leaf);
    const std::vector<Bounds3d> boxes = boxes_of(tree, {});
    for (std::size_t i = 0; i < boxes.size(); ++i) tree.nodes[i].box = boxes[i];
    return tree;
}

Bounds3d bounds(const PrimitiveTree& tree, const Affine3d& map) {
    return tree.empty() ? Bounds3d{} : boxes_of(tree, map)[0];
}

std::vector<Vec3f> hull_points(const PrimitiveTree& tree) {
    // What is only taken away adds nothing.
    std::vector<std::uint8_t> adds(tree.nodes.size(), 1);
    std::vector<Vec3d> points;
    for (std::uint32_t i = 0; i < tree.nodes.size(); ++i) {
        const PrimitiveNode& node = tree.nodes[i];
        if (node.operation == CsgOperation::leaf) {
            if (adds[i]) add_hull(tree.leaves[node.leaf], points);
            continue;
        }
        for_each_child(tree, i, [&](std::uint32_t c) {
            adds[c] = adds[i] && (node.operation != CsgOperation::subtract || c == i + 1);
        });
    }
    const Bounds3d box = tree.bounds();
    std::vector<Vec3f> out;
    if (box.empty()) return out;
    for (const Vec3d p : points) out.push_back(Vec3f(max(box.lower, min(box.upper, p))));
    return out;
}

Vec2f surface_coordinates(const PrimitiveTree& tree, std::uint32_t surface, Vec3d position) {
    const PrimitiveLeaf& leaf = tree.leaves[tree.leaf_of_surface[surface]];
    const std::uint32_t face = surface - leaf.first_surface;
    const Vec3d p = leaf.leaf_from_mesh.point(position);
    Vec2d c{};
    switch (leaf.kind) {
    case PrimitiveKind::sphere: {
        // The octahedron |x| + |y| + |z| = 1, its lower half folded outward.
        const double s = std::max(std::abs(p.x) + std::abs(p.y) + std::abs(p.z), 1e-300);
        c = {p.x / s, p.y / s};
        if (p.z < 0) c = {std::copysign(1 - std::abs(c.y), c.x), std::copysign(1 - std::abs(c.x), c.y)};
        break;
    }
    case PrimitiveKind::box: {
        const int axis = int(face / 2);
        c = {p[(axis + 1) % 3], p[(axis + 2) % 3]};
        break;
    }
    case PrimitiveKind::frustum:
        if (face == 0)
            c = {p.y, turn_of(p.x, p.z)};
        else
            c = {p.x, p.z};
        break;
    case PrimitiveKind::torus: c = {turn_of(p.x, p.z), turn_of(std::sqrt(p.x * p.x + p.z * p.z) - 1, p.y)}; break;
    }
    return {float(std::clamp(c.x, -2.0, 2.0)), float(std::clamp(c.y, -2.0, 2.0))};
}

PrimitivePoint surface_point(const PrimitiveTree& tree, std::uint32_t surface, Vec2f coordinates) {
    const PrimitiveLeaf& leaf = tree.leaves[tree.leaf_of_surface[surface]];
    const std::uint32_t face = surface - leaf.first_surface;
    const double u = double(coordinates.x), v = double(coordinates.y);
    Vec3d p, n;
    switch (leaf.kind) {
    case PrimitiveKind::sphere: {
        const double z = 1 - std::abs(u) - std::abs(v);
        const double x = z < 0 ? std::copysign(1 - std::abs(v), u) : u;
        const double y = z < 0 ? std::copysign(1 - std::abs(u), v) : v;
        p = n = Vec3d{x, y, z} / std::sqrt(x * x + y * y + z * z);
        break;
    }
    case PrimitiveKind::box: {
        const int axis = int(face / 2);
        const double side = face % 2 == 0 ? -1 : 1;
        p[axis] = n[axis] = side;
        p[(axis + 1) % 3] = u, p[(axis + 2) % 3] = v;
        break;
    }
    case PrimitiveKind::frustum: {
        if (face == 0) {

            const Vec2d d = direction_of(v);
            const double r = frustum_radius(leaf.ratio, u);
            p = {r * d.x, u, r * d.y}, n = {d.x, 0.5 * (1 - leaf.ratio), d.y};
        } else {
            const double side = face == 1 ? -1 : 1;
            p = {u, side, v}, n = {0, side, 0};
        }
        break;
    }
    case PrimitiveKind::torus: {
        const Vec2d around = direction_of(u), tube = direction_of(v);
        const double r = 1 + leaf.ratio * tube.x;
        p = {r * around.x, leaf.ratio * tube.y, r * around.y};
        n = {tube.x * around.x, tube.y, tube.x * around.y};
        break;
    }
    }
    return {leaf.mesh_from_leaf.point(p), mesh_normal(leaf, n)};
}

std::vector<Vec3d> surface_samples(const PrimitiveTree& tree, int count) {
    std::vector<Vec3d> out;
    const Bounds3d box = tree.bounds();
    if (box.empty()) return out;
    // Lines that are spread evenly over all lines through a ball meet every surface in it evenly.
    std::mt19937_64 random(1);
    const auto signed_unit = [&] { return 2 * (double(random() >> 11) * 0x1p-53) - 1; };
    const auto in_ball = [&](double flat) {
        for (;;)
            if (const Vec3d v{signed_unit(), signed_unit(), flat * signed_unit()}; dot(v, v) < 1) return v;
    };
    std::vector<PrimitiveCrossing> crossings;
    for (int line = 0; line < 32 * count && int(out.size()) < count; ++line) {
        const Vec3d direction = normalize(in_ball(1));
        const Vec3d side = normalize(cross(direction, std::abs(direction.x) < 0.7 ? Vec3d{1, 0, 0} : Vec3d{0, 1, 0}));
        const Vec3d disc = in_ball(0);
        const Vec3d origin = box.center() + (side * disc.x + cross(direction, side) * disc.y) * (0.5 * box.diagonal());
        find_crossings(tree, origin, direction, crossings);
        for (const PrimitiveCrossing& c : crossings)
            if (int(out.size()) < count) out.push_back(origin + direction * c.t);
    }
    return out;
}

} // namespace porthole
