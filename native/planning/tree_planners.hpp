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

#include "planning/stable_nearest.hpp"

namespace plancurate {

namespace ob = ompl::base;
namespace og = ompl::geometric;

struct RRT : og::RRT {
    explicit RRT(const ob::SpaceInformationPtr& si) : og::RRT(si) { nn_ = std::make_shared<StableNearest<Motion*>>(); }
};

struct RRTstar : og::RRTstar {
    explicit RRTstar(const ob::SpaceInformationPtr& si) : og::RRTstar(si) {
        nn_ = std::make_shared<StableNearest<Motion*>>();
    }

    void setup() override;
};

struct TRRT : og::TRRT {
    explicit TRRT(const ob::SpaceInformationPtr& si) : og::TRRT(si) {
        nearestNeighbors_ = std::make_shared<StableNearest<Motion*>>();
    }
};

struct LBTRRT : og::LBTRRT {
    explicit LBTRRT(const ob::SpaceInformationPtr& si) : og::LBTRRT(si) {
        nn_ = std::make_shared<StableNearest<Motion*>>();
    }

    ob::PlannerStatus solve(const ob::PlannerTerminationCondition& ptc) override;
};

struct RRTConnect : og::RRTConnect {
    explicit RRTConnect(const ob::SpaceInformationPtr& si) : og::RRTConnect(si) {
        tStart_ = std::make_shared<StableNearest<Motion*>>();
        tGoal_ = std::make_shared<StableNearest<Motion*>>();
    }
};

struct BiTRRT : og::BiTRRT {
    explicit BiTRRT(const ob::SpaceInformationPtr& si) : og::BiTRRT(si) {
        tStart_ = std::make_shared<StableNearest<Motion*>>();
        tGoal_ = std::make_shared<StableNearest<Motion*>>();
    }
};

struct EST : og::EST {
    explicit EST(const ob::SpaceInformationPtr& si) : og::EST(si) {
        nn_ = std::make_shared<StableNearest<Motion*>>();
    }
};

struct BiEST : og::BiEST {
    explicit BiEST(const ob::SpaceInformationPtr& si) : og::BiEST(si) {
        nnStart_ = std::make_shared<StableNearest<Motion*>>();
        nnGoal_ = std::make_shared<StableNearest<Motion*>>();
    }
};

struct FMT : og::FMT {
    explicit FMT(const ob::SpaceInformationPtr& si) : og::FMT(si) {
        nn_ = std::make_shared<StableNearest<Motion*>>();
    }

    void setup() override;
};

struct BFMT : og::BFMT {
    explicit BFMT(const ob::SpaceInformationPtr& si) : og::BFMT(si) {
        nn_ = std::make_shared<StableNearest<BiDirMotion*>>();
        precomputeNN_ = true;  // without it OMPL's 1.5 looks into neighbourhoods that were never found
    }

    void setup() override;

    // OMPL's goes wrong with more than one goal. This one takes them in turn, and where all have failed it starts
    // again with twice the samples.
    ob::PlannerStatus solve(const ob::PlannerTerminationCondition& ptc) override;
};

}  // namespace plancurate
