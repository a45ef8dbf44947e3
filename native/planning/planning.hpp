// One call from a start to one of several goals by any of the planners.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "planning/planners.hpp"
#include "planning/problem.hpp"

namespace plancurate {

// What becomes of a solution: `off` leaves it as it is, `full` shortens it until nothing more is gained, `partial` tries
// a number of shortcuts drawn from the seed, as a simplifier leaves it whose time ran out.
enum class Simplification { off, partial, full };

struct Result {
    std::string status = "none";      // "exact", "approximate" or "none"
    std::string reason;               // why not exact, else ""
    std::vector<Configuration> path;  // waypoints from the start to a goal; empty when there is none
    double cost = 0;                  // Euclidean length of the path in joint space
    int goal = -1;                    // which goal the path ends at, -1 unless exact
    // Used by the planner; simplifying and the final check are not counted.
    std::uint64_t state_checks = 0, motion_checks = 0, polls = 0;
    double seconds = 0;       // of the whole call
    std::string termination;  // "solved", "planner" (gave up by itself), "start", "goal", or the exhausted budget
};

// The same arguments give the same result (but for `seconds`) on any thread, unless termination is "seconds".
// Throws std::invalid_argument for arguments that make no sense; whatever goes wrong in planning is a result.
Result plan(const Query& query, const std::string& planner, const Parameters& params, std::uint64_t seed,
            const Budget& budget, Simplification simplification);

std::string ompl_version();

}  // namespace plancurate
