// The obstacles around a robot, in its base frame.
#pragma once

#include <optional>
#include <vector>

#include "shapes.hpp"

namespace plancurate {

struct SceneShape {
    Shape shape;
    float rounding;  // m, bound on the error of single precision at this place
};

struct Scene {
    std::vector<SceneShape> shapes;
    std::optional<float> ground;  // height of a floor plane, m
    float margin = 0;             // a state is free when every checked distance is provably larger, m
};

}  // namespace plancurate
