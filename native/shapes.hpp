// Convex primitives. Each is a core (point, segment, box or solid cylinder) blown up by a radius.
#pragma once

#include "geometry.hpp"

namespace plancurate {

enum class ShapeKind : int { sphere = 0, capsule = 1, cylinder = 2, box = 3 };

struct Shape {
    ShapeKind kind;
    Transform<float> pose;  // shape -> the frame it sits on
    Vec3<float> half;       // core's half extents: (0, 0, half length) of a capsule, (r, r, half length) of a cylinder
    float radius;           // what is added around the core
    float bounding;         // radius of the sphere about the origin of the shape that holds all of it
};

struct AttachedShape {
    Shape shape;
    int frame;  // 0 the base, i + 1 the frame that moves with joint i
};

}  // namespace plancurate
