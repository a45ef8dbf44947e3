// Vectors, rotations and rigid transforms over any number type: double, float, or eight of them at once.
#pragma once

#include <array>

namespace plancurate {

template <class T>
struct Vec3 {
    T x, y, z;
};

template <class T>
Vec3<T> operator+(const Vec3<T>& a, const Vec3<T>& b) {
    return {a.x + b.x, a.y + b.y, a.z + b.z};
}

template <class T>
Vec3<T> operator-(const Vec3<T>& a, const Vec3<T>& b) {
    return {a.x - b.x, a.y - b.y, a.z - b.z};
}

template <class T, class S>
Vec3<T> operator*(const Vec3<T>& a, const S& s) {
    return {a.x * s, a.y * s, a.z * s};
}

template <class T>
T dot(const Vec3<T>& a, const Vec3<T>& b) {
    return a.x * b.x + a.y * b.y + a.z * b.z;
}

// The columns x, y, z are the axes of the frame and t its origin, both seen from the parent frame.
template <class T>
struct Transform {
    Vec3<T> x, y, z, t;
};

// The point p, given in the frame f, seen from f's parent. The coordinates of p may be of a plainer type.
template <class T, class S>
Vec3<T> rotate(const Transform<T>& f, const Vec3<S>& p) {
    return f.x * p.x + f.y * p.y + f.z * p.z;
}

template <class T, class S>
Vec3<T> apply(const Transform<T>& f, const Vec3<S>& p) {
    return rotate(f, p) + f.t;
}

template <class T, class S>
Transform<T> operator*(const Transform<T>& f, const Transform<S>& g) {
    return {rotate(f, g.x), rotate(f, g.y), rotate(f, g.z), apply(f, g.t)};
}

}  // namespace plancurate
