// Small vectors, affine maps and boxes. Right-handed, column vectors, metres.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>

namespace porthole {

inline constexpr float kInfinity = std::numeric_limits<float>::infinity();
inline constexpr float kPi = 3.14159265358979323846f;

template <typename T> struct Vec2 {
    T x{}, y{};
    friend constexpr bool operator==(const Vec2&, const Vec2&) = default;
};

template <typename T> struct Vec3 {
    T x{}, y{}, z{};
    constexpr T& operator[](int i) { return i == 0 ? x : i == 1 ? y : z; }
    constexpr const T& operator[](int i) const { return i == 0 ? x : i == 1 ? y : z; }
    template <typename U> constexpr explicit operator Vec3<U>() const {
        return {static_cast<U>(x), static_cast<U>(y), static_cast<U>(z)};
    }
    friend constexpr bool operator==(const Vec3&, const Vec3&) = default;
};

template <typename T> struct Vec4 {
    T x{}, y{}, z{}, w{};
    friend constexpr bool operator==(const Vec4&, const Vec4&) = default;
};

using Vec2f = Vec2<float>;
using Vec2d = Vec2<double>;
using Vec2i = Vec2<std::int32_t>;
using Vec3f = Vec3<float>;
using Vec3d = Vec3<double>;
using Vec3u = Vec3<std::uint32_t>;
using Vec4f = Vec4<float>;

template <typename T> constexpr Vec2<T> operator+(Vec2<T> a, Vec2<T> b) { return {a.x + b.x, a.y + b.y}; }
template <typename T> constexpr Vec2<T> operator-(Vec2<T> a, Vec2<T> b) { return {a.x - b.x, a.y - b.y}; }
template <typename T> constexpr Vec2<T> operator*(Vec2<T> a, T s) { return {a.x * s, a.y * s}; }

template <typename T> constexpr Vec3<T> operator+(Vec3<T> a, Vec3<T> b) { return {a.x + b.x, a.y + b.y, a.z + b.z}; }
template <typename T> constexpr Vec3<T> operator-(Vec3<T> a, Vec3<T> b) { return {a.x - b.x, a.y - b.y, a.z - b.z}; }
template <typename T> constexpr Vec3<T> operator-(Vec3<T> a) { return {-a.x, -a.y, -a.z}; }
template <typename T> constexpr Vec3<T> operator*(Vec3<T> a, Vec3<T> b) { return {a.x * b.x, a.y * b.y, a.z * b.z}; }
template <typename T> constexpr Vec3<T> operator*(Vec3<T> a, T s) { return {a.x * s, a.y * s, a.z * s}; }
template <typename T> constexpr Vec3<T> operator*(T s, Vec3<T> a) { return a * s; }
template <typename T> constexpr Vec3<T> operator/(Vec3<T> a, T s) { return {a.x / s, a.y / s, a.z / s}; }
template <typename T> constexpr Vec3<T>& operator+=(Vec3<T>& a, Vec3<T> b) { return a = a + b; }
template <typename T> constexpr Vec3<T>& operator*=(Vec3<T>& a, Vec3<T> b) { return a = a * b; }
template <typename T> constexpr Vec3<T>& operator*=(Vec3<T>& a, T s) { return a = a * s; }

template <typename T> constexpr Vec4<T> operator+(Vec4<T> a, Vec4<T> b) {
    return {a.x + b.x, a.y + b.y, a.z + b.z, a.w + b.w};
}
template <typename T> constexpr Vec4<T> operator-(Vec4<T> a, Vec4<T> b) {
    return {a.x - b.x, a.y - b.y, a.z - b.z, a.w - b.w};
}
template <typename T> constexpr Vec4<T> operator*(Vec4<T> a, T s) { return {a.x * s, a.y * s, a.z * s, a.w * s}; }

template <typename T> constexpr T dot(Vec2<T> a, Vec2<T> b) { return a.x * b.x + a.y * b.y; }
template <typename T> constexpr T dot(Vec3<T> a, Vec3<T> b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
template <typename T> constexpr Vec3<T> cross(Vec3<T> a, Vec3<T> b) {
    return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}
template <typename T> T length(Vec3<T> a) { return std::sqrt(dot(a, a)); }

/// `a` scaled to length 1; `fallback` when its length is zero or not finite.
template <typename T> Vec3<T> normalize(Vec3<T> a, Vec3<T> fallback = {0, 0, 1}) {
    const T l2 = dot(a, a);
    if (!(l2 > std::numeric_limits<T>::min()) || !(l2 < std::numeric_limits<T>::infinity())) {
        // Squares under- or overflow: rescale by the largest component first.
        const T m = std::max({std::abs(a.x), std::abs(a.y), std::abs(a.z)});
        if (!(m > T(0)) || !(m < std::numeric_limits<T>::infinity())) return fallback;
        const Vec3<T> b{a.x / m, a.y / m, a.z / m};
        return b / std::sqrt(dot(b, b));
    }
    return a / std::sqrt(l2);
}

template <typename T> constexpr Vec3<T> min(Vec3<T> a, Vec3<T> b) {
    return {std::min(a.x, b.x), std::min(a.y, b.y), std::min(a.z, b.z)};
}
template <typename T> constexpr Vec3<T> max(Vec3<T> a, Vec3<T> b) {
    return {std::max(a.x, b.x), std::max(a.y, b.y), std::max(a.z, b.z)};
}
template <typename T> constexpr Vec3<T> lerp(Vec3<T> a, Vec3<T> b, T t) { return a + (b - a) * t; }
constexpr float clamp01(float v) { return std::clamp(v, 0.0f, 1.0f); }

template <typename T> bool is_finite(Vec3<T> a) {
    return std::isfinite(a.x) && std::isfinite(a.y) && std::isfinite(a.z);
}

/// Two unit vectors that with the unit vector `n` form a right-handed frame.
/// Duff et al., "Building an Orthonormal Basis, Revisited" (2017).
struct Frame3 {
    Vec3f x, y, z;
    explicit Frame3(Vec3f n) : z(n) {
        const float sign = std::copysign(1.0f, n.z);
        const float a = -1.0f / (sign + n.z);
        const float b = n.x * n.y * a;
        x = {1.0f + sign * n.x * n.x * a, sign * b, -sign * n.x};
        y = {b, sign + n.y * n.y * a, -n.y};
    }
    [[nodiscard]] Vec3f world_from_local(Vec3f v) const { return x * v.x + y * v.y + z * v.z; }
};

/// Affine map: columns x, y, z and translation p.
template <typename T> struct Affine3 {
    Vec3<T> x{1, 0, 0}, y{0, 1, 0}, z{0, 0, 1}, p{0, 0, 0};

    [[nodiscard]] constexpr Vec3<T> vector(Vec3<T> v) const { return x * v.x + y * v.y + z * v.z; }
    [[nodiscard]] constexpr Vec3<T> point(Vec3<T> v) const { return vector(v) + p; }
    [[nodiscard]] constexpr T determinant() const { return dot(x, cross(y, z)); }
    template <typename U> constexpr explicit operator Affine3<U>() const {
        return {Vec3<U>(x), Vec3<U>(y), Vec3<U>(z), Vec3<U>(p)};
    }
    friend constexpr bool operator==(const Affine3&, const Affine3&) = default;
};
using Affine3f = Affine3<float>;
using Affine3d = Affine3<double>;

template <typename T> constexpr Affine3<T> operator*(const Affine3<T>& a, const Affine3<T>& b) {
    return {a.vector(b.x), a.vector(b.y), a.vector(b.z), a.point(b.p)};
}

/// Inverse of an invertible map (determinant not zero: the caller has checked).
template <typename T> constexpr Affine3<T> inverse(const Affine3<T>& a) {
    const T d = T(1) / a.determinant();
    const Vec3<T> rx = cross(a.y, a.z) * d, ry = cross(a.z, a.x) * d, rz = cross(a.x, a.y) * d;
    Affine3<T> r{{rx.x, ry.x, rz.x}, {rx.y, ry.y, rz.y}, {rx.z, ry.z, rz.z}, {}};
    r.p = -r.vector(a.p);
    return r;
}

/// Transform of a surface normal: the cofactor matrix, which keeps its side for
/// mirrored maps as well (up to the sign of the determinant). Not normalised.
template <typename T> constexpr Vec3<T> transform_normal(const Affine3<T>& a, Vec3<T> n) {
    return cross(a.y, a.z) * n.x + cross(a.z, a.x) * n.y + cross(a.x, a.y) * n.z;
}

template <typename T> struct Bounds3 {
    Vec3<T> lower{std::numeric_limits<T>::infinity(), std::numeric_limits<T>::infinity(),
                  std::numeric_limits<T>::infinity()};
    Vec3<T> upper{-std::numeric_limits<T>::infinity(), -std::numeric_limits<T>::infinity(),
                  -std::numeric_limits<T>::infinity()};

    [[nodiscard]] constexpr bool empty() const { return !(lower.x <= upper.x); }
    constexpr void extend(Vec3<T> v) {
        lower = min(lower, v);
        upper = max(upper, v);
    }
    constexpr void extend(const Bounds3& b) {
        lower = min(lower, b.lower);
        upper = max(upper, b.upper);
    }
    [[nodiscard]] constexpr Vec3<T> center() const { return lower * T(0.5) + upper * T(0.5); }
    [[nodiscard]] constexpr Vec3<T> size() const { return empty() ? Vec3<T>{} : upper - lower; }
    [[nodiscard]] T diagonal() const { return length(size()); }
    [[nodiscard]] constexpr Vec3<T> corner(int i) const {
        return {i & 1 ? upper.x : lower.x, i & 2 ? upper.y : lower.y, i & 4 ? upper.z : lower.z};
    }
};
using Bounds3f = Bounds3<float>;
using Bounds3d = Bounds3<double>;

} // namespace porthole
