#include "planning/planners.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <sstream>
#include <stdexcept>

#include <ompl/base/spaces/RealVectorStateSpace.h>
#include <ompl/geometric/planners/est/ProjEST.h>
#include <ompl/geometric/planners/kpiece/BKPIECE1.h>
#include <ompl/geometric/planners/kpiece/KPIECE1.h>
#include <ompl/geometric/planners/kpiece/LBKPIECE1.h>
#include <ompl/geometric/planners/pdst/PDST.h>
#include <ompl/geometric/planners/sbl/SBL.h>
#include <ompl/geometric/planners/stride/STRIDE.h>

#include "planning/roadmap_planners.hpp"
#include "planning/seeding.hpp"
#include "planning/tree_planners.hpp"

namespace plancurate {

namespace {

template <class Planner>
ob::PlannerPtr make(const ob::SpaceInformationPtr& si) {
    return std::make_shared<Planner>(si);
}

// Lengths are Euclidean, in rad. Everything not named here is OMPL's own default.
const std::vector<PlannerEntry>& registry() {
    static const std::vector<PlannerEntry> entries = {
        {"RRT", make<RRT>, false, {{"range", "1"}, {"goal_bias", "0.1"}}},
        {"RRTstar", make<RRTstar>, true, {{"range", "1"}, {"goal_bias", "0.1"}, {"use_k_nearest", "0"}}},
        {"RRTConnect", make<RRTConnect>, false, {{"range", "1"}}},
        {"TRRT", make<TRRT>, false, {{"range", "1"}, {"goal_bias", "0.1"}}},
        {"PRM", make<Roadmap<og::PRM>>, false, {{"max_nearest_neighbors", "10"}}},
        {"PRMstar", make<Roadmap<og::PRMstar>>, true, {}},
        {"KPIECE1", make<og::KPIECE1>, false, {{"range", "1"}, {"goal_bias", "0.2"}}},
        {"BKPIECE1", make<og::BKPIECE1>, false, {{"range", "1"}}},
        {"LBKPIECE1", make<og::LBKPIECE1>, false, {{"range", "1"}}},
        {"FMT", make<FMT>, true, {{"num_samples", "100"}, {"radius_multiplier", "0.8"}}},
        {"BFMT", make<BFMT>, true, {{"num_samples", "100"}, {"radius_multiplier", "0.8"}, {"extended_fmt", "0"}}},
        {"PDST", make<og::PDST>, false, {{"goal_bias", "0.3"}}},
        {"STRIDE", make<og::STRIDE>, false, {{"range", "1"}, {"goal_bias", "0.2"}}},
        {"BiTRRT", make<BiTRRT>, false, {{"range", "1"}}},
        {"LBTRRT", make<LBTRRT>, true, {{"range", "1"}, {"goal_bias", "0.1"}}},
        {"BiEST", make<BiEST>, false, {{"range", "2"}}},
        {"ProjEST", make<og::ProjEST>, false, {{"range", "1"}, {"goal_bias", "0.4"}}},
        {"LazyPRM", make<LazyRoadmap<og::LazyPRM>>, false, {{"range", "3"}, {"max_nearest_neighbors", "8"}}},
        {"LazyPRMstar", make<LazyRoadmap<og::LazyPRMstar>>, true, {}},
        {"SPARS", make<SPARS>, true, {{"sparse_delta_fraction", "0.6"}}},
        {"SPARStwo", make<SPARStwo>, true, {{"sparse_delta_fraction", "0.8"}}},
        {"EST", make<EST>, false, {{"range", "1"}}},
        {"SBL", make<og::SBL>, false, {{"range", "1"}}},
    };
    return entries;
}

std::string joined(const std::vector<std::string>& names) {
    std::string text;
    for (const std::string& name : names) text += (text.empty() ? "" : ", ") + name;
    return text;
}

// A range of next to nothing keeps planners in loops that don't look at the budget; 0 lets OMPL choose.
constexpr double shortest_range = 0.01;

// OMPL's suggestions are "0,1" for switches, "low:high" or "low:step:high" for numbers.
bool suits(const std::string& name, const std::string& value, const std::string& suggestion) {
    if (suggestion == "0,1") return value == "0" || value == "1";
    std::size_t read = 0;
    double number = std::numeric_limits<double>::quiet_NaN();
    try {
        number = std::stod(value, &read);
    } catch (const std::exception&) {
        return false;
    }
    if (read != value.size() || !std::isfinite(number)) return false;
    if (name == "range" && number != 0 && number < shortest_range) return false;
    const std::size_t first = suggestion.find(':'), last = suggestion.rfind(':');
    if (first == std::string::npos) return true;
    return number >= std::stod(suggestion.substr(0, first)) && number <= std::stod(suggestion.substr(last + 1));
}

void set(ob::ParamSet& declared, const std::string& planner, const std::string& name, const std::string& value) {
    std::vector<std::string> names;
    declared.getParamNames(names);
    if (!declared.hasParam(name))
        throw std::invalid_argument(planner + " has no parameter '" + name + "'; it has " +
                                    (names.empty() ? "none" : joined(names)));
    if (declared.getParam(name)->getValue() == value) return;  // some of OMPL's own defaults are outside its ranges
    const std::string suggestion = declared.getParam(name)->getRangeSuggestion();
    std::string valid = suggestion.empty() ? "" : "; its range is " + suggestion;
    try {
        if (suits(name, value, suggestion) && declared.setParam(name, value)) return;
    } catch (const std::exception& error) {
        valid = std::string("; ") + error.what();
    }
    throw std::invalid_argument(planner + "." + name + " = '" + value + "' is not a value that it takes" + valid);
}

}  // namespace

const PlannerEntry& find_planner(const std::string& name) {
    std::vector<std::string> names;
    for (const PlannerEntry& entry : registry()) {
        if (entry.name == name) return entry;
        names.push_back(entry.name);
    }
    throw std::invalid_argument("unknown planner '" + name + "'; there are " + joined(names));
}

ob::PlannerPtr make_planner(const PlannerEntry& entry, const ob::SpaceInformationPtr& si, const Parameters& params) {
    ob::PlannerPtr planner = entry.make(si);
    Parameters chosen = params;
    chosen.insert(entry.defaults.begin(), entry.defaults.end());
    // LazyPRM forgets how many neighbours to take when its range is set, so the range comes first.
    if (const auto range = chosen.find("range"); range != chosen.end())
        set(planner->params(), entry.name, range->first, range->second);
    for (const auto& [name, value] : chosen)
        if (name != "range") set(planner->params(), entry.name, name, value);
    return planner;
}

std::vector<PlannerInfo> planners() {
    SeedSequence seeds{0};
    const SeededSection seeded(seeds);
    auto space = std::make_shared<ob::RealVectorStateSpace>(6);  // some of OMPL's defaults depend on the joints
    space->setBounds(-1, 1);
    const auto si = std::make_shared<ob::SpaceInformation>(space);
    std::vector<PlannerInfo> infos;
    for (const PlannerEntry& entry : registry()) {
        PlannerInfo info{entry.name, entry.defaults, entry.optimizing, true, ""};
        Parameters declared;
        make_planner(entry, si, {})->params().getParams(declared);
        info.params.insert(declared.begin(), declared.end());  // ours stay: not everything declared can be read back
        infos.push_back(info);
    }
    return infos;
}

}  // namespace plancurate
