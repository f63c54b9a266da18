// Crossings against what the solids' definitions say at points of the line.
#include "porthole/scene/primitive.h"

#include <array>
#include <cmath>
#include <functional>
#include <random>

#include <gtest/gtest.h>

namespace porthole {
namespace {

using Random = std::mt19937_64;

double uniform(Random& random, double low, double high) {
    return std::uniform_real_distribution<double>(low, high)(random);
}
Vec3d random_vector(Random& random, double size) {
    return {uniform(random, -size, size), uniform(random, -size, size), uniform(random, -size, size)};
}
Vec3d random_direction(Random& random) {
    for (;;)
        if (const Vec3d v = random_vector(random, 1); length(v) > 0.1 && length(v) < 1) return v;
}

/// Below 0 inside the unit shape.
double implicit(PrimitiveKind kind, double ratio, Vec3d p) {
    const double around = std::hypot(p.x, p.z);
    switch (kind) {
    case PrimitiveKind::sphere: return std::hypot(p.x, p.y, p.z) - 1;
    case PrimitiveKind::box: return std::max({std::abs(p.x), std::abs(p.y), std::abs(p.z)}) - 1;
    case PrimitiveKind::frustum: return std::max(std::abs(p.y) - 1, around - (1 + (ratio - 1) * (p.y + 1) / 2));
    case PrimitiveKind::torus: break;
    }
    return std::hypot(around - 1, p.y) - ratio;
}

struct Shape {
    PrimitiveKind kind;
    double ratio;
};
const Shape kShapes[] = {
    {PrimitiveKind::sphere, 0},     {PrimitiveKind::box, 0},       {PrimitiveKind::frustum, 1},
    {PrimitiveKind::frustum, 0.4},  {PrimitiveKind::frustum, 0},   {PrimitiveKind::torus, 0.3},
    {PrimitiveKind::torus, 0.9999}, {PrimitiveKind::torus, 0.001}, {PrimitiveKind::frustum, 0.999999},
};

Affine3d random_placement(Random& random, double stretch = 4) {
    for (;;) {
        const Affine3d m{random_vector(random, 1), random_vector(random, 1), random_vector(random, 1),
                         random_vector(random, 1)};
        const double volume = std::abs(m.determinant()) / (length(m.x) * length(m.y) * length(m.z));
        const double longest = std::max({length(m.x), length(m.y), length(m.z)});
        if (volume > 0.2 && std::min({length(m.x), length(m.y), length(m.z)}) * stretch > longest) return m;
    }
}

using Solid = std::function<double(Vec3d)>; ///< below 0 inside

Solid solid_of(Shape shape, const Affine3d& placement) {
    return [=, leaf_from_mesh = inverse(placement)](Vec3d p) {
        return implicit(shape.kind, shape.ratio, leaf_from_mesh.point(p));
    };
}

/// Checks the crossings of one line against the solid at `samples` points of it; returns how
/// many crossings there were.
std::size_t expect_crossings(const PrimitiveTree& tree, const Solid& solid, Vec3d origin, Vec3d direction, int samples,
                             double exact) {
    std::vector<PrimitiveCrossing> list;
    find_crossings(tree, origin, direction, list);
    const auto at = [&](double t) { return origin + direction * t; };
    EXPECT_EQ(list.size() % 2, 0u);
    for (std::size_t i = 0; i < list.size(); ++i) {
        EXPECT_EQ(list[i].entering, i % 2 == 0);
        if (i > 0) {
            EXPECT_LE(list[i - 1].t, list[i].t);
        }
        EXPECT_NEAR(solid(at(list[i].t)), 0, exact);
        EXPECT_LT(list[i].surface, tree.leaf_of_surface.size());
    }
    const double middle = -dot(origin, direction) / dot(direction, direction), reach = 4 / length(direction);
    std::size_t next = 0;
    for (int i = 0; i <= samples; ++i) {
        const double t = middle + reach * (2.0 * i / samples - 1);
        while (next < list.size() && list[next].t < t) ++next;
        const double f = solid(at(t));
        if (std::abs(f) < exact) continue;
        if ((f < 0) != (next % 2 == 1)) {
            ADD_FAILURE() << "at t = " << t << " the solid is " << f << " after " << next << " crossings of "
                          << list.size();
            break;
        }
    }
    return list.size();
}

TEST(Primitive, CrossingsAreThoseOfTheDefinition) {
    Random random(1);
    for (const Shape& shape : kShapes) {
        std::size_t met = 0;
        for (int i = 0; i < 2000; ++i) {
            const Affine3d placement = random_placement(random);
            const PrimitiveTree tree = make_primitive(shape.kind, shape.ratio, placement);
            // Towards a point of the shape, from anywhere; every tenth along an axis of it.
            const double far = i % 3 == 0 ? 1000 : 3;
            Vec3d direction = i % 10 == 0 ? (i % 20 == 0 ? placement.y : placement.x) : random_direction(random);
            if (i % 7 == 0) direction = direction * 1e-3;
            const Vec3d through = placement.point(random_vector(random, shape.ratio < 0.01 ? 0.1 : 1.2) +
                                                  (shape.ratio == 0.001 ? Vec3d{1, 0, 0} : Vec3d{}));
            const Vec3d origin = through - direction * (far * uniform(random, -1, 1) / length(direction));
            met += expect_crossings(tree, solid_of(shape, placement), origin, direction, 400, 1e-9);
        }
        EXPECT_GT(met, shape.ratio == 0.001 ? 5u : 1000u);
    }
}

TEST(Primitive, LinesInTheAxesMeetWhatTheyShould) {
    std::vector<PrimitiveCrossing> list;
    const PrimitiveTree cone = make_primitive(PrimitiveKind::frustum, 0, {});
    find_crossings(cone, {0, 5, 0}, {0, -1, 0}, list);
    ASSERT_EQ(list.size(), 2u) << "through the tip";
    EXPECT_NEAR(list[0].t, 4, 1e-12);
    EXPECT_NEAR(list[1].t, 6, 1e-12);
    EXPECT_EQ(list[1].surface, 1u) << "the bottom";
    find_crossings(cone, {-5, 0, 0}, {1, 0, 0}, list);
    ASSERT_EQ(list.size(), 2u);
    EXPECT_NEAR(list[0].t, 4.5, 1e-12);

    const PrimitiveTree torus = make_primitive(PrimitiveKind::torus, 0.25, {});
    find_crossings(torus, {-5, 0, 0}, {1, 0, 0}, list);
    ASSERT_EQ(list.size(), 4u);
    const double expected[] = {3.75, 4.25, 5.75, 6.25};
    for (std::size_t i = 0; i < 4; ++i) EXPECT_NEAR(list[i].t, expected[i], 1e-12);
    find_crossings(torus, {0, 5, 0}, {0, -1, 0}, list);
    EXPECT_TRUE(list.empty()) << "through the hole";
    find_crossings(torus, {1, 5, 0}, {0, -1, 0}, list);
    ASSERT_EQ(list.size(), 2u);
    EXPECT_NEAR(list[0].t, 4.75, 1e-12);

    // Two boxes that share a face share no line in its plane.
    const PrimitiveTree left = make_primitive(PrimitiveKind::box, 0, {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}, {-1, 0, 0}});
    const PrimitiveTree right = make_primitive(PrimitiveKind::box, 0, {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}, {1, 0, 0}});
    std::size_t met = 0;
    for (const PrimitiveTree* box : {&left, &right}) {
        find_crossings(*box, {0, 0, 9}, {0, 0, -1}, list);
        met += list.size();
    }
    EXPECT_EQ(met, 2u);
}

