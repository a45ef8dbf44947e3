#include "planning/roadmap_planners.hpp"


namespace plancurate {

namespace {

ob::PlannerStatus report(const ob::ProblemDefinitionPtr& problem, const ob::PathPtr& path, const std::string& name) {
    if (!path) return ob::PlannerStatus::TIMEOUT;
    problem->addSolutionPath(path, false, -1.0, name);
    return ob::PlannerStatus::EXACT_SOLUTION;
}

}  // namespace

template <class Base>
void Roadmap<Base>::connect_query() {
    while (const ob::State* state = this->pis_.nextStart())
        this->startM_.push_back(this->addMilestone(this->si_->cloneState(state)));
    while (const ob::State* state = this->pis_.nextGoal())
        this->goalM_.push_back(this->addMilestone(this->si_->cloneState(state)));
}

template <class Base>
bool Roadmap<Base>::query(ob::PathPtr& path) {
    return this->maybeConstructSolution(this->startM_, this->goalM_, path);
}

template <class Base>
ob::PlannerStatus Roadmap<Base>::solve(const ob::PlannerTerminationCondition& ptc) {
    this->checkValidity();
    this->bestCost_ = this->opt_->infiniteCost();
    this->sampler_ = this->si_->allocValidStateSampler();
    this->simpleSampler_ = this->si_->allocStateSampler();
    connect_query();

    ob::PathPtr path;
    bool done = query(path);
    for (bool growing = true; !done && !ptc(); growing = !growing) {
        const unsigned long end = this->iterations_ + (growing ? growth : expansion);
        const ob::PlannerTerminationCondition stop([this, &ptc, end] { return ptc() || this->iterations_ >= end; });
        growing ? Base::growRoadmap(stop) : Base::expandRoadmap(stop);
        done = query(path);
    }
    return report(this->pdef_, path, this->getName());
}

// Adds a milestone. A lazy roadmap checks next to nothing, so its work is measured in polls: one an edge. False
// when the budget is spent.
template <class Base>
bool LazyRoadmap<Base>::grow(ob::State* work, const ob::PlannerTerminationCondition& ptc) {
    this->sampler_->sampleUniform(work);
    const Vertex added = this->addMilestone(this->si_->cloneState(work));
    bool more = !ptc();
    for (std::size_t edges = boost::out_degree(added, this->g_); more && edges > 1; --edges) more = !ptc();
    return more;
}

// The shortest path whose states and edges are free; those that turn out not to be leave the roadmap on the way.
template <class Base>
ob::PathPtr LazyRoadmap<Base>::shortest_path(Vertex goal, const ob::PlannerTerminationCondition& ptc) {
    const Vertex start = this->startM_.front();
    ob::PathPtr path;
    while (!path && this->vertexComponentProperty_[start] == this->vertexComponentProperty_[goal] && !ptc())
        path = this->constructSolution(start, goal);
    return path;
}

// Looks for a better path to each goal that can have one. True when none can be better than the best.
template <class Base>
bool LazyRoadmap<Base>::query(const ob::PlannerTerminationCondition& ptc) {
    for (const Vertex goal : this->goalM_) {
        if (!this->opt_->isCostBetterThan(this->costHeuristic(this->startM_.front(), goal), this->bestCost_)) continue;
        const ob::PathPtr path = shortest_path(goal, ptc);
        if (!path || !this->opt_->isCostBetterThan(path->cost(this->opt_), this->bestCost_)) continue;
        best_ = path;
        this->bestCost_ = path->cost(this->opt_);
    }
    return best_ && this->opt_->isSatisfied(this->bestCost_);
}

template <class Base>
ob::PlannerStatus LazyRoadmap<Base>::solve(const ob::PlannerTerminationCondition& ptc) {
    this->checkValidity();
    this->bestCost_ = this->opt_->infiniteCost();
    while (const ob::State* state = this->pis_.nextStart())
        this->startM_.push_back(this->addMilestone(this->si_->cloneState(state)));
    while (const ob::State* state = this->pis_.nextGoal())
        this->goalM_.push_back(this->addMilestone(this->si_->cloneState(state)));

    ob::State* work = this->si_->allocState();
    bool done = query(ptc);
    // Searching takes longer the larger the roadmap is, so it is done each time that this has grown by a tenth.
    for (std::size_t next = this->milestoneCount(); !done && grow(work, ptc);) {
        if (this->milestoneCount() < next) continue;
        done = query(ptc);
        next = this->milestoneCount() + 1 + this->milestoneCount() / 10;
    }
    this->si_->freeState(work);
    return report(this->pdef_, best_, this->getName());
}

template class Roadmap<og::PRM>;
template class Roadmap<og::PRMstar>;
template class LazyRoadmap<og::LazyPRM>;
template class LazyRoadmap<og::LazyPRMstar>;

ob::PlannerStatus SPARS::solve(const ob::PlannerTerminationCondition& ptc) {
    checkValidity();
    checkQueryStateInitialization();
    while (const ob::State* state = pis_.nextStart()) {
        addMilestone(si_->cloneState(state));
        startM_.push_back(addGuard(si_->cloneState(state), START));
    }
    while (const ob::State* state = pis_.nextGoal()) {
        addMilestone(si_->cloneState(state));
        goalM_.push_back(addGuard(si_->cloneState(state), GOAL));
    }

    ob::PathPtr path;
    std::size_t edges = 0;  // of the spanner when the query was last asked
    constructRoadmap(ob::PlannerTerminationCondition([&] {
        if (boost::num_edges(s_) != edges) addedSolution_ = haveSolution(startM_, goalM_, path);
        edges = boost::num_edges(s_);
        return addedSolution_ || reachedFailureLimit() || ptc();
    }));
    return report(pdef_, path, getName());
}

ob::PlannerStatus SPARStwo::solve(const ob::PlannerTerminationCondition& ptc) {
    checkValidity();
    checkQueryStateInitialization();
    while (const ob::State* state = pis_.nextStart()) startM_.push_back(addGuard(si_->cloneState(state), START));
    while (const ob::State* state = pis_.nextGoal()) goalM_.push_back(addGuard(si_->cloneState(state), GOAL));

    ob::PathPtr path;
    std::size_t edges = 0;  // of the spanner when the query was last asked
    constructRoadmap(ob::PlannerTerminationCondition([&] {
        if (boost::num_edges(g_) != edges) addedSolution_ = haveSolution(startM_, goalM_, path);
        edges = boost::num_edges(g_);
        return addedSolution_ || reachedFailureLimit() || ptc();
    }));
    return report(pdef_, path, getName());
}

}  // namespace plancurate
