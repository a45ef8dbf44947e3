// The obstacles around a robot, in its base frame.
#pragma once

#include <optional>
#include <vector>

#include "collision/shapes.hpp"

namespace plancurate {

struct Obstacle {
    Shape shape;
    float rounding;  // m, bound on the error of single precision at this place
};

// Immutable once built, so threads may share it.
struct Scene {
    std::vector<Obstacle> obstacles;
    std::optional<float> ground;  // height of a floor plane, m
    float margin = 0;             // a state is free when every checked distance is provably larger, m
};

// Throws std::invalid_argument that names the row and says what is wrong.
Scene make_scene(const ShapeTable& shapes, std::optional<double> ground, double margin);

}  // namespace plancurate
