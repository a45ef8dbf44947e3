// The planners by their OMPL class names, each with the parameters used here.
#pragma once

#include <map>
#include <string>
#include <vector>

#include <ompl/base/Planner.h>

namespace plancurate {

using Parameters = std::map<std::string, std::string>;  // OMPL's parameter names -> values as text

struct PlannerEntry {
    std::string name;
    ompl::base::PlannerPtr (*make)(const ompl::base::SpaceInformationPtr&);
    bool optimizing;  // goes on improving its path until the budget ends or nothing shorter is possible
    Parameters defaults;
};

struct PlannerInfo {
    std::string name;
    Parameters params;  // all that OMPL declares, with the values used unless told otherwise
    bool optimizing;
    bool deterministic;
    std::string note;  // why it isn't deterministic, or ""
};

// Throws std::invalid_argument that lists the valid names.
const PlannerEntry& find_planner(const std::string& name);

// A new planner with its defaults and then `params` set; to be called inside a SeededSection. Throws
// std::invalid_argument for a name or value that OMPL doesn't take, saying what it would.
ompl::base::PlannerPtr make_planner(const PlannerEntry& entry, const ompl::base::SpaceInformationPtr& si,
                                    const Parameters& params);

std::vector<PlannerInfo> planners();

}  // namespace plancurate
