// Convex primitives. Each is a convex set (point, segment, box or solid cylinder) swept by a sphere of some radius.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "vector/geometry.hpp"

namespace plancurate {

enum class ShapeKind : int { sphere = 0, capsule = 1, cylinder = 2, box = 3 };

struct Shape {
    ShapeKind kind;
    Transform<float> pose;  // shape -> the frame it sits on
    Vec3<float> half;  // of the convex set: (0, 0, half length) of a capsule, (r, r, half length) of a cylinder
    float radius;      // of the sphere that sweeps it: 0 for boxes and cylinders
    float bounding;    // radius of the sphere about the shape's origin that holds all of it
};

// Shapes as users give them. Sizes: sphere (r, 0, 0), capsule and cylinder (r, half length, 0), box half extents.
struct ShapeTable {
    std::vector<std::int32_t> kinds;
    std::vector<Transform<double>> poses;
    std::vector<Vec3<double>> sizes;
};

// Row i as a Shape whose pose is seen from `frame`'s parent. Throws std::invalid_argument on an unknown kind, a
// pose that is not rigid or a size that is negative, naming the row.
Shape make_shape(const ShapeTable& table, std::size_t i, const Transform<double>& frame);

// Throws std::invalid_argument, with `name` in the message, unless the pose is finite, orthonormal and right-handed.
void require_rigid(const Transform<double>& pose, const std::string& name);

}  // namespace plancurate
