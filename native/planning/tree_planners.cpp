#include "planning/tree_planners.hpp"

#include <cmath>
#include <string>

#include <ompl/base/goals/GoalStates.h>
#include <ompl/util/Exception.h>

namespace plancurate {

namespace {

// OMPL's FMT takes the last of a state's neighbours without asking whether there is one.
void require_neighbours(bool nearest_k, bool extended, double multiplier, unsigned samples, double dimension) {
    if (extended && !nearest_k) throw ompl::Exception("taking neighbours by distance instead of number needs extended_fmt 0");
    const double k = std::pow(2 * multiplier, dimension) * std::exp(1.0) / dimension * std::log(samples);
    if (nearest_k && k <= 1) throw ompl::Exception("radius_multiplier or num_samples is too small to give neighbours");
}

ob::ProblemDefinitionPtr with_one_goal(const ob::ProblemDefinition& problem, const ob::State* goal) {
    const auto one = std::make_shared<ob::ProblemDefinition>(problem.getSpaceInformation());
    one->addStartState(problem.getStartState(0));
    one->setGoalState(goal);
    one->setOptimizationObjective(problem.getOptimizationObjective());
    return one;
}

}  // namespace

void RRTstar::setup() {
    if (useOrderedSampling_ && !useInformedSampling_ && !useRejectionSampling_)  // OMPL would read a null pointer
        throw ompl::Exception("ordered_sampling 1 needs informed_sampling 1 or sample_rejection 1");
    og::RRTstar::setup();
}

ob::PlannerStatus LBTRRT::solve(const ob::PlannerTerminationCondition& ptc) {
    // OMPL's 1.5 leaves the root's lower bound uninitialised, so the root is put in here.
    while (const ob::State* state = pis_.nextStart()) {
        auto* root = new Motion(si_);
        si_->copyState(root->state_, state);
        root->id_ = nn_->size();
        root->costLb_ = 0;
        idToMotionMap_.push_back(root);
        nn_->add(root);
        lowerBoundGraph_.addVertex(root->id_);
    }
    // OMPL's runs to the end of its budget even when its path can't be shorter.
    const double threshold = pdef_->getOptimizationObjective()->getCostThreshold().value();
    return og::LBTRRT::solve(
        ob::PlannerTerminationCondition([this, &ptc, threshold] { return ptc() || bestCost_ < threshold; }));
}

void FMT::setup() {
    require_neighbours(nearestK_, extendedFMT_, radiusMultiplier_, numSamples_, si_->getStateDimension());
    og::FMT::setup();
}

void BFMT::setup() {
    require_neighbours(nearestK_, extendedFMT_, radiusMultiplier_, numSamples_, si_->getStateDimension());
    og::BFMT::setup();
}

ob::PlannerStatus BFMT::solve(const ob::PlannerTerminationCondition& ptc) {
    const ob::ProblemDefinitionPtr whole = pdef_;
    const auto& goals = *whole->getGoal()->as<ob::GoalStates>();
    for (std::size_t i = 0; !ptc(); ++i) {
        if (i > 0 && i % goals.getStateCount() == 0) numSamples_ *= 2;
        clear();
        setProblemDefinition(with_one_goal(*whole, goals.getState(i % goals.getStateCount())));
        og::BFMT::solve(ptc);
        if (!pdef_->hasExactSolution()) continue;
        whole->addSolutionPath(pdef_->getSolutionPath(), false, 0.0, getName());
        return ob::PlannerStatus::EXACT_SOLUTION;
    }
    return ob::PlannerStatus::TIMEOUT;
}

}  // namespace plancurate
