#include "planning/problem.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <numeric>
#include <sstream>
#include <utility>

#include <ompl/base/ProjectionEvaluator.h>
#include <ompl/base/goals/GoalStates.h>

namespace plancurate {

namespace ob = ompl::base;

namespace {

// The first two joints, as MoveIt configures it for this kind of arm: they move the tool farthest. Cell sizes and
// bounds come from the limits; OMPL would estimate them from random samples.
class FirstJoints : public ob::ProjectionEvaluator {
public:
    explicit FirstJoints(const ob::RealVectorStateSpace* space) : ob::ProjectionEvaluator(space), joints_(space) {}

    unsigned int getDimension() const override { return std::min(2u, joints_->getDimension()); }

    void defaultCellSizes() override {
        constexpr double cells = 20;
        const ob::RealVectorBounds& limits = joints_->getBounds();
        const unsigned int n = getDimension();
        bounds_.resize(n);
        cellSizes_.resize(n);
        for (unsigned int i = 0; i < n; ++i) {
            bounds_.low[i] = limits.low[i];
            bounds_.high[i] = limits.high[i];
            cellSizes_[i] = (limits.high[i] - limits.low[i]) / cells;
        }
    }

    void project(const ob::State* state, Eigen::Ref<Eigen::VectorXd> projection) const override {
        std::copy_n(values(state), getDimension(), projection.data());
    }

private:
    const ob::RealVectorStateSpace* joints_;
};

// Uniform in the limits, but for a share of samples around the goals. Without these a goal behind an obstacle is
// rarely found by trees that grow from the start alone and by small roadmaps: they try the straight way to it, and
// otherwise wait for a sample of the whole space to fall near it.
class JointSampler : public ob::RealVectorStateSampler {
public:
    JointSampler(const ob::StateSpace* space, const std::vector<Configuration>& goals)
        : ob::RealVectorStateSampler(space), goals_(goals) {}

    void sampleUniform(ob::State* state) override {
        constexpr double share = 0.1, radius = 1;  // radius: rad, joint by joint
        if (rng_.uniform01() >= share) return ob::RealVectorStateSampler::sampleUniform(state);
        const Configuration& goal = goals_[rng_.uniformInt(0, static_cast<int>(goals_.size()) - 1)];
        const double reach = radius * rng_.uniform01();
        const ob::RealVectorBounds& limits = space_->as<ob::RealVectorStateSpace>()->getBounds();
        for (std::size_t i = 0; i < goal.size(); ++i)
            values(state)[i] = rng_.uniformReal(std::max(limits.low[i], goal[i] - reach),
                                                std::min(limits.high[i], goal[i] + reach));
    }

private:
    const std::vector<Configuration>& goals_;
};

class JointSpace : public ob::RealVectorStateSpace {
public:
    JointSpace(const Query& query, SeedSequence& seeds) : ob::RealVectorStateSpace(query.robot.dof) {
        ob::RealVectorBounds limits(query.robot.dof);
        limits.low = query.robot.lower;
        limits.high = query.robot.upper;
        setBounds(limits);
        setStateSamplerAllocator([&query, &seeds](const ob::StateSpace* space) -> ob::StateSamplerPtr {
            const SeededSection seeded(seeds);
            return std::make_shared<JointSampler>(space, query.goals);
        });
    }

    void registerProjections() override { registerDefaultProjection(std::make_shared<FirstJoints>(this)); }
};

class StateChecker : public ob::StateValidityChecker {
public:
    StateChecker(const ob::SpaceInformationPtr& si, const Query& query, Meter& meter)
        : ob::StateValidityChecker(si), robot_(query.robot), scene_(query.scene), meter_(meter) {}

    bool isValid(const ob::State* state) const override {
        ++meter_.state_checks;
        return is_free(robot_, scene_, values(state));
    }

private:
    const Robot& robot_;
    const Scene& scene_;
    Meter& meter_;
};

class EdgeChecker : public ob::MotionValidator {
public:
    EdgeChecker(const ob::SpaceInformationPtr& si, const Query& query, Meter& meter)
        : ob::MotionValidator(si), robot_(query.robot), scene_(query.scene), resolution_(query.resolution), meter_(meter) {}

    bool checkMotion(const ob::State* from, const ob::State* to) const override {
        ++meter_.motion_checks;
        return edge_is_free(robot_, scene_, values(from), values(to), resolution_, meter_.state_checks);
    }

    // Also gives the last free state and its place on the edge. `last.first` may be null, `from` or `to`.
    bool checkMotion(const ob::State* from, const ob::State* to, std::pair<ob::State*, double>& last) const override {
        ++meter_.motion_checks;
        const std::size_t n = robot_.dof;
        const Configuration a(values(from), values(from) + n), b(values(to), values(to) + n);
        const std::size_t steps = step_count(a, b);
        for (std::size_t first = 0; first <= steps; first += block) {
            const std::size_t count = std::min(block, steps + 1 - first);
            const std::size_t free = leading_free(a, b, first, count, steps);
            if (free == count) continue;
            const std::size_t last_free = first + free == 0 ? 0 : first + free - 1;
            last.second = static_cast<double>(last_free) / steps;
            if (last.first != nullptr) between(a, b, last.second, values(last.first));
            return false;
        }
        return true;
    }

private:
    static constexpr std::size_t block = 8;  // what the kernel takes at a time

