// Moves the waypoints of a path until it is short and keeps off obstacles.
#pragma once

#include <cstddef>

#include "planning/paths.hpp"

namespace plancurate {

// Places that are tried for the waypoints between the ends, in each round: for every other one, then for those between.
struct Trials {
    std::size_t rounds, drawn, pulled;
    const double* offsets;  // rounds x inner waypoints x drawn x dof: how far from the waypoint
    const double* pulls;    // rounds x inner waypoints x pulled: which share of the way to the middle of its neighbours
};

// A waypoint goes to the cheapest of its places if its edges there are free for `robot` in `kept`. An edge costs its
// length, more where `measured`, a robot whose own parts are not checked against each other, is near to `scene`.
Path relax(const Robot& robot, const Robot& measured, const Scene& scene, const Scene& kept, Path path,
           const Trials& trials, double resolution);

}  // namespace plancurate
