// OMPL's roadmap planners without what makes them depend on the machine: a second thread that looks for the
// solution, building phases measured in seconds, ties between neighbours settled by address. The roadmaps grow by
// OMPL's own steps in this thread; the query is asked in between.
#pragma once

#include <cstddef>
#include <memory>
#include <vector>

#include <ompl/geometric/planners/prm/LazyPRM.h>
#include <ompl/geometric/planners/prm/LazyPRMstar.h>
#include <ompl/geometric/planners/prm/PRM.h>
#include <ompl/geometric/planners/prm/PRMstar.h>
#include <ompl/geometric/planners/prm/SPARS.h>
#include <ompl/geometric/planners/prm/SPARStwo.h>

#include "planning/stable_nearest.hpp"

namespace plancurate {

namespace ob = ompl::base;
namespace og = ompl::geometric;

// Base: og::PRM or og::PRMstar.
template <class Base>
class Roadmap : public Base {
public:
    explicit Roadmap(const ob::SpaceInformationPtr& si) : Base(si) {
        this->nn_ = std::make_shared<StableNearest<typename Base::Vertex>>();
        this->nn_->setDistanceFunction([this](auto a, auto b) { return this->distanceFunction(a, b); });
    }

    ob::PlannerStatus solve(const ob::PlannerTerminationCondition& ptc) override;

private:
    // Growing and expanding alternate two to one, as in OMPL, but in milestones instead of seconds.
    static constexpr unsigned growth = 20, expansion = 10;

    void connect_query();
    bool query(ob::PathPtr& path);
};

// Base: og::LazyPRM or og::LazyPRMstar. OMPL's take a single goal; this one finds the best of all goals.
template <class Base>
class LazyRoadmap : public Base {
    using Vertex = typename Base::Vertex;

public:
    explicit LazyRoadmap(const ob::SpaceInformationPtr& si) : Base(si) {
        this->nn_ = std::make_shared<StableNearest<Vertex>>();
        this->nn_->setDistanceFunction([this](auto a, auto b) { return this->distanceFunction(a, b); });
    }

    ob::PlannerStatus solve(const ob::PlannerTerminationCondition& ptc) override;

private:
    bool grow(ob::State* work, const ob::PlannerTerminationCondition& ptc);
    bool query(const ob::PlannerTerminationCondition& ptc);
    ob::PathPtr shortest_path(Vertex goal, const ob::PlannerTerminationCondition& ptc);

    ob::PathPtr best_;
};

class SPARS : public og::SPARS {
public:
    explicit SPARS(const ob::SpaceInformationPtr& si) : og::SPARS(si) {
        nn_ = std::make_shared<StableNearest<DenseVertex>>();
        snn_ = std::make_shared<StableNearest<SparseVertex>>();
    }

    ob::PlannerStatus solve(const ob::PlannerTerminationCondition& ptc) override;
};

class SPARStwo : public og::SPARStwo {
public:
    explicit SPARStwo(const ob::SpaceInformationPtr& si) : og::SPARStwo(si) {
        nn_ = std::make_shared<StableNearest<Vertex>>();
    }

    ob::PlannerStatus solve(const ob::PlannerTerminationCondition& ptc) override;
};

extern template class Roadmap<og::PRM>;
extern template class Roadmap<og::PRMstar>;
extern template class LazyRoadmap<og::LazyPRM>;
extern template class LazyRoadmap<og::LazyPRMstar>;

}  // namespace plancurate
