#include "planning/planning.hpp"

#include <algorithm>
#include <cmath>
#include <exception>
#include <sstream>
#include <stdexcept>

#include <ompl/base/Planner.h>
#include <ompl/config.h>
#include <ompl/geometric/PathGeometric.h>
#include <ompl/util/Exception.h>

#include "planning/paths.hpp"

namespace plancurate {

namespace ob = ompl::base;
namespace og = ompl::geometric;

namespace {

std::size_t nearest_goal(const Query& query, const Configuration& q) {
    std::size_t best = 0;
    for (std::size_t i = 1; i < query.goals.size(); ++i)
        if (distance(q, query.goals[i]) < distance(q, query.goals[best])) best = i;
    return best;
}

void require(bool condition, const std::string& message) {
    if (!condition) throw std::invalid_argument(message);
}

void check_arguments(const Query& query, const Budget& budget) {
    const std::size_t n = query.robot.dof;
    require(query.start.size() == n, "start: one value for each of the robot's joints is needed");
    require(!query.goals.empty(), "goals: at least one is needed");
    for (const Configuration& goal : query.goals)
        require(goal.size() == n, "goals: one value for each of the robot's joints is needed");
    require(std::isfinite(query.resolution) && query.resolution > 0, "resolution: a positive number is needed");
    require(budget.state_checks > 0 && budget.polls > 0, "budget: state_checks and polls must be positive");
    require(budget.seconds > 0, "budget: seconds must be positive");
}

// Interpolation may leave the ends a rounding error away from what was asked for.
void pin_ends(const Query& query, std::vector<Configuration>& path, bool exact) {
    path.front() = query.start;
    if (exact) path.back() = query.goals[nearest_goal(query, path.back())];
}

class Run {
public:
    Run(const Query& query, const std::string& planner, const Parameters& params, std::uint64_t seed, const Budget& budget)
        : query_(query), seeds_{seed}, meter_(budget) {
        const PlannerEntry& entry = find_planner(planner);
        const SeededSection seeded(seeds_);
        problem_ = make_problem(query, entry.optimizing, seeds_, meter_);
        planner_ = make_planner(entry, problem_->getSpaceInformation(), params);
        planner_->setProblemDefinition(problem_);
        try {
            planner_->setup();
        } catch (const ompl::Exception& error) {  // parameters that don't go together
            throw std::invalid_argument(planner + ": " + error.what());
        }
    }

    void solve(Result& result) {
        try {
            planner_->solve(ob::PlannerTerminationCondition([this] { return meter_.spent(); }));
        } catch (const std::exception& error) {
            result.reason = std::string("the planner failed: ") + error.what();
        }
        result.state_checks = meter_.state_checks;
        result.motion_checks = meter_.motion_checks;
        result.polls = meter_.polls;
        const bool exact = problem_->hasExactSolution();
        result.termination = !meter_.exhausted.empty() ? meter_.exhausted : exact ? "solved" : "planner";
        if (exact) result.status = "exact";
        else if (problem_->hasApproximateSolution()) result.status = "approximate";
    }

    void take_path(Result& result, Simplification simplification) {
        if (result.status == "none") {
            if (result.reason.empty()) result.reason = "no path was found";
            return;
        }
        const bool exact = result.status == "exact";
        const auto& solution = static_cast<og::PathGeometric&>(*problem_->getSolutionPath());
        std::size_t blocked = 1;
        if (simplification != Simplification::off) {
            og::PathGeometric path(solution);
            if (simplification == Simplification::full) shorten(path, seeds_);
            else shorten_partly(path, seeds_);
            blocked = keep(result, path, exact);
        }
        if (blocked) blocked = keep(result, solution, exact);
        if (blocked) {
            result.reason = "edge " + std::to_string(blocked) + " of the planner's path is not free";
            result.status = "none";
            result.path.clear();
        }
    }

    double seconds() const { return meter_.seconds(); }

private:
    std::size_t keep(Result& result, const og::PathGeometric& path, bool exact) const {
        result.path = waypoints(path, query_.robot.dof);
        pin_ends(query_, result.path, exact);
        return blocked_edge(query_, result.path);
    }

    const Query& query_;
    SeedSequence seeds_;
    Meter meter_;
    ob::ProblemDefinitionPtr problem_;
    ob::PlannerPtr planner_;
};

// Sets status and reason when start or goals can't be used, or when nothing is left to plan.
bool needs_no_planning(const Query& query, Result& result) {
    result.reason = why_unusable(query, query.start, "start");
    result.termination = "start";
    for (std::size_t i = 0; i < query.goals.size() && result.reason.empty(); ++i) {
        result.reason = why_unusable(query, query.goals[i], "goal " + std::to_string(i));
        result.termination = "goal";
    }
    if (!result.reason.empty()) return true;
    const auto here = std::find(query.goals.begin(), query.goals.end(), query.start);
    if (here == query.goals.end()) return false;
    result.status = "exact";
    result.termination = "solved";
    result.path = {query.start};
    return true;
}

// Sets the cost, and the goal that the path ends at or how far from one it ends.
void rate_path(const Query& query, Result& result) {
    result.cost = length(result.path);
    if (result.path.empty()) return;
    const std::size_t goal = nearest_goal(query, result.path.back());
    if (result.status == "exact") result.goal = static_cast<int>(goal);
    else {
        std::ostringstream text;
        text << "the path ends " << distance(result.path.back(), query.goals[goal]) << " from the nearest goal";
        result.reason = text.str();
    }
}

}  // namespace

Result plan(const Query& query, const std::string& planner, const Parameters& params, std::uint64_t seed,
            const Budget& budget, Simplification simplification) {
    check_arguments(query, budget);
    Result result;
    Run run(query, planner, params, seed, budget);
    if (!needs_no_planning(query, result)) {
        run.solve(result);
        run.take_path(result, simplification);
    }
    rate_path(query, result);
    result.seconds = run.seconds();
    return result;
}

std::string ompl_version() {
    return std::to_string(OMPL_MAJOR_VERSION) + "." + std::to_string(OMPL_MINOR_VERSION) + "." +
           std::to_string(OMPL_PATCH_VERSION);
}

}  // namespace plancurate