TEST(Primitive, LinesThroughTheTipOfAConeMeetItTwice) {
    Random random(8);
    std::vector<PrimitiveCrossing> list;
    for (int i = 0; i < 3000; ++i) {
        const Affine3d placement = random_placement(random);
        const PrimitiveTree cone = make_primitive(PrimitiveKind::frustum, 0, placement);
        // Well inside, so that rounding at the tip cannot make the line miss.
        const double r = uniform(random, 0, 0.9), a = uniform(random, 0, 6.28);
        const Vec3d foot = placement.point({r * std::cos(a), -1, r * std::sin(a)}), tip = placement.point({0, 1, 0});
        const Vec3d direction = i % 2 == 0 ? tip - foot : foot - tip;
        const Vec3d origin = foot - direction * uniform(random, 0, 3);
        find_crossings(cone, origin, direction, list);
        ASSERT_EQ(list.size(), 2u);
        EXPECT_NEAR(list[1].t - list[0].t, 1, 1e-6);
    }
}

/// A tree and its definition, made at random.
struct Made {
    PrimitiveTree tree;
    Solid solid;
};
Made random_tree(Random& random, int levels) {
    if (levels == 0) {
        const Shape shape = kShapes[std::uniform_int_distribution<std::size_t>(0, 5)(random)];
        const Affine3d placement = random_placement(random);
        return {make_primitive(shape.kind, shape.ratio, placement), solid_of(shape, placement)};
    }
    const int operation = std::uniform_int_distribution<int>(0, 2)(random);
    std::vector<PrimitiveTree> children;
    std::vector<Solid> solids;
    const int count = std::uniform_int_distribution<int>(1, 3)(random);
    for (int i = 0; i < count; ++i) {
        Made child = random_tree(random, levels - 1);
        children.push_back(std::move(child.tree)), solids.push_back(std::move(child.solid));
    }
    const CsgOperation kOperations[] = {CsgOperation::unite, CsgOperation::intersect, CsgOperation::subtract};
    Made made{combine(kOperations[operation], children), [=](Vec3d p) {
                  double f = solids[0](p);
                  for (std::size_t i = 1; i < solids.size(); ++i) {
                      const double g = solids[i](p);
                      f = operation == 0 ? std::min(f, g) : operation == 1 ? std::max(f, g) : std::max(f, -g);
                  }
                  return f;
              }};
    if (uniform(random, 0, 1) < 0.3) {
        const Affine3d map = random_placement(random, 2);
        made.tree = placed(std::move(made.tree), map);
        made.solid = [inner = made.solid, back = inverse(map)](Vec3d p) { return inner(back.point(p)); };
    }
    return made;
}

