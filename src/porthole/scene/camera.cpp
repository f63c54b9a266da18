#include "porthole/scene/camera.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <numbers>
#include <tuple>

namespace porthole {

namespace {

constexpr double kBorder = 0.045;    ///< of the picture's width and height, on each side
constexpr double kTargetSpan = 0.15; ///< of the picture's height, what targets should span
constexpr double kGolden = std::numbers::pi * (3.0 - 2.2360679774997896964); ///< golden angle

double radians(double degrees) { return degrees * (std::numbers::pi / 180.0); }

Vec3d world_up_for(Vec3d back, Vec3d wanted) {
    // Looking along `up` leaves the roll open: the model's front then points down the picture
    // when seen from above, up when seen from below.
    const Vec3d up = normalize(wanted, Vec3d{0, 1, 0});
    if (length(cross(up, back)) > 1e-4) return up;
    const Vec3d front = dot(up, back) > 0 ? Vec3d{0, 0, -1} : Vec3d{0, 0, 1};
    return length(cross(front, back)) > 1e-4 ? front : Vec3d{1, 0, 0};
}

/// Orthonormal axes of a camera: x right, y up, z towards the viewer.
struct Axes {
    Vec3d x{1, 0, 0}, y{0, 1, 0}, z{0, 0, 1};
    [[nodiscard]] Vec3d local(Vec3d world) const { return {dot(world, x), dot(world, y), dot(world, z)}; }
    [[nodiscard]] Vec3d world(Vec3d local) const { return x * local.x + y * local.y + z * local.z; }
};

Axes look(Vec3d back, Vec3d up) {
    Axes axes;
    axes.z = normalize(back, Vec3d{0, 0, 1});
    axes.x = normalize(cross(world_up_for(axes.z, up), axes.z), Vec3d{1, 0, 0});
    axes.y = cross(axes.z, axes.x);
    return axes;
}

Vec3d rotated(Vec3d v, Vec3d unit_axis, double angle) {
    const double c = std::cos(angle), s = std::sin(angle);
    return v * c + cross(unit_axis, v) * s + unit_axis * (dot(unit_axis, v) * (1 - c));
}

/// What framing works on: the eye and the half height of the picture in a fixed orientation.
struct Placement {
    Vec3d eye;              ///< in the axes
    double half_height = 1; ///< tangent, or metres when orthographic
};

using Points = std::vector<Vec3d>;

Points in_axes(const Axes& axes, std::span<const Vec3f> points) {
    Points out;
    out.reserve(points.size());
    for (const Vec3f p : points) out.push_back(axes.local(Vec3d(p)));
    return out;
}

Bounds3d bounds_of(const Points& points) {
    Bounds3d b;
    for (const Vec3d p : points) b.extend(p);
    return b;
}

/// The least length that may fill the picture: float coordinates this far from the origin
/// still tell its pixels apart.
double resolved_extent(const Bounds3d& b) {
    const double far_off = std::max({std::abs(b.lower.x), std::abs(b.lower.y), std::abs(b.lower.z), std::abs(b.upper.x),
                                     std::abs(b.upper.y), std::abs(b.upper.z)});
    return far_off > 0 ? 1e-4 * far_off : 1e-3;
}

/// Where points fall in the picture plane: tangents, or metres when orthographic.
struct Window2 {
    double x0 = 1e300, x1 = -1e300, y0 = 1e300, y1 = -1e300;
    [[nodiscard]] Vec2d centre() const { return {(x0 + x1) / 2, (y0 + y1) / 2}; }
    [[nodiscard]] Vec2d half() const { return {(x1 - x0) / 2, (y1 - y0) / 2}; }
};

Window2 seen_at(const Points& points, Vec3d eye, bool orthographic) {
    Window2 w;
    for (const Vec3d p : points) {
        // Targets lie before the eye; the bound only keeps an approximate hull from making NaN.
        const double scale = orthographic ? 1.0 : 1.0 / std::max(eye.z - p.z, 1e-9 * std::abs(eye.z) + 1e-30);
        const double x = (p.x - eye.x) * scale, y = (p.y - eye.y) * scale;
        w.x0 = std::min(w.x0, x), w.x1 = std::max(w.x1, x);
        w.y0 = std::min(w.y0, y), w.y1 = std::max(w.y1, y);
    }
    return w;
}

/// The nearest placement that holds all points with the border. If `centre` is given the
/// picture's centre stays on it.
Placement fit(const Points& points, double aspect, double tangent, bool orthographic, const Vec3d* centre) {
    const Bounds3d box = bounds_of(points);
    const double pad = std::max(1e-3 * box.diagonal(), resolved_extent(box)), use = 1 - 2 * kBorder;
    if (orthographic) {
        const Vec3d c = centre ? *centre : box.center();
        double half = pad;
        for (const Vec3d p : points) half = std::max({half, std::abs(p.y - c.y), std::abs(p.x - c.x) / aspect});
        return {{c.x, c.y, box.upper.z + std::max(box.diagonal(), pad)}, half / use};
    }
    // Every point must lie inside four planes through the eye. Each plane's support over the
    // points bounds the eye; the binding pair of opposite planes sets its distance.
    const double tx = tangent * aspect * use, ty = tangent * use;
    double right = -1e300, left = -1e300, top = -1e300, bottom = -1e300;
    for (const Vec3d p : points) {
        right = std::max(right, p.x + tx * p.z);
        left = std::max(left, -p.x + tx * p.z);
        top = std::max(top, p.y + ty * p.z);
        bottom = std::max(bottom, -p.y + ty * p.z);
    }
    Vec3d eye{(right - left) / 2, (top - bottom) / 2, 0};
    if (centre) {
        eye.x = centre->x, eye.y = centre->y;
        eye.z = std::max({(right - eye.x) / tx, (left + eye.x) / tx, (top - eye.y) / ty, (bottom + eye.y) / ty});
    } else {
        eye.z = std::max((right + left) / (2 * tx), (top + bottom) / (2 * ty));
    }
    eye.z = std::max(eye.z, box.upper.z + pad / ty);
    if (centre) return {eye, tangent};
    // On the axis that does not bind there is room: the same border on both sides of it.
    const bool wide = right + left > (top + bottom) * aspect;
    for (int pass = 0; pass < 6; ++pass) {
        const Vec2d off = seen_at(points, eye, false).centre();
        const double depth = eye.z - box.center().z;
        if (wide)
            eye.y += off.y * depth;
        else
            eye.x += off.x * depth;
    }
    return {eye, tangent};
}

/// Narrows the angle until the targets span enough, and moves the eye sideways so that they
/// stay inside: as far off the centre as the whole picture had them, less when the border
/// would be passed.
Placement tighten(Placement at, const Points& whole, const Points& targets, double aspect, bool orthographic) {
    const Bounds3d box = bounds_of(targets);
    Bounds3d scene = bounds_of(whole);
    scene.extend(at.eye);
    const double least = resolved_extent(scene);
    const double start = at.half_height, use = 1 - 2 * kBorder;
    const Vec2d home = seen_at(targets, at.eye, orthographic).centre();
    for (int pass = 0; pass < 4; ++pass) { // sideways moves change a perspective picture a little
        const Window2 now = seen_at(targets, at.eye, orthographic);
        const double depth = orthographic ? 1.0 : at.eye.z - box.center().z;
        const Vec2d half = now.half();
        double wanted = std::max({half.x, half.y, least / depth}) / kTargetSpan;
        wanted = std::max({wanted, half.x / (aspect * use), half.y / use});
        at.half_height = std::min(wanted, start);
        const double share = at.half_height / start;
        const auto kept = [&](double centre, double half_extent, double half_picture) {
            const double room = std::max(0.0, half_picture * use - half_extent);
            return std::clamp(centre * share, -room, room);
        };
        const Vec2d keep{kept(home.x, half.x, at.half_height * aspect), kept(home.y, half.y, at.half_height)};
        at.eye.x += (now.centre().x - keep.x) * depth;
        at.eye.y += (now.centre().y - keep.y) * depth;
        if (share >= 1) return at;
    }
    return at;
}

View view_of(const Axes& axes, const Placement& at, bool orthographic, int width, int height) {
    View view;
    view.world_from_camera = {Vec3f(axes.x), Vec3f(axes.y), Vec3f(axes.z), Vec3f(axes.world(at.eye))};
    view.orthographic = orthographic;
    view.half_height = float(at.half_height);
    view.width = width, view.height = height;
    return view;
}

void check_range(bool good, const char* option, const char* range) {
    if (!good) throw Error(ErrorKind::usage, "E0113", option, std::string("must be ") + range);
}

void check(const CameraParams& p, int width, int height) {
    const auto finite_vector = [](const std::optional<Vec3d>& v) { return !v || is_finite(*v); };
    const auto direction_like = [&](const std::optional<Vec3d>& v) { return !v || (is_finite(*v) && length(*v) > 0); };
    check_range(width >= 1 && height >= 1, "--size", "at least 1x1");
    const bool near =
        !p.position || (is_finite(*p.position) && length(*p.position) <= 1000 * double(kLargestCoordinate));
    check_range(near, "--camera-position", "three numbers, at most 1e15 m away");
    check_range(finite_vector(p.focal_point), "--camera-focal-point", "three finite numbers");
    check_range(direction_like(p.view_up), "--camera-view-up", "three finite numbers, not all zero");
    check_range(direction_like(p.direction), "--camera-direction", "three finite numbers, not all zero");
    check_range(std::isfinite(p.azimuth_deg), "--camera-azimuth-angle", "a finite angle, degrees");
    check_range(std::isfinite(p.elevation_deg), "--camera-elevation-angle", "a finite angle, degrees");
    check_range(p.zoom >= 1e-4 && p.zoom <= 1e4, "--camera-zoom-factor", "between 0.0001 and 10000");
    check_range(p.view_angle_deg >= 0.01 && p.view_angle_deg <= 175, "--camera-view-angle",
                "between 0.01 and 175 degrees");
}

/// Azimuth and elevation turn the eye's direction about the subject, as VTK's camera does.
Vec3d turned(Vec3d back, Vec3d up, const CameraParams& p) {
    if (p.azimuth_deg != 0) back = rotated(back, world_up_for(back, up), radians(p.azimuth_deg));
    if (p.elevation_deg != 0) back = rotated(back, look(back, up).x, -radians(p.elevation_deg));
    return back;
}

/// The view from direction `back`, framed; of the whole subject if it has no targets.
View framed(const FrameSubject& subject, Vec3d back, const CameraParams& p, int width, int height, const Vec3d* focal) {
    const double aspect = double(width) / double(height), tangent = std::tan(radians(p.view_angle_deg) / 2);
    const Vec3d up = p.view_up.value_or(Vec3d{0, 1, 0});
    const Axes axes = look(turned(normalize(back), up, p), up);
    Points whole = in_axes(axes, subject.whole);
    if (whole.empty()) whole.push_back({0, 0, 0});
    const Vec3d centre = focal ? axes.local(*focal) : Vec3d{};
    Placement at = fit(whole, aspect, tangent, p.orthographic, focal ? &centre : nullptr);
    if (p.frame == Framing::automatic && !subject.targets.empty() && !focal)
        at = tighten(at, whole, in_axes(axes, subject.targets), aspect, p.orthographic);
    at.half_height /= p.zoom;
    return view_of(axes, at, p.orthographic, width, height);
}

/// The view from a given eye.
View placed(const FrameSubject& subject, const CameraParams& p, Vec3d eye, std::optional<Vec3d> focal, int width,
            int height) {
    Bounds3d box;
    for (const Vec3f v : subject.whole) box.extend(Vec3d(v));
    const Vec3d centre = box.empty() ? Vec3d{} : box.center();
    const Vec3d up = p.view_up.value_or(Vec3d{0, 1, 0});
    Vec3d target = focal.value_or(centre);
    if (p.direction && !focal) {
        const double reach = length(centre - eye);
        target = eye + normalize(*p.direction) * (reach > 0 ? reach : 1.0);
    }
    Vec3d arm = eye - target;
    if (!(length(arm) > 0)) arm = p.direction ? -normalize(*p.direction) : Vec3d{0, 0, 1};
    const double distance = length(eye - target);
    const Vec3d back = turned(normalize(arm), up, p);
    const Axes axes = look(back, up);
    const double tangent = std::tan(radians(p.view_angle_deg) / 2);
    const double half = p.orthographic ? std::max(distance * tangent, 1e-30) : tangent;
    return view_of(axes, {axes.local(target + back * distance), half / p.zoom}, p.orthographic, width, height);
}

std::string listed(const Scene& scene) {
    if (scene.cameras.empty()) return "the file has no cameras";
    std::string out = "cameras of the file:";
    for (std::size_t i = 0; i < scene.cameras.size() && i < 8; ++i)
        out += (i ? ", #" : " #") + std::to_string(i) + " \"" + scene.cameras[i].name.substr(0, 80) + '"';
    return scene.cameras.size() > 8 ? out + ", ..." : out;
}

const FileCamera& file_camera(const Scene& scene, const std::string& name) {
    const std::string where = "--camera " + name.substr(0, 80);
    const FileCamera* found = nullptr;
    for (const FileCamera& camera : scene.cameras)
        if (!found && camera.name == name) found = &camera;
    std::size_t n = 0;
    if (!found && name.starts_with('#')) {
        const auto [stop, code] = std::from_chars(name.data() + 1, name.data() + name.size(), n);
        if (code == std::errc{} && stop == name.data() + name.size() && n < scene.cameras.size())
            found = &scene.cameras[n];
    }
    if (!found)
        throw Error(ErrorKind::usage, "E0112", where,
                    "no such view: auto, front, back, left, right, top, bottom, iso; " + listed(scene));
    const Affine3d& m = found->world_from_camera;
    const auto near = [](double a, double b) { return std::abs(a - b) < 1e-3; };
    const bool usable = is_finite(m.p) && near(dot(m.x, m.x), 1) && near(dot(m.y, m.y), 1) && near(dot(m.z, m.z), 1) &&
                        near(m.determinant(), 1) &&
                        (found->orthographic ? found->half_height > 0 && std::isfinite(found->half_height)
                                             : found->fov_y > 1e-4f && found->fov_y < 3.14f);
    if (!usable)
        throw Error(ErrorKind::usage, "E0113", where, "this camera of the file has no usable position or angle");
    return *found;
}

/// Directions along which extreme vertices are kept; half of them, each stands for its
/// opposite too.
constexpr int kDirections = 64;
struct Directions {
    std::array<float, kDirections> x, y, z;
};

Directions half_sphere() {
    Directions d{};
    for (int i = 0; i < kDirections; ++i) {
        const double h = (i + 0.5) / kDirections, r = std::sqrt(1 - h * h);
        d.x[std::size_t(i)] = float(r * std::cos(kGolden * i));
        d.y[std::size_t(i)] = float(h);
        d.z[std::size_t(i)] = float(r * std::sin(kGolden * i));
    }
    // The axes exactly, so that boxes are framed exactly.
    d.x[0] = 1, d.y[0] = 0, d.z[0] = 0;
    d.x[1] = 0, d.y[1] = 1, d.z[1] = 0;
    d.x[2] = 0, d.y[2] = 0, d.z[2] = 1;
    return d;
}

/// The vertices of `points` that are extreme along some direction; of equal ones the least,
/// so that the order of the points does not matter.
std::vector<Vec3f> extremes(std::span<const Vec3f> points) {
    static const Directions directions = half_sphere();
    if (points.empty()) return {};
    alignas(32) std::array<float, kDirections> highest, lowest;
    alignas(32) std::array<std::uint32_t, kDirections> at_highest{}, at_lowest{};
    highest.fill(-kInfinity), lowest.fill(kInfinity);
    const auto less = [&](std::uint32_t a, std::uint32_t b) {
        return std::tie(points[a].x, points[a].y, points[a].z) < std::tie(points[b].x, points[b].y, points[b].z);
    };
    const auto visit = [&](std::uint32_t i) {
        const Vec3f p = points[i];
        // Nearly every vertex ends here: two loops without branches, which become vector code.
        alignas(32) std::array<float, kDirections> d;
        alignas(32) std::array<std::int32_t, 8> extreme{};
        for (std::size_t k = 0; k < kDirections; ++k)
            d[k] = p.x * directions.x[k] + p.y * directions.y[k] + p.z * directions.z[k];
        for (std::size_t k = 0; k < kDirections; k += 8)
            for (std::size_t j = 0; j < 8; ++j)
                extreme[j] |= (d[k + j] >= highest[k + j] ? -1 : 0) | (d[k + j] <= lowest[k + j] ? -1 : 0);
        if (std::ranges::count(extreme, 0) == 8) return;
        for (std::size_t k = 0; k < kDirections; ++k) {
            if (d[k] > highest[k] || (d[k] == highest[k] && less(i, at_highest[k])))
                highest[k] = d[k], at_highest[k] = i;
            if (d[k] < lowest[k] || (d[k] == lowest[k] && less(i, at_lowest[k]))) lowest[k] = d[k], at_lowest[k] = i;
        }
    };
    // A sample first: meshes sweep through space, and each step would be a new extreme.
    const auto count = std::uint32_t(points.size());
    for (std::uint32_t i = 0; i < count; i += std::min(61u, count - i)) visit(i);
    for (std::uint32_t i = 0; i < count; ++i) visit(i);
    std::vector<Vec3f> out;
    for (std::size_t k = 0; k < kDirections; ++k) {
        out.push_back(points[at_highest[k]]);
        out.push_back(points[at_lowest[k]]);
    }
    const auto place = [](Vec3f a, Vec3f b) { return std::tie(a.x, a.y, a.z) < std::tie(b.x, b.y, b.z); };
    std::ranges::sort(out, place);
    out.erase(std::unique(out.begin(), out.end()), out.end());
    return out;
}

} // namespace

bool is_auto(const CameraParams& params) {
    return params.name == "auto" && !params.position && !params.focal_point && !params.direction;
}

FrameSubject frame_subject(const Scene& scene, std::span<const PartId> targets, const Control& control) {
    std::vector<std::vector<Vec3f>> hulls(scene.meshes.size());
    parallel_for(scene.meshes.size(), control, [&](std::size_t m) {
        const Mesh& mesh = scene.meshes[m];
        const std::vector<Vec3f> hull = hull_points(mesh.primitives);
        const std::vector<Vec3f>& positions = mesh.primitives.empty() ? mesh.positions : hull;
        hulls[m] = positions.size() <= kDirections ? positions : extremes(positions);
    });
    const auto placed_hulls = [&](auto&& each_part) {
        // Reduced as it grows, so that a million instances need no more room than a thousand.
        std::vector<Vec3f> points;
        each_part([&](const Part& part) {
            for (const Vec3f p : hulls[part.mesh]) points.push_back(Vec3f(part.world_from_mesh.point(Vec3d(p))));
            if (points.size() > 100'000) points = extremes(points);
        });
        return extremes(points);
    };
    FrameSubject out;
    out.whole = placed_hulls([&](auto&& body) { std::ranges::for_each(scene.parts, body); });
    out.targets = placed_hulls([&](auto&& body) {
        for (const PartId id : targets) body(scene.parts[index(id)]);
    });
    return out;
}

std::optional<Vec3f> named_direction(std::string_view name) {
    if (name == "front") return Vec3f{0, 0, 1};
    if (name == "back") return Vec3f{0, 0, -1};
    if (name == "left") return Vec3f{-1, 0, 0};
    if (name == "right") return Vec3f{1, 0, 0};
    if (name == "top") return Vec3f{0, 1, 0};
    if (name == "bottom") return Vec3f{0, -1, 0};
    if (name == "iso") return normalize(Vec3f{1, 0.8f, 1});
    return std::nullopt;
}

std::vector<Vec3f> candidate_directions() {
    constexpr int kSpiral = 64;
    std::vector<Vec3f> out;
    const double low = std::sin(radians(-30)), high = std::sin(radians(75));
    for (int i = 0; i < kSpiral; ++i) {
        const double y = low + (high - low) * (i + 0.5) / kSpiral, r = std::sqrt(1 - y * y);
        out.push_back(normalize(Vec3f(Vec3d{r * std::sin(kGolden * i), y, r * std::cos(kGolden * i)})));
    }
    for (const char* name : {"front", "back", "left", "right", "top", "bottom", "iso"})
        out.push_back(*named_direction(name));
    return out;
}

View view_from_direction(const FrameSubject& subject, Vec3f toward_eye, const CameraParams& params, int width,
                         int height) {
    check(params, width, height);
    return framed(subject, Vec3d(toward_eye), params, width, height, nullptr);
}

View make_view(const Scene& scene, const FrameSubject& subject, const CameraParams& params, int width, int height) {
    check(params, width, height);
    const auto stored = [&](const std::optional<Vec3d>& v) {
        return v ? std::optional<Vec3d>(*v - scene.origin) : std::nullopt;
    };
    const std::optional<Vec3d> focal = stored(params.focal_point);
    const std::optional<Vec3f> side = named_direction(params.name == "auto" ? "iso" : params.name);
    if (params.position) return placed(subject, params, *stored(params.position), focal, width, height);
    if (params.direction || side)
        return framed(subject, params.direction ? -*params.direction : Vec3d(*side), params, width, height,
                      focal ? &*focal : nullptr);

    // A camera of the file keeps its place and angle; the options may turn it and zoom.
    const FileCamera& camera = file_camera(scene, params.name);
    const Affine3d& m = camera.world_from_camera;
    const Vec3d back = normalize(m.z);
    CameraParams p = params;
    p.orthographic = camera.orthographic;
    p.view_up = params.view_up.value_or(m.y);
    Bounds3d box;
    for (const Vec3f v : subject.whole) box.extend(Vec3d(v));
    const Vec3d to_centre = (box.empty() ? Vec3d{} : box.center()) - m.p;
    const double reach = std::max(-dot(to_centre, back), 1e-3 * length(to_centre));
    View view = placed(subject, p, m.p, focal.value_or(m.p - back * (reach > 0 ? reach : 1.0)), width, height);
    view.half_height =
        float((camera.orthographic ? double(camera.half_height) : std::tan(double(camera.fov_y) / 2)) / params.zoom);
    return view;
}

} // namespace porthole
