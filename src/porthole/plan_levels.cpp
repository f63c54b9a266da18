// Which parts of the cut set open together, step by step of the rim.
#include <algorithm>
#include <cmath>
#include <map>

#include "porthole/plan_steps.h"

namespace porthole {

namespace {

constexpr double kLayerShare = 0.7; ///< of the core over which a layer has to enclose the floor
constexpr float kLeastGapPx = 4;    ///< layers closer together than this open together
constexpr float kLeastStepPx = 6;   ///< narrower steps cannot be told apart
constexpr std::size_t kMostSteps = 4;
constexpr std::int64_t kSamples = 2000; ///< of the core's pixels, about; all if there are fewer

/// Some pixels of the core, evenly spread. Which ones depends on the core alone.
std::vector<Vec2i> sampled(const Image<PartId>& core) {
    const auto none = std::count(core.pixels().begin(), core.pixels().end(), kNoPart);
    const std::int64_t n = std::int64_t(core.pixels().size()) - none;
    const int stride = std::max(1, int(std::sqrt(double(n) / double(kSamples))));
    std::vector<Vec2i> pixels;
    const Rect w = core.window();
    for (int y = w.y0; y < w.y1; ++y)
        for (int x = w.x0; x < w.x1; ++x)
            if (x % stride == 0 && y % stride == 0 && core(x, y) != kNoPart) pixels.push_back({x, y});
    return pixels;
}

struct Layer {
    PartId part = kNoPart;
    double first = 0; ///< mean depth of its first surface
};

/// The parts that the floor lies within nearly everywhere, from the outside in.
std::vector<Layer> enclosing_layers(const std::vector<std::vector<PartExtent>>& extents, std::span<const Vec2i> pixels,
                                    const Image<float>& floor) {
    struct Found {
        std::size_t around = 0, pixels = 0;
        double first = 0;
    };
    std::map<PartId, Found> found;
    for (std::size_t i = 0; i < pixels.size(); ++i) {
        const float z = floor(pixels[i].x, pixels[i].y);
        for (const PartExtent& e : extents[i]) {
            Found& f = found[e.part];
            f.around += e.first < z && z < e.last;
            f.first += double(e.first);
            ++f.pixels;
        }
    }
    std::vector<Layer> layers;
    for (const auto& [part, f] : found)
        if (double(f.around) >= kLayerShare * double(pixels.size()))
            layers.push_back({part, f.first / double(f.pixels)});
    std::stable_sort(layers.begin(), layers.end(), [](const Layer& a, const Layer& b) { return a.first < b.first; });
    return layers;
}

/// Takes out the layer nearest behind the one outside it until all are `least` metres apart and no more
/// than `most`.
void thin_out(std::vector<Layer>& layers, std::size_t most, double least) {
    while (layers.size() > 1) {
        std::size_t closest = 1;
        const auto gap = [&](std::size_t i) { return layers[i].first - layers[i - 1].first; };
        for (std::size_t i = 2; i < layers.size(); ++i)
            if (gap(i) < gap(closest)) closest = i;
        if (layers.size() <= most && gap(closest) >= least) return;
        layers.erase(layers.begin() + std::ptrdiff_t(closest));
    }
}

} // namespace

std::size_t find_levels(const Subject& subject, const Bvh& cut_bvh, ViewPlan& plan, const Control& control) {
    const std::vector<Vec2i> pixels = sampled(plan.core.id);
    const auto extents = trace_extents(cut_bvh, plan.view, pixels, control, &plan.rays.walls);
    std::vector<Layer> layers = enclosing_layers(extents, pixels, plan.core.depth);
    if (layers.size() < 2) return 1;

    std::vector<float> widths;
    for (const BandPixel& c : plan.hole.band)
        if (c.covered) widths.push_back(c.width_px);
    if (widths.empty()) return 1;
    std::nth_element(widths.begin(), widths.begin() + std::ptrdiff_t(widths.size() / 2), widths.end());
    const auto room = std::size_t(std::max(1.0f, widths[widths.size() / 2] / kLeastStepPx));
    thin_out(layers, std::min(room, kMostSteps),
             double(kLeastGapPx * plan.view.pixel_size(float(layers.front().first))));
    if (layers.size() < 2) return 1;

    // Of every part, on how many rays which layer begins in front of it.
    struct Order {
        int rays = 0;
        std::vector<int> behind;
    };
    std::map<PartId, Order> orders;
    for (const std::vector<PartExtent>& ray : extents)
        for (const PartExtent& e : ray) {
            Order& order = orders[e.part];
            order.behind.resize(layers.size(), 0);
            ++order.rays;
            for (std::size_t k = 0; k < layers.size(); ++k)
                order.behind[k] += std::any_of(ray.begin(), ray.end(), [&](const PartExtent& layer) {
                    return layer.part == layers[k].part && layer.first <= e.first;
                });
        }
    plan.cut.level.assign(subject.scene().parts.size(), 0);
    for (const PartId part : plan.cut_set) {
        std::uint8_t& level = plan.cut.level[index(part)];
        const auto order = orders.find(part);
        const float middle = plan.view.project(Vec3f(part_bounds(subject.scene(), part).center())).depth;
        for (std::size_t k = 1; k < layers.size(); ++k) {
            const bool behind = order == orders.end() ? layers[k].first <= double(middle) // too small for the samples
                                                      : 2 * order->second.behind[k] >= order->second.rays;
            if (behind) level = std::uint8_t(k);
        }
    }
    for (std::size_t k = 0; k < layers.size(); ++k) plan.cut.level[index(layers[k].part)] = std::uint8_t(k);
    return layers.size();
}

} // namespace porthole
