#include "planning/relax.hpp"

#include <algorithm>
#include <cstdint>
#include <limits>
#include <vector>

namespace plancurate {

namespace {

constexpr double kComfort = 0.08;    // m: a clearance that is worth no detour any more
constexpr float kFar = 0.081f;       // m: comfortable whatever single precision makes of it
constexpr double kPrice = 4;         // touching costs so many times its length more
constexpr std::size_t kSamples = 6;  // of the clearance along an edge

// Where the clearance along an edge is looked at.
void append_samples(const Configuration& from, const Configuration& to, std::vector<double>& states) {
    for (std::size_t i = 0; i < kSamples; ++i) {
        const double share = (static_cast<double>(i) + 0.5) / kSamples;
        for (std::size_t j = 0; j < from.size(); ++j) states.push_back(from[j] + share * (to[j] - from[j]));
    }
}

// What an edge of this length costs with these clearances at its samples.
double edge_cost(double length, const double* clearance) {
    double sum = 0;
    for (std::size_t i = 0; i < kSamples; ++i) {
        const double lacking = 1 - std::clamp(clearance[i], 0.0, kComfort) / kComfort;
        sum += lacking * lacking;
    }
    return length * (1 + kPrice * (sum / kSamples));
}

// The first place over which the way from `before` to `after` costs least.
const Configuration& cheapest(const Robot& robot, const Scene& scene, const Configuration& before,
                              const std::vector<Configuration>& places, const Configuration& after) {
    thread_local std::vector<double> states, clearance;  // scratch memory
    states.clear();
    for (const Configuration& place : places) {
        append_samples(before, place, states);
        append_samples(place, after, states);
    }
    const std::size_t count = places.size() * 2 * kSamples;
    clearance.resize(count);
    way_clearances(robot, scene, states.data(), count, 1, kFar, clearance.data());
    std::size_t best = 0;
    double least = std::numeric_limits<double>::infinity();
    for (std::size_t i = 0; i < places.size(); ++i) {
        const double* along = clearance.data() + i * 2 * kSamples;
        const double cost = edge_cost(distance(before, places[i]), along) +
                            edge_cost(distance(places[i], after), along + kSamples);
        if (cost < least) least = cost, best = i;
    }
    return places[best];
}

// Where the waypoint is, those around it and those toward the middle of its neighbours, all within the joint limits.
std::vector<Configuration> places_tried(const Robot& robot, const Path& path, std::size_t at, const Trials& trials,
                                        const double* offsets, const double* pulls) {
    const Configuration &q = path[at], &before = path[at - 1], &after = path[at + 1];
    std::vector<Configuration> places(1 + trials.drawn + trials.pulled, q);
    for (std::size_t j = 0; j < q.size(); ++j) {
        for (std::size_t k = 0; k < trials.drawn; ++k) places[1 + k][j] += offsets[k * q.size() + j];
        for (std::size_t k = 0; k < trials.pulled; ++k)
            places[1 + trials.drawn + k][j] += pulls[k] * ((before[j] + after[j]) / 2 - q[j]);
        for (Configuration& place : places) place[j] = std::clamp(place[j], robot.lower[j], robot.upper[j]);
    }
    return places;
}

}  // namespace

Path relax(const Robot& robot, const Robot& measured, const Scene& scene, const Scene& kept, Path path,
           const Trials& trials, double resolution) {
    const auto is_open = [&](const Configuration& from, const Configuration& to) {
        std::uint64_t uncounted = 0;
        return edge_is_free(robot, kept, from.data(), to.data(), resolution, uncounted);
    };
    const double *offsets = trials.offsets, *pulls = trials.pulls;
    for (std::size_t round = 0; round < trials.rounds; ++round) {
        for (const std::size_t first : {1, 2}) {  // every other waypoint, so that its neighbours stay where they are
            for (std::size_t at = first; at + 1 < path.size(); at += 2) {
                const auto places = places_tried(robot, path, at, trials, offsets, pulls);
                const Configuration& chosen = cheapest(measured, scene, path[at - 1], places, path[at + 1]);
                const bool moves = &chosen != &places.front();
                if (moves && is_open(path[at - 1], chosen) && is_open(chosen, path[at + 1])) path[at] = chosen;
                offsets += trials.drawn * path[at].size();
                pulls += trials.pulled;
            }
        }
    }
    return path;
}

}  // namespace plancurate