TEST(Primitive, TreesAreWhatTheirPartsMake) {
    Random random(2);
    std::size_t met = 0;
    for (int i = 0; i < 400; ++i) {
        const Made made = random_tree(random, 1 + i % 3);
        ASSERT_FALSE(made.tree.empty());
        for (int k = 0; k < 10; ++k) {
            const Vec3d direction = random_direction(random);
            const Vec3d origin = random_vector(random, 1) - direction * uniform(random, 0, 5);
            met += expect_crossings(made.tree, made.solid, origin, direction, 200, 1e-7);
        }
    }
    EXPECT_GT(met, 2000u);
}

TEST(Primitive, StretchesAreThoseOfTheWholeLine) {
    Random random(6);
    std::vector<PrimitiveCrossing> whole, part;
    std::size_t met = 0;
    for (int i = 0; i < 400; ++i) {
        const Made made = random_tree(random, i % 4);
        for (int k = 0; k < 100; ++k) {
            const Vec3d origin = random_vector(random, 1), direction = random_direction(random);
            const double t0 = uniform(random, -3, 2), t1 = t0 + uniform(random, 0, 2);
            find_crossings(made.tree, origin, direction, whole);
            find_crossings(made.tree, origin, direction, t0, t1, part);
            std::erase_if(whole, [&](const PrimitiveCrossing& c) { return c.t < t0 || c.t > t1; });
            ASSERT_EQ(part.size(), whole.size());
            for (std::size_t n = 0; n < part.size(); ++n) {
                EXPECT_EQ(part[n].t, whole[n].t);
                EXPECT_EQ(part[n].surface, whole[n].surface);
                EXPECT_EQ(part[n].entering, whole[n].entering);
            }
            met += part.size();
        }
    }
    EXPECT_GT(met, 2000u);
}

