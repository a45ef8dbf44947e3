#include "collision/collision.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

#include "collision/kinematics.hpp"
#include "collision/run_query.hpp"

namespace plancurate {

namespace {

// Queries each eight rows of q: make(rows) builds the query, take(query, first row, rows) gets its result.
template <class Make, class Take>
void query_rows(const Robot& robot, const Scene& scene, const double* q, std::size_t count, const Make& make,
                const Take& take) {
    std::vector<Doubles> lanes(robot.dof);
    for (std::size_t row = 0; row < count; row += kLanes) {
        const int rows = static_cast<int>(std::min<std::size_t>(kLanes, count - row));
        load_rows(q + row * robot.dof, rows, robot.dof, robot.dof, lanes.data());
        auto query = make(rows);
        run_query(robot, scene, lanes.data(), query);
        take(query, row, rows);
    }
}

// The number of steps an edge is cut into; negative where the edge is not finite.
double edge_steps(const double* q0, const double* q1, int dof, double resolution) {
    double longest = 0;
    for (int i = 0; i < dof; ++i) {
        const double length = std::abs(q1[i] - q0[i]);
        if (!std::isfinite(length)) return -1;
        longest = std::max(longest, length);
    }
    return std::ceil(longest / resolution);
}

// Counts 0 .. count - 1 in bit-reversed order, which halves the gaps between the visited again and again.
class CoarseToFine {
public:
    explicit CoarseToFine(std::uint64_t count) : count_(count) {
        while ((std::uint64_t{1} << bits_) < count) ++bits_;
    }

    std::uint64_t next() {
        std::uint64_t reversed;
        do {
            reversed = 0;
            for (int bit = 0; bit < bits_; ++bit) reversed |= ((turn_ >> bit) & 1) << (bits_ - 1 - bit);
            ++turn_;
        } while (reversed >= count_);
        return reversed;
    }

private:
    std::uint64_t count_, turn_ = 0;
    int bits_ = 0;
};

}  // namespace

bool is_free(const Robot& robot, const Scene& scene, const double* q) {
    bool free;
    are_free(robot, scene, q, 1, &free);
    return free;
}

void are_free(const Robot& robot, const Scene& scene, const double* q, std::size_t count, bool* free) {
    const auto make = [&](int rows) { return FreeQuery{scene.margin, first_lanes(rows), false}; };
    query_rows(robot, scene, q, count, make, [&](const FreeQuery& query, std::size_t row, int rows) {
        for (int lane = 0; lane < rows; ++lane) free[row + lane] = query.active[lane] != 0;
    });
}

bool edge_is_free(const Robot& robot, const Scene& scene, const double* q0, const double* q1, double resolution,
                  std::uint64_t& state_checks) {
    const double steps = edge_steps(q0, q1, robot.dof, resolution);
    if (steps < 0) return false;
    // Lane l of block b looks at state l * blocks + b, so every block spans the edge.
    const std::uint64_t states = static_cast<std::uint64_t>(steps) + 1;
    const std::uint64_t blocks = (states + kLanes - 1) / kLanes;
    CoarseToFine order(blocks);
    std::vector<Doubles> lanes(robot.dof);
    for (std::uint64_t visited = 0; visited < blocks; ++visited) {
        const std::uint64_t block = order.next();
        const int count = static_cast<int>((states - block + blocks - 1) / blocks);
        Doubles t;
        for (int lane = 0; lane < kLanes; ++lane) {
            const std::uint64_t state = std::min(lane, count - 1) * blocks + block;
            t[lane] = static_cast<double>(state) / std::max(steps, 1.0);
        }
        for (int i = 0; i < robot.dof; ++i) lanes[i] = (1.0 - t) * q0[i] + t * q1[i];
        FreeQuery query{scene.margin, first_lanes(count), true};
        run_query(robot, scene, lanes.data(), query);
        state_checks += count;
        if (query.done()) return false;
    }
    return true;
}

void clearances(const Robot& robot, const Scene& scene, const double* q, std::size_t count, double* distances) {
    const auto make = [](int) { return ClearanceQuery{}; };
    query_rows(robot, scene, q, count, make, [&](const ClearanceQuery& query, std::size_t row, int rows) {
        for (int lane = 0; lane < rows; ++lane) distances[row + lane] = query.smallest[lane];
    });
}

void way_clearances(const Robot& robot, const Scene& scene, const double* q, std::size_t ways, std::size_t points,
                    float most, double* distances) {
    const std::size_t way_size = points * robot.dof;
    std::vector<Doubles> lanes(robot.dof);
    for (std::size_t way = 0; way < ways; way += kLanes) {
        const int together = static_cast<int>(std::min<std::size_t>(kLanes, ways - way));
        WayQuery query(most, first_lanes(together));
        for (std::size_t point = 0; point < points && !query.done(); ++point) {
            load_rows(q + way * way_size + point * robot.dof, together, way_size, robot.dof, lanes.data());
            run_query(robot, scene, lanes.data(), query);
            query.next_configuration();
        }
        for (int lane = 0; lane < together; ++lane) distances[way + lane] = std::max(query.least[lane], 0.0f);
    }
}

}  // namespace plancurate
