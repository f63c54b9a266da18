// Animations, sampled at one moment.
#include <algorithm>
#include <cmath>

#include "porthole/io/gltf_node.h"

namespace porthole::gltf {
namespace {

Quaternion slerp(Quaternion a, Quaternion b, double t) {
    double c = a.x * b.x + a.y * b.y + a.z * b.z + a.w * b.w;
    if (c < 0) { // the shorter way round
        b = {-b.x, -b.y, -b.z, -b.w};
        c = -c;
    }
    double u = 1 - t, v = t;
    if (c < 0.9999999) {
        const double angle = std::acos(c), s = std::sin(angle);
        u = std::sin(u * angle) / s;
        v = std::sin(v * angle) / s;
    }
    return normalize(Quaternion{a.x * u + b.x * v, a.y * u + b.y * v, a.z * u + b.z * v, a.w * u + b.w * v});
}

struct Curve {
    std::vector<float> times, values;
    Interpolation interpolation = Interpolation::linear;
};

// The curve of a sampler for `width` values per key; false after a warning when it has none.
bool read_curve(Document& doc, std::span<const Accessor> accessors, const Json& sampler, std::size_t width,
                std::uint64_t& key_budget, Curve& curve) {
    const Accessor& input = accessors[doc.need_index(sampler, "input", accessors.size(), "accessor")];
    const Accessor& output = accessors[doc.need_index(sampler, "output", accessors.size(), "accessor")];
    const std::string_view name = doc.string_or(sampler, "interpolation", "LINEAR");
    if (name == "STEP")
        curve.interpolation = Interpolation::step;
    else if (name == "CUBICSPLINE")
        curve.interpolation = Interpolation::cubic;
    else if (name != "LINEAR")
        doc.warn("W0309", sampler, "interpolation", "is \"" + shortened(name) + "\"; LINEAR is used");

    const std::uint64_t per_key = width * (curve.interpolation == Interpolation::cubic ? 3 : 1);
    if (input.components != 1 || output.components == 0 ||
        input.count * per_key != output.count * std::uint64_t(output.components)) {
        doc.warn("W0309", sampler, {},
                 "has " + std::to_string(input.count) + " times and " + std::to_string(output.count) +
                     " values, which do not fit; the channel is left out");
        return false;
    }
    if (input.count > key_budget)
        doc.fail_limit(sampler, "input", "the channels together have more keys than the file has bytes");
    key_budget -= input.count;
    curve.times.resize(input.count);
    curve.values.resize(input.count * per_key);
    read_floats(input, 0, input.count, 1, curve.times.data());
    read_floats(output, 0, output.count, output.components, curve.values.data());
    const auto finite = [](float v) { return std::isfinite(v); };
    if (!std::is_sorted(curve.times.begin(), curve.times.end()) ||
        !std::all_of(curve.times.begin(), curve.times.end(), finite) ||
        !std::all_of(curve.values.begin(), curve.values.end(), finite)) {
        doc.warn("W0309", sampler, {}, "times decrease, or a value is not finite; the channel is left out");
        return false;
    }
    return true;
}

std::size_t target_count(const Document& doc, const Node& node) {
    if (node.mesh == kNone) return 0;
    const std::span<const Json> primitives = doc.list(doc.element("meshes", std::size_t(node.mesh)), "primitives");
    return primitives.empty() || !primitives[0].is_object() ? 0 : doc.list(primitives[0], "targets").size();
}

void apply_channel(Document& doc, std::span<const Accessor> accessors, std::span<const Json> samplers,
                   const Json& channel, double time, std::uint64_t& key_budget, std::vector<Node>& nodes) {
    const Json* target = doc.object(channel, "target");
    if (!target) doc.fail("E0303", channel, {}, "has no \"target\", which glTF requires");
    const std::string_view path = doc.string_or(*target, "path");
    const auto node_index = doc.index(*target, "node", nodes.size(), "node");
    if (!node_index) {
        if (path == "pointer")
            doc.warn("W0309", *target, {}, "KHR_animation_pointer is not supported; the channel is left out");
        return; // glTF: a channel without a node is ignored
    }
    Node& node = nodes[*node_index];
    const std::size_t width = path == "translation" || path == "scale" ? 3
                              : path == "rotation"                     ? 4
                              : path == "weights"                      ? target_count(doc, node)
                                                                       : 0;
    if (width == 0) {
        doc.warn("W0309", *target, "path",
                 "\"" + shortened(path) + "\" cannot be animated here; the channel is left out");
        return;
    }
    if (node.has_matrix && path != "weights") {
        doc.warn("W0309", *target, "node",
                 "node " + std::to_string(*node_index) +
                     " has a matrix, which cannot be animated; the channel is left out");
        return;
    }
    Curve curve;
    const std::uint32_t sampler = doc.need_index(channel, "sampler", samplers.size(), "sampler");
    if (!read_curve(doc, accessors, samplers[sampler], width, key_budget, curve)) return;
    const std::vector<double> v =
        sample_curve(curve.times, curve.values, int(width), curve.interpolation, path == "rotation", time);
    if (path == "translation")
        node.translation = {v[0], v[1], v[2]};
    else if (path == "scale")
        node.scale = {v[0], v[1], v[2]};
    else if (path == "rotation")
        node.rotation = {v[0], v[1], v[2], v[3]};
    else
        node.weights.assign(v.begin(), v.end());
}

} // namespace

std::vector<double> sample_curve(std::span<const float> times, std::span<const float> values, int width,
                                 Interpolation interpolation, bool rotation, double time) {
    const std::size_t w = std::size_t(width), keys = times.size();
    const bool cubic = interpolation == Interpolation::cubic;
    // part 0: in-tangent, 1: value, 2: out-tangent of a spline's key.
    const auto at = [&](std::size_t key, std::size_t part, std::size_t k) {
        return double(values[(cubic ? key * 3 + part : key) * w + k]);
    };
    // The segment [i, i + 1] that holds `time`; outside, the first or last key alone.
    const auto after =
        std::upper_bound(times.begin(), times.end(), time, [](double t, float key) { return t < double(key); });
    const std::size_t next = std::size_t(after - times.begin());
    const std::size_t i = next == 0 ? 0 : next - 1;
    std::vector<double> out(w);
    if (next == 0 || next == keys || interpolation == Interpolation::step) {
        for (std::size_t k = 0; k < w; ++k) out[k] = at(i, 1, k);
    } else {
        const double span = double(times[next]) - double(times[i]); // positive: upper_bound has passed equal keys
        const double t = (time - double(times[i])) / span;
        if (cubic) {
            const double t2 = t * t, t3 = t2 * t;
            for (std::size_t k = 0; k < w; ++k)
                out[k] = (2 * t3 - 3 * t2 + 1) * at(i, 1, k) + span * (t3 - 2 * t2 + t) * at(i, 2, k) +
                         (3 * t2 - 2 * t3) * at(next, 1, k) + span * (t3 - t2) * at(next, 0, k);
        } else if (rotation) {
            const auto key = [&](std::size_t n) {
                return normalize(Quaternion{at(n, 1, 0), at(n, 1, 1), at(n, 1, 2), at(n, 1, 3)});
            };
            const Quaternion q = slerp(key(i), key(next), t);
            return {q.x, q.y, q.z, q.w};
        } else {
            for (std::size_t k = 0; k < w; ++k) out[k] = at(i, 1, k) + (at(next, 1, k) - at(i, 1, k)) * t;
        }
    }
    if (rotation) {
        const Quaternion q = normalize(Quaternion{out[0], out[1], out[2], out[3]});
        return {q.x, q.y, q.z, q.w};
    }
    return out;
}

void animate(Document& doc, std::span<const Accessor> accessors, double time, std::uint64_t file_bytes,
             std::vector<Node>& nodes) {
    const std::span<const Json> animations = doc.list_of_objects(doc.root(), "animations");
    if (animations.empty()) {
        doc.warn("W0309", doc.root(), {}, "the file has no animation; the rest pose is read");
        return;
    }
    const std::span<const Json> samplers = doc.list_of_objects(animations[0], "samplers");
    std::uint64_t key_budget = file_bytes; // a key has values of its own, of a byte at least
    for (const Json& channel : doc.list_of_objects(animations[0], "channels"))
        apply_channel(doc, accessors, samplers, channel, time, key_budget, nodes);
}

} // namespace porthole::gltf