TEST(Primitive, BoxesAndHullsHoldTheSurface) {
    Random random(3);
    std::vector<PrimitiveCrossing> list;
    for (int i = 0; i < 300; ++i) {
        const Made made = random_tree(random, i % 3);
        const Affine3d map = random_placement(random);
        const Bounds3d box = made.tree.bounds(), mapped = bounds(made.tree, map);
        Bounds3d hull;
        for (const Vec3f p : hull_points(made.tree)) {
            hull.extend(Vec3d(p));
            for (int axis = 0; axis < 3; ++axis) {
                EXPECT_GE(double(p[axis]), box.lower[axis] - 1e-6);
                EXPECT_LE(double(p[axis]), box.upper[axis] + 1e-6);
            }
        }
        const auto holds = [](const Bounds3d& b, Vec3d p, double slack) {
            return min(p, b.lower - Vec3d{slack, slack, slack}) == b.lower - Vec3d{slack, slack, slack} &&
                   max(p, b.upper + Vec3d{slack, slack, slack}) == b.upper + Vec3d{slack, slack, slack};
        };
        for (int k = 0; k < 20; ++k) {
            const Vec3d origin = random_vector(random, 1), direction = random_direction(random);
            find_crossings(made.tree, origin, direction, list);
            for (const PrimitiveCrossing& c : list) {
                const Vec3d p = origin + direction * c.t;
                EXPECT_TRUE(holds(box, p, 1e-9));
                EXPECT_TRUE(holds(hull, p, 1e-5));
                EXPECT_TRUE(holds(mapped, map.point(p), 1e-9));
            }
        }
    }
    // Tight for single primitives.
    Affine3d turned{{std::sqrt(0.5), std::sqrt(0.5), 0}, {-std::sqrt(0.5), std::sqrt(0.5), 0}, {0, 0, 1}, {}};
    EXPECT_NEAR(make_primitive(PrimitiveKind::sphere, 0, turned).bounds().upper.x, 1, 1e-12);
    EXPECT_NEAR(make_primitive(PrimitiveKind::box, 0, turned).bounds().upper.x, std::sqrt(2), 1e-12);
    EXPECT_NEAR(make_primitive(PrimitiveKind::frustum, 0, turned).bounds().lower.x, -std::sqrt(0.5), 1e-12)
        << "the tip";
    EXPECT_NEAR(make_primitive(PrimitiveKind::torus, 0.25, turned).bounds().upper.x, std::sqrt(0.5) + 0.25, 1e-12);
}

TEST(Primitive, PointsComeBackFromTheirCoordinates) {
    Random random(4);
    std::vector<PrimitiveCrossing> list;
    int checked = 0;
    for (int i = 0; i < 600; ++i) {
        const Made made = random_tree(random, i % 3);
        for (int k = 0; k < 10; ++k) {
            const Vec3d origin = random_vector(random, 1), direction = random_direction(random);
            find_crossings(made.tree, origin, direction, list);
            for (const PrimitiveCrossing& c : list) {
                const Vec3d p = origin + direction * c.t;
                const Vec2f uv = surface_coordinates(made.tree, c.surface, p);
                EXPECT_LE(std::max(std::abs(uv.x), std::abs(uv.y)), 2.0f);
                const PrimitivePoint back = surface_point(made.tree, c.surface, uv);
                const PrimitiveLeaf& leaf = made.tree.leaves[made.tree.leaf_of_surface[c.surface]];
                const Affine3d& m = leaf.mesh_from_leaf;
                const double size = std::max({length(m.x), length(m.y), length(m.z)});
                EXPECT_LT(length(back.position - p), 2e-6 * size) << int(leaf.kind);
                EXPECT_NEAR(length(back.normal), 1, 1e-12);
                EXPECT_NEAR(made.solid(back.position), 0, 1e-5);
                const double facing = dot(back.normal, direction) / length(direction);
                if (std::abs(facing) > 1e-4) {
                    EXPECT_EQ(facing < 0, c.entering) << facing;
                    ++checked;
                }
                // Outward: a small step along the normal leaves the solid, but for edges.
                const double step = 1e-5;
                if (std::abs(facing) > 0.1 &&
                    made.solid(p + direction * (step * 10)) * made.solid(p - direction * (step * 10)) < 0) {
                    EXPECT_LT(made.solid(p - back.normal * step), made.solid(p + back.normal * step));
                }
            }
        }
    }
    EXPECT_GT(checked, 3000);
}

