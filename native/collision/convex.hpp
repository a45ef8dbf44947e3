// The convex sets inside the primitives, posed in the world: the projection of a point onto each, and the support of
// each along a direction, seen from its centre. All are symmetric about their centres, so the support along -d is the
// same. T is Floats for sets that move with the lanes and float for those that do not.
#pragma once

#include "collision/shapes.hpp"
#include "vector/lanes.hpp"

namespace plancurate {

using Point = Vec3<Floats>;

// From the centre along +-z, or the centre alone where the half length is 0.
template <class T>
struct Segment {
    Vec3<T> centre, z;
    float half;

    Point project(const Point& p) const { return z * clamp(dot(p - centre, z), half) + centre; }
    Floats support(const Point& d) const { return abs(dot(d, z)) * half; }
};

template <class T>
struct Box {
    Vec3<T> centre, x, y, z;
    Vec3<float> half;

    Point project(const Point& p) const {
        const Point v = p - centre;
        return x * clamp(dot(v, x), half.x) + y * clamp(dot(v, y), half.y) + z * clamp(dot(v, z), half.z) + centre;
    }
    Floats support(const Point& d) const {
        return abs(dot(d, x)) * half.x + abs(dot(d, y)) * half.y + abs(dot(d, z)) * half.z;
    }
};

// Solid, about the z axis.
template <class T>
struct Cylinder {
    Vec3<T> centre, x, y, z;
    float radius, half;

    Point project(const Point& p) const {
        const Point v = p - centre;
        const Floats along_x = dot(v, x), along_y = dot(v, y);
        const Floats off_axis = sqrt(along_x * along_x + along_y * along_y);
        const Floats pull = select(off_axis > radius, radius / off_axis, splat<float>(1));
        return x * (along_x * pull) + y * (along_y * pull) + z * clamp(dot(v, z), half) + centre;
    }
    Floats support(const Point& d) const {
        const Floats along_x = dot(d, x), along_y = dot(d, y);
        return sqrt(along_x * along_x + along_y * along_y) * radius + abs(dot(d, z)) * half;
    }
};

// Calls use(set) with the convex set of a shape that stands at a pose.
template <class T, class Use>
void with_convex_set(const Shape& shape, const Transform<T>& pose, const Use& use) {
    switch (shape.kind) {
        case ShapeKind::sphere:
        case ShapeKind::capsule: return use(Segment<T>{pose.t, pose.z, shape.half.z});
        case ShapeKind::cylinder: return use(Cylinder<T>{pose.t, pose.x, pose.y, pose.z, shape.half.x, shape.half.z});
        case ShapeKind::box: return use(Box<T>{pose.t, pose.x, pose.y, pose.z, shape.half});
    }
}

}  // namespace plancurate
