#include "planning/paths.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <string>

#include <ompl/geometric/PathSimplifier.h>

namespace plancurate {

namespace ob = ompl::base;
namespace og = ompl::geometric;

namespace {

// Its random generator is seeded from `seeds` alone.
og::PathSimplifier make_simplifier(const og::PathGeometric& path, SeedSequence& seeds) {
    const SeededSection seeded(seeds);
    return og::PathSimplifier(path.getSpaceInformation());
}

// The same function by its newer name, where there is one, or its older; 0 steps mean one for each waypoint.
template <class Simplifier>
auto shortcut(Simplifier& simplifier, og::PathGeometric& path, unsigned int steps, int)
    -> decltype(simplifier.partialShortcutPath(path)) {
    return simplifier.partialShortcutPath(path, steps, steps);
}
template <class Simplifier>
bool shortcut(Simplifier& simplifier, og::PathGeometric& path, unsigned int steps, long) {
    return simplifier.shortcutPath(path, steps, steps);
}

// OMPL's own simplification (MoveIt uses the same) without its B-spline step, which multiplies the waypoints by
// eight, and without a clock: the steps are bounded by the number of waypoints, the rounds by a constant.
void shorten_by(og::PathSimplifier& simplifier, og::PathGeometric& path) {
    constexpr int rounds = 5;
    for (int round = 0; round < rounds && path.getStateCount() > 2; ++round) {
        const bool fewer = simplifier.reduceVertices(path);
        const bool shorter = shortcut(simplifier, path, 0, 0);
        simplifier.collapseCloseVertices(path);
        if (!fewer && !shorter) break;
    }
    simplifier.reduceVertices(path);
}

// The B-spline step with the bounds that OMPL's own simplification gives it.
void smooth_by(og::PathSimplifier& simplifier, og::PathGeometric& path) {
    constexpr unsigned int halvings = 3;
    simplifier.smoothBSpline(path, halvings, path.length() / 100);
}

og::PathGeometric ompl_path(const ob::SpaceInformationPtr& si, const Path& path) {
    og::PathGeometric copy(si);
    ob::ScopedState<> state(si->getStateSpace());
    for (const Configuration& q : path) {
        std::copy(q.begin(), q.end(), values(state.get()));
        copy.append(state.get());
    }
    return copy;
}

ob::SpaceInformationPtr make_space(const Query& query, SeedSequence& seeds, Meter& meter) {
    const SeededSection seeded(seeds);
    return make_problem(query, false, seeds, meter)->getSpaceInformation();
}

}  // namespace

double distance(const Configuration& a, const Configuration& b) {
    double sum = 0;
    for (std::size_t i = 0; i < a.size(); ++i) sum += (b[i] - a[i]) * (b[i] - a[i]);
    return std::sqrt(sum);
}

double length(const Path& path) {
    double sum = 0;
    for (std::size_t i = 1; i < path.size(); ++i) sum += distance(path[i - 1], path[i]);
    return sum;
}

Path waypoints(const og::PathGeometric& path, std::size_t dof) {
    Path rows;
    for (std::size_t i = 0; i < path.getStateCount(); ++i) {
        const double* q = values(path.getState(i));
        Configuration row(q, q + dof);
        if (rows.empty() || rows.back() != row) rows.push_back(row);
    }
    return rows;
}

std::size_t blocked_edge(const Query& query, const Path& path) {
    std::uint64_t uncounted = 0;
    for (std::size_t i = 1; i < path.size(); ++i)
        if (!edge_is_free(query.robot, query.scene, path[i - 1].data(), path[i].data(), query.resolution, uncounted))
            return i;
    return 0;
}

void shorten(og::PathGeometric& path, SeedSequence& seeds) {
    og::PathSimplifier simplifier = make_simplifier(path, seeds);
    shorten_by(simplifier, path);
}

void shorten_partly(og::PathGeometric& path, SeedSequence& seeds) {
    const auto steps = static_cast<unsigned int>(seeds.next() % (2 * path.getStateCount() + 1));
    og::PathSimplifier simplifier = make_simplifier(path, seeds);
    if (steps > 0) shortcut(simplifier, path, steps, 0);
}

Path simplify(const Robot& robot, const Scene& scene, const Path& path, std::uint64_t seed, double resolution) {
    if (path.empty()) throw std::invalid_argument("path: at least one waypoint is needed");
    const Query query{robot, scene, path.front(), {path.back()}, resolution};
    if (!is_free(robot, scene, path.front().data())) throw std::invalid_argument("path: waypoint 0 is in collision");
    if (const std::size_t edge = blocked_edge(query, path))
        throw std::invalid_argument("path: edge " + std::to_string(edge) + " is not free");

    Meter unlimited({UINT64_MAX, UINT64_MAX, HUGE_VAL});  // counts, but nothing here asks it whether to go on
    SeedSequence seeds{seed};
    const ob::SpaceInformationPtr si = make_space(query, seeds, unlimited);
    constexpr int attempts = 3;  // a shortcut ends between checked states: a few paths in a thousand touch there
    for (int attempt = 0; attempt < attempts; ++attempt) {
        og::PathGeometric work = ompl_path(si, path);
        og::PathSimplifier simplifier = make_simplifier(work, seeds);
        shorten_by(simplifier, work);
        const Path cornered = waypoints(work, robot.dof);
        smooth_by(simplifier, work);
        for (Path shortened : {waypoints(work, robot.dof), cornered}) {
            // Interpolation may leave the ends a rounding error away from what they were.
            shortened.front() = path.front();
            shortened.back() = path.back();
            if (length(shortened) <= length(path) && !blocked_edge(query, shortened)) return shortened;
        }
    }
    return path;
}

}  // namespace plancurate