TEST(Primitive, WhatIsTakenAwayTwiceIsWhole) {
    // A ball less a hollow in which a smaller ball is left.
    const auto ball = [](double r) {
        return make_primitive(PrimitiveKind::sphere, 0, {{r, 0, 0}, {0, r, 0}, {0, 0, r}, {}});
    };
    const PrimitiveTree gap[] = {ball(0.8), ball(0.5)};
    const PrimitiveTree tree =
        combine(CsgOperation::subtract, std::array{ball(1), combine(CsgOperation::subtract, gap)});
    std::vector<PrimitiveCrossing> list;
    find_crossings(tree, {0, 0, 3}, {0, 0, -1}, list);
    const double at[] = {2, 2.2, 2.5, 3.5, 3.8, 4}, up[] = {1, -1, 1, -1, 1, -1};
    ASSERT_EQ(list.size(), 6u);
    for (std::size_t i = 0; i < 6; ++i) {
        EXPECT_NEAR(list[i].t, at[i], 1e-12);
        const Vec2f uv = surface_coordinates(tree, list[i].surface, {0, 0, 3 - list[i].t});
        EXPECT_NEAR(surface_point(tree, list[i].surface, uv).normal.z, up[i], 1e-12) << i;
    }
}

TEST(Primitive, HullsLeaveOutWhatIsTakenAway) {
    const PrimitiveTree cut[] = {make_primitive(PrimitiveKind::sphere, 0, {}),
                                 make_primitive(PrimitiveKind::box, 0, {{9, 0, 0}, {0, 9, 0}, {0, 0, 9}, {0, 9.5, 0}})};
    for (const Vec3f p : hull_points(combine(CsgOperation::subtract, cut))) EXPECT_LT(length(p), 1.02f);
}

TEST(Primitive, SamplesAreSpreadOverTheSurface) {
    const PrimitiveTree box = make_primitive(PrimitiveKind::box, 0, {{1, 0, 0}, {0, 2, 0}, {0, 0, 3}, {5, 0, 0}});
    const std::vector<Vec3d> points = surface_samples(box, 6000);
    ASSERT_EQ(points.size(), 6000u);
    int on_x = 0, right = 0;
    for (const Vec3d& p : points) {
        const Vec3d q{std::abs(p.x - 5), std::abs(p.y) / 2, std::abs(p.z) / 3};
        EXPECT_NEAR(std::max({q.x, q.y, q.z}), 1, 1e-12);
        on_x += q.x > 1 - 1e-9, right += p.x > 5;
    }
    EXPECT_NEAR(on_x / 6000.0, 6 / 11.0, 0.03) << "by area";
    EXPECT_NEAR(right / 6000.0, 0.5, 0.03);
    EXPECT_TRUE(surface_samples({}, 10).empty());
}

