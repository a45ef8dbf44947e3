// A robot as the kernel sees it: a chain of joints with primitive shapes on its frames.
#pragma once

#include <utility>
#include <vector>

#include "geometry.hpp"
#include "shapes.hpp"

namespace plancurate {

// Joint i turns about (or slides along) the z axis of its own frame: the axes a user gives are folded into
// the fixed transforms, which makes the motion of a joint touch two columns only.
template <class Real>
struct Joint {
    Transform<Real> origin;  // previous moving frame (or base) -> this joint's frame
    bool prismatic;
};

struct Robot {
    int dof = 0;
    std::vector<double> lower, upper;  // planning limits, rad (m for prismatic joints)

    std::vector<Joint<double>> joints;           // for poses given to the user
    std::vector<Joint<float>> collision_joints;  // the same in the kernel's precision
    std::vector<Transform<double>> moving;       // internal frame i -> the user's moving frame i
    Transform<double> tool;                      // last internal frame -> tool

    std::vector<AttachedShape> shapes;
    std::vector<std::pair<int, int>> pairs;  // shapes checked against each other
    std::vector<int> scene_shapes;           // shapes checked against the scene
    int shape_frames = 0;                    // number of joints that move any shape
    float rounding = 0;                      // m, bound on how far single precision misplaces a shape
};

}  // namespace plancurate
