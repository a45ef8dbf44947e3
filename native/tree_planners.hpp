// OMPL's tree planners with StableNearest, so that ties between neighbours are settled the same way every time.
// Each constructor only fills in the structure that setup() would otherwise choose.
#pragma once

#include <memory>

#include <ompl/geometric/planners/est/BiEST.h>
#include <ompl/geometric/planners/est/EST.h>
#include <ompl/geometric/planners/fmt/BFMT.h>
#include <ompl/geometric/planners/fmt/FMT.h>
#include <ompl/geometric/planners/rrt/BiTRRT.h>
#include <ompl/geometric/planners/rrt/LBTRRT.h>
#include <ompl/geometric/planners/rrt/RRT.h>
#include <ompl/geometric/planners/rrt/RRTConnect.h>
#include <ompl/geometric/planners/rrt/RRTstar.h>
#include <ompl/geometric/planners/rrt/TRRT.h>

#include "stable_nearest.hpp"

namespace plancurate {

namespace og = ompl::geometric;

struct RRT : og::RRT {
    explicit RRT(const ompl::base::SpaceInformationPtr& si) : og::RRT(si) {
        nn_ = std::make_shared<StableNearest<Motion*>>();
    }
};

struct RRTstar : og::RRTstar {
    explicit RRTstar(const ompl::base::SpaceInformationPtr& si) : og::RRTstar(si) {
        nn_ = std::make_shared<StableNearest<Motion*>>();
    }
};

struct RRTConnect : og::RRTConnect {
    explicit RRTConnect(const ompl::base::SpaceInformationPtr& si) : og::RRTConnect(si) {
        tStart_ = std::make_shared<StableNearest<Motion*>>();
        tGoal_ = std::make_shared<StableNearest<Motion*>>();
    }
};

struct TRRT : og::TRRT {
    explicit TRRT(const ompl::base::SpaceInformationPtr& si) : og::TRRT(si) {
        nearestNeighbors_ = std::make_shared<StableNearest<Motion*>>();
    }
};

struct BiTRRT : og::BiTRRT {
    explicit BiTRRT(const ompl::base::SpaceInformationPtr& si) : og::BiTRRT(si) {
        tStart_ = std::make_shared<StableNearest<Motion*>>();
        tGoal_ = std::make_shared<StableNearest<Motion*>>();
    }
};

struct LBTRRT : og::LBTRRT {
    explicit LBTRRT(const ompl::base::SpaceInformationPtr& si) : og::LBTRRT(si) {
        nn_ = std::make_shared<StableNearest<Motion*>>();
    }

    // OMPL's runs to the end of its budget even when its path can't be shorter.
    ompl::base::PlannerStatus solve(const ompl::base::PlannerTerminationCondition& ptc) override {
        const double threshold = pdef_->getOptimizationObjective()->getCostThreshold().value();
        return og::LBTRRT::solve(ompl::base::PlannerTerminationCondition(
            [this, &ptc, threshold] { return ptc() || bestCost_ < threshold; }));
    }
};

struct EST : og::EST {
    explicit EST(const ompl::base::SpaceInformationPtr& si) : og::EST(si) {
        nn_ = std::make_shared<StableNearest<Motion*>>();
    }
};

struct BiEST : og::BiEST {
    explicit BiEST(const ompl::base::SpaceInformationPtr& si) : og::BiEST(si) {
        nnStart_ = std::make_shared<StableNearest<Motion*>>();
        nnGoal_ = std::make_shared<StableNearest<Motion*>>();
    }
};

struct FMT : og::FMT {
    explicit FMT(const ompl::base::SpaceInformationPtr& si) : og::FMT(si) {
        nn_ = std::make_shared<StableNearest<Motion*>>();
    }
};

struct BFMT : og::BFMT {
    explicit BFMT(const ompl::base::SpaceInformationPtr& si) : og::BFMT(si) {
        nn_ = std::make_shared<StableNearest<BiDirMotion*>>();
    }
};

}  // namespace plancurate