TEST(Primitive, FacesInOnePlaneLeaveNoFilm) {
    // A drilled plate: the drill is exactly as long as the plate is thick. Then the same, turned.
    const auto box = [](Vec3d half) {
        return make_primitive(PrimitiveKind::box, 0, {{half.x, 0, 0}, {0, half.y, 0}, {0, 0, half.z}, {}});
    };
    const PrimitiveTree drill = make_primitive(PrimitiveKind::frustum, 1, {{0.3, 0, 0}, {0, 0.1, 0}, {0, 0, 0.3}, {}});
    const PrimitiveTree plate[] = {box({1, 0.1, 1}), drill};
    Random random(5);
    std::vector<PrimitiveCrossing> list;
    for (int i = 0; i < 2000; ++i) {
        const Affine3d map = i % 2 == 0 ? Affine3d{} : random_placement(random);
        const PrimitiveTree tree = placed(combine(CsgOperation::subtract, plate), map);
        const double r = uniform(random, 0, 0.28), a = uniform(random, 0, 6.28);
        const Vec3d through{r * std::cos(a), 0, r * std::sin(a)};
        find_crossings(tree, map.point(through + Vec3d{0, 2, 0}), map.vector({0, -1, 0}), list);
        EXPECT_TRUE(list.empty()) << list.size();
    }
    // What coincides is the first child's; nothing is left of a solid less itself.
    const PrimitiveTree same[] = {box({1, 1, 1}), box({1, 1, 1})};
    for (const CsgOperation operation : {CsgOperation::unite, CsgOperation::intersect}) {
        const PrimitiveTree tree = combine(operation, same);
        find_crossings(tree, {0.2, 0.3, 5}, {0, 0, -1}, list);
        ASSERT_EQ(list.size(), 2u);
        EXPECT_EQ(list[0].surface, 5u);
        EXPECT_EQ(list[1].surface, 4u);
    }
    find_crossings(combine(CsgOperation::subtract, same), {0.2, 0.3, 5}, {0.01, 0.02, -1}, list);
    EXPECT_TRUE(list.empty());
    // Two boxes side by side are one.
    const PrimitiveTree beside[] = {box({1, 1, 1}),
                                    placed(box({1, 1, 1}), {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}, {2, 0, 0}})};
    find_crossings(combine(CsgOperation::unite, beside), {-5, 0.1, 0.2}, {1, 0, 0}, list);
    EXPECT_EQ(list.size(), 2u);
}

TEST(Primitive, LimitsAreKept) {
    PrimitiveTree tree = make_primitive(PrimitiveKind::sphere, 0, {});
    for (std::uint32_t i = 1; i < kMaxTreeDepth; ++i) {
        tree = combine(CsgOperation::unite, std::array{tree});
        ASSERT_EQ(tree.depth, i + 1);
    }
    std::vector<PrimitiveCrossing> list;
    find_crossings(tree, {0, 0, 3}, {0, 0, -1}, list);
    EXPECT_EQ(list.size(), 2u) << "the deepest tree there is";
    EXPECT_TRUE(combine(CsgOperation::unite, std::array{tree}).empty());
    EXPECT_TRUE(combine(CsgOperation::unite, {}).empty());

    std::vector<PrimitiveTree> many(kMaxTreeLeaves, make_primitive(PrimitiveKind::sphere, 0, {}));
    const PrimitiveTree full = combine(CsgOperation::intersect, many);
    find_crossings(full, {0, 0, 3}, {0, 0, -1}, list);
    EXPECT_EQ(list.size(), 2u);
    many.push_back(many[0]);
    EXPECT_TRUE(combine(CsgOperation::intersect, many).empty());
}

TEST(Primitive, OperandsApartMakeNothing) {
    const PrimitiveTree apart[] = {
        make_primitive(PrimitiveKind::sphere, 0, {}),
        make_primitive(PrimitiveKind::sphere, 0, {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}, {0, 3, 0}})};
    const PrimitiveTree tree = combine(CsgOperation::intersect, apart);
    EXPECT_TRUE(tree.bounds().empty());
    EXPECT_TRUE(hull_points(tree).empty());
    std::vector<PrimitiveCrossing> list;
    find_crossings(tree, {0, 9, 0}, {0, -1, 0}, list);
    EXPECT_TRUE(list.empty());
}

} // namespace
} // namespace porthole
