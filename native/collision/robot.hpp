// A robot as the kernel sees it: a chain of joints with primitive shapes on its frames.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "collision/shapes.hpp"
#include "vector/geometry.hpp"

namespace plancurate {

// Turns about, or slides along, the z axis of its own frame.
template <class Real>
struct Joint {
    Transform<Real> origin;  // previous joint's moving frame (or the base) -> this joint's frame
    bool prismatic;
};

struct AttachedShape {
    Shape shape;
    int frame;  // 0 the base, i + 1 the frame that moves with joint i
};

// Shapes on one frame that follow each other in the order of checks.
struct ShapeGroup {
    int frame;
    std::vector<std::int32_t> shapes;
};

// One shape and a group that it is checked against.
struct SelfChecks {
    std::int32_t shape;
    ShapeGroup others;
};

// The sphere about all shapes on a frame: whatever keeps apart from it keeps apart from each of them.
struct Ball {
    Vec3<float> centre;
    float radius;
};

// A robot as users give it; joints may have any axis.
struct RobotTable {
    std::vector<Transform<double>> origins;
    std::vector<Vec3<double>> axes;
    std::vector<bool> prismatic;
    Transform<double> tool;
    std::vector<double> lower, upper;
    ShapeTable shapes;
    std::vector<std::int32_t> shape_frames;
    std::vector<std::array<std::int32_t, 2>> pairs;
    std::vector<std::int32_t> scene_shapes;
};

// Immutable once built, so threads may share it.
struct Robot {
    int dof = 0;
    std::vector<double> lower, upper;  // planning limits, rad (m for prismatic joints)

    // A user's axes are turned to z by folding a rotation into each origin: then a joint's motion touches two
    // columns of its frame only. `outward` holds those rotations: internal moving frame i -> the user's.
    std::vector<Joint<double>> joints;
    std::vector<Joint<float>> collision_joints;  // the same, in the collision kernel's precision
    std::vector<Transform<double>> outward;
    Transform<double> tool;  // last internal moving frame -> tool

    std::vector<AttachedShape> shapes;
    std::vector<Ball> balls;               // one a frame
    std::vector<SelfChecks> self_checks;   // shapes checked against each other
    std::vector<ShapeGroup> scene_groups;  // shapes checked against the scene
    int shape_joints = 0;                  // joints that move some shape: the first so many
    float rounding = 0;                    // m, bound on how far single precision misplaces a shape
};

// Throws std::invalid_argument that names the row and says what is wrong.
Robot make_robot(const RobotTable& table);

}  // namespace plancurate
