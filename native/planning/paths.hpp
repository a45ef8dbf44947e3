// Paths in joint space: how long they are, whether they are free, and OMPL's ways to shorten them.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include <ompl/geometric/PathGeometric.h>

#include "planning/problem.hpp"

namespace plancurate {

using Path = std::vector<Configuration>;  // waypoints

// Euclidean, in joint space.
double distance(const Configuration& a, const Configuration& b);
double length(const Path& path);

// Without waypoints that repeat the one before.
Path waypoints(const ompl::geometric::PathGeometric& path, std::size_t dof);

// Number of the first edge that is not free, or 0.
std::size_t blocked_edge(const Query& query, const Path& path);

// Fewer vertices and shortcuts: the path keeps its corners.
void shorten(ompl::geometric::PathGeometric& path, SeedSequence& seeds);

// A number of shortcuts drawn from `seeds`: none to two for each waypoint.
void shorten_partly(ompl::geometric::PathGeometric& path, SeedSequence& seeds);

// Shortens the path, then rounds its corners by B-splines. The answer is free, no longer than `path`, has the very
// same ends, and depends on the arguments alone. Throws std::invalid_argument when `path` is empty or not free.
Path simplify(const Robot& robot, const Scene& scene, const Path& path, std::uint64_t seed, double resolution);

}  // namespace plancurate
