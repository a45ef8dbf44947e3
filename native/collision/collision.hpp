// Whether states and edges are free of collision. Collision only: joint limits are the caller's.
//
// "Free" is always proven: for every checked pair a separating slab wider than the margin was found, with
// the rounding of the kernel's single precision counted against it. All functions are pure and may run in
// any number of threads; a state's answer does not depend on the function or batch it goes through.
#pragma once

#include <cstddef>
#include <cstdint>

#include "collision/robot.hpp"
#include "collision/scene.hpp"

namespace plancurate {

// q: dof joint positions.
bool is_free(const Robot& robot, const Scene& scene, const double* q);

// q: count rows of dof joint positions, free: count answers.
void are_free(const Robot& robot, const Scene& scene, const double* q, std::size_t count, bool* free);

// Looks at the states (1 - t) q0 + t q1 with t = i / k, i = 0..k and k = ceil(max |q1 - q0| / resolution),
// coarse to fine, and stops at the first collision. Adds the number of states looked at to state_checks.
bool edge_is_free(const Robot& robot, const Scene& scene, const double* q0, const double* q1, double resolution,
                  std::uint64_t& state_checks);

// Certified lower bound of the smallest checked distance (m) for each row; not positive where shapes touch,
// infinite where nothing is checked.
void clearances(const Robot& robot, const Scene& scene, const double* q, std::size_t count, double* distances);

// The smallest of them along each way of so many points, from 0 where shapes touch to `most` where nothing is nearer.
// q: ways x points rows of dof joint positions. Faster than to ask for each point and take the smallest.
void way_clearances(const Robot& robot, const Scene& scene, const double* q, std::size_t ways, std::size_t points,
                    float most, double* distances);

}  // namespace plancurate
