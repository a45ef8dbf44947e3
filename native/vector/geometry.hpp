// Vectors and rigid transforms over any number type: double, float, or eight of either at once.
// Operands may differ, so that constants stay plain numbers beside lanes of variables.
#pragma once

namespace plancurate {

template <class T>
struct Vec3 {
    T x, y, z;
};

template <class T>
Vec3(T, T, T) -> Vec3<T>;

template <class T, class S>
auto operator+(const Vec3<T>& a, const Vec3<S>& b) {
    return Vec3{a.x + b.x, a.y + b.y, a.z + b.z};
}

template <class T, class S>
auto operator-(const Vec3<T>& a, const Vec3<S>& b) {
    return Vec3{a.x - b.x, a.y - b.y, a.z - b.z};
}

template <class T, class S>
auto operator*(const Vec3<T>& a, const S& s) {
    return Vec3{a.x * s, a.y * s, a.z * s};
}

template <class T, class S>
auto dot(const Vec3<T>& a, const Vec3<S>& b) {
    return a.x * b.x + a.y * b.y + a.z * b.z;
}

// The columns x, y, z are the axes of the frame and t its origin, all seen from the parent frame.
template <class T>
struct Transform {
    Vec3<T> x, y, z, t;
};

template <class T, class S>
auto rotate(const Transform<T>& f, const Vec3<S>& v) {
    return f.x * v.x + f.y * v.y + f.z * v.z;
}

// The point p, given in the frame f, seen from f's parent.
template <class T, class S>
auto apply(const Transform<T>& f, const Vec3<S>& p) {
    return rotate(f, p) + f.t;
}

template <class T, class S>
auto operator*(const Transform<T>& f, const Transform<S>& g) {
    return Transform<decltype(f.x.x * g.x.x)>{rotate(f, g.x), rotate(f, g.y), rotate(f, g.z), apply(f, g.t)};
}

// Pure rotations only.
template <class T>
Transform<T> transposed(const Transform<T>& f) {
    return {{f.x.x, f.y.x, f.z.x}, {f.x.y, f.y.y, f.z.y}, {f.x.z, f.y.z, f.z.z}, {T{}, T{}, T{}}};
}

template <class S, class T>
Vec3<S> cast(const Vec3<T>& v) {
    return {static_cast<S>(v.x), static_cast<S>(v.y), static_cast<S>(v.z)};
}

template <class S, class T>
Transform<S> cast(const Transform<T>& f) {
    return {cast<S>(f.x), cast<S>(f.y), cast<S>(f.z), cast<S>(f.t)};
}

}  // namespace plancurate
