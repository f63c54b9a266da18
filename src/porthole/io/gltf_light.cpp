// Cameras and lights that hang on nodes.
#include <cmath>

#include "porthole/io/gltf_node.h"

namespace porthole::gltf {

void read_camera(Document& doc, const Node& node, const Affine3d& world, Scene& scene) {
    const Json& json = doc.element("cameras", std::size_t(node.camera));
    FileCamera camera;
    camera.name = without_nul(raw_name(json));
    if (camera.name.empty()) camera.name = without_nul(raw_name(*node.json));
    const std::string_view type = doc.string_or(json, "type");
    const Json* lens = doc.object(json, type == "orthographic" ? "orthographic" : "perspective");
    const double size = lens ? doc.number_or(*lens, type == "orthographic" ? "ymag" : "yfov", 0) : 0;
    camera.orthographic = type == "orthographic";
    const bool good = camera.orthographic ? size > 0 && size < 1e18 : size > 0 && size < 3.1;
    // Cameras look along -z; scale and shear of the node do not change the lens.
    const Vec3d z = normalize(world.z, Vec3d{0, 0, 0});
    const Vec3d x = normalize(cross(world.y, z), Vec3d{0, 0, 0});
    if (!good || !is_finite(world.p) || !(length(z) > 0.5) || !(length(x) > 0.5)) {
        doc.warn("W0306", json, {}, "the camera cannot be used: its angle, size or transform is out of range");
        return;
    }
    camera.world_from_camera = {x, cross(z, x), z, world.p};
    (camera.orthographic ? camera.half_height : camera.fov_y) = static_cast<float>(size);
    scene.cameras.push_back(std::move(camera));
}

void read_light(Document& doc, const Node& node, const Affine3d& world, Scene& scene) {
    const Json* extension = doc.extension(doc.root(), "KHR_lights_punctual");
    const Json& json = doc.list(*extension, "lights")[std::size_t(node.light)];
    if (!json.is_object()) doc.fail("E0303", json, {}, "is no object");
    Light light;
    light.name = without_nul(raw_name(json));
    if (light.name.empty()) light.name = without_nul(raw_name(*node.json));
    const std::string_view type = doc.string_or(json, "type");
    if (type == "directional")
        light.kind = Light::Kind::directional;
    else if (type == "point")
        light.kind = Light::Kind::point;
    else if (type == "spot")
        light.kind = Light::Kind::spot;
    else {
        doc.warn("W0306", json, "type",
                 "is \"" + shortened(type) + "\", expected directional, point or spot; the light is left out");
        return;
    }
    double color[3] = {1, 1, 1};
    doc.numbers(json, "color", color);
    light.color = {float(color[0]), float(color[1]), float(color[2])};
    light.intensity = static_cast<float>(doc.number_or(json, "intensity", 1));
    const double range = doc.number_or(json, "range", double(kInfinity));
    light.range = static_cast<float>(range);
    if (const Json* spot = doc.object(json, "spot"); spot && light.kind == Light::Kind::spot) {
        light.inner_cone = static_cast<float>(doc.number_or(*spot, "innerConeAngle", 0));
        light.outer_cone = static_cast<float>(doc.number_or(*spot, "outerConeAngle", double(kPi) / 4));
    }
    light.position = Vec3f(world.p);
    light.direction = Vec3f(normalize(-world.z, Vec3d{0, 0, 0}));
    const bool good = is_finite(light.color) && light.color.x >= 0 && light.color.y >= 0 && light.color.z >= 0 &&
                      light.intensity >= 0 && std::isfinite(light.intensity) && range > 0 && light.inner_cone >= 0 &&
                      light.outer_cone > light.inner_cone && light.outer_cone <= kPi / 2 + 1e-3f &&
                      is_finite(light.position) && !(light.direction == Vec3f{0, 0, 0});
    if (!good)
        doc.warn("W0306", json, {}, "the light cannot be used: a value or its transform is out of range");
    else
        scene.lights.push_back(std::move(light));
}

} // namespace porthole::gltf