    std::size_t step_count(const Configuration& a, const Configuration& b) const {
        double widest = 0;
        for (std::size_t i = 0; i < a.size(); ++i) widest = std::max(widest, std::abs(b[i] - a[i]));
        return std::max<std::size_t>(1, static_cast<std::size_t>(std::ceil(widest / resolution_)));
    }

    static void between(const Configuration& a, const Configuration& b, double t, double* q) {
        for (std::size_t i = 0; i < a.size(); ++i) q[i] = (1 - t) * a[i] + t * b[i];
    }

    // How many of the states first .. first + count - 1 are free before the first that is not.
    std::size_t leading_free(const Configuration& a, const Configuration& b, std::size_t first, std::size_t count,
                             std::size_t steps) const {
        Configuration q(count * a.size());
        for (std::size_t i = 0; i < count; ++i)
            between(a, b, static_cast<double>(first + i) / steps, q.data() + i * a.size());
        bool free[block];
        are_free(robot_, scene_, q.data(), count, free);
        meter_.state_checks += count;
        return std::find(free, free + count, false) - free;
    }

    const Robot& robot_;
    const Scene& scene_;
    double resolution_;
    Meter& meter_;
};

class PathLength : public ob::PathLengthOptimizationObjective {
public:
    PathLength(const ob::SpaceInformationPtr& si, SeedSequence& seeds)
        : ob::PathLengthOptimizationObjective(si), seeds_(seeds) {}

    ob::InformedSamplerPtr allocInformedStateSampler(const ob::ProblemDefinitionPtr& problem,
                                                     unsigned int max_calls) const override {
        const SeededSection seeded(seeds_);
        return ob::PathLengthOptimizationObjective::allocInformedStateSampler(problem, max_calls);
    }

private:
    SeedSequence& seeds_;
};

double distance(const Configuration& a, const Configuration& b) {
    double sum = 0;
    for (std::size_t i = 0; i < a.size(); ++i) sum += (b[i] - a[i]) * (b[i] - a[i]);
    return std::sqrt(sum);
}

// No path is shorter than the straight line to the nearest goal, so a planner that has one as short is done.
double cost_threshold(const Query& query, bool optimizing) {
    double nearest = std::numeric_limits<double>::infinity();
    if (!optimizing) return nearest;
    for (const Configuration& goal : query.goals) nearest = std::min(nearest, distance(query.start, goal));
    return nearest * (1 + 1e-9) + 1e-12;
}

std::vector<std::size_t> shuffled(std::size_t count, SeedSequence& seeds) {
    std::vector<std::size_t> order(count);
    std::iota(order.begin(), order.end(), 0);
    for (std::size_t i = count; i > 1; --i) std::swap(order[i - 1], order[seeds.next() % i]);
    return order;
}

ob::SpaceInformationPtr make_space(const Query& query, SeedSequence& seeds, Meter& meter) {
    auto space = std::make_shared<JointSpace>(query, seeds);
    auto si = std::make_shared<ob::SpaceInformation>(space);
    si->setStateValidityChecker(std::make_shared<StateChecker>(si, query, meter));
    si->setMotionValidator(std::make_shared<EdgeChecker>(si, query, meter));
    si->setup();
    return si;
}

}  // namespace

bool Meter::spent() {
    ++polls;
    if (!exhausted.empty()) return true;
    if (state_checks >= budget_.state_checks) exhausted = "state_checks";
    else if (polls >= budget_.polls) exhausted = "polls";
    else if (seconds() >= budget_.seconds) exhausted = "seconds";
    return !exhausted.empty();
}

double Meter::seconds() const { return std::chrono::duration<double>(Clock::now() - begin_).count(); }

std::string why_unusable(const Query& query, const Configuration& q, const std::string& name) {
    const Robot& robot = query.robot;
    for (int i = 0; i < robot.dof; ++i)
        if (!(q[i] >= robot.lower[i] && q[i] <= robot.upper[i])) {
            std::ostringstream text;
            text << name << ": joint " << i + 1 << " = " << q[i] << " is outside its limits " << robot.lower[i] << " .. "
                 << robot.upper[i];
            return text.str();
        }
    return is_free(robot, query.scene, q.data()) ? "" : name + " is in collision";
}

ob::ProblemDefinitionPtr make_problem(const Query& query, bool optimizing, SeedSequence& seeds, Meter& meter) {
    const ob::SpaceInformationPtr si = make_space(query, seeds, meter);
    auto problem = std::make_shared<ob::ProblemDefinition>(si);
    ob::ScopedState<> state(si->getStateSpace());
    std::copy(query.start.begin(), query.start.end(), values(state.get()));
    problem->addStartState(state);

    auto goals = std::make_shared<ob::GoalStates>(si);
    for (const std::size_t i : shuffled(query.goals.size(), seeds)) {
        std::copy(query.goals[i].begin(), query.goals[i].end(), values(state.get()));
        goals->addState(state.get());
    }
    problem->setGoal(goals);

    auto objective = std::make_shared<PathLength>(si, seeds);
    objective->setCostThreshold(ob::Cost(cost_threshold(query, optimizing)));
    problem->setOptimizationObjective(objective);
    return problem;
}

}  // namespace plancurate
