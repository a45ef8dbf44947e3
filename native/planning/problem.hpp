// One planning problem in OMPL's terms: the joint space, its validity by the collision kernel, the budget.
#pragma once

#include <chrono>
#include <cstdint>
#include <string>
#include <vector>

#include <ompl/base/MotionValidator.h>
#include <ompl/base/ProblemDefinition.h>
#include <ompl/base/SpaceInformation.h>
#include <ompl/base/StateValidityChecker.h>
#include <ompl/base/objectives/PathLengthOptimizationObjective.h>
#include <ompl/base/spaces/RealVectorStateSpace.h>

#include "collision/collision.hpp"
#include "planning/seeding.hpp"

namespace plancurate {

using Configuration = std::vector<double>;  // dof joint positions, rad (m for prismatic joints)

struct Budget {
    std::uint64_t state_checks;
    std::uint64_t polls;  // of the termination condition: roughly a planner's iterations
    double seconds;       // wall clock, the safety net
};

// What a run has used up so far, and whether that is all it may.
class Meter {
public:
    explicit Meter(const Budget& budget) : budget_(budget) {}

    // Counts a poll; once true it stays true.
    bool spent();
    double seconds() const;

    std::uint64_t state_checks = 0;
    std::uint64_t motion_checks = 0;
    std::uint64_t polls = 0;
    std::string exhausted;  // which part of the budget ended the run, "" while none did

private:
    using Clock = std::chrono::steady_clock;
    Budget budget_;
    Clock::time_point begin_ = Clock::now();
};

struct Query {
    const Robot& robot;
    const Scene& scene;
    Configuration start;
    std::vector<Configuration> goals;
    double resolution;  // largest step of a joint between two checked states of an edge
};

// "" when q is inside the limits and free, else what is wrong with it, naming it `name`.
std::string why_unusable(const Query& query, const Configuration& q, const std::string& name);

inline double* values(ompl::base::State* state) {
    return state->as<ompl::base::RealVectorStateSpace::StateType>()->values;
}
inline const double* values(const ompl::base::State* state) {
    return state->as<ompl::base::RealVectorStateSpace::StateType>()->values;
}

// Builds the problem for OMPL; to be called inside a SeededSection. `seeds` and `meter` must outlive it.
// Goals are put in an order drawn from the seed: some planners take only the first, or prefer the early ones.
// `optimizing`: go on until no path can be shorter, instead of stopping at the first solution.
ompl::base::ProblemDefinitionPtr make_problem(const Query& query, bool optimizing, SeedSequence& seeds, Meter& meter);

}  // namespace plancurate
