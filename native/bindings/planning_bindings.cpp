#include <algorithm>
#include <cstdint>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include <nanobind/stl/map.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/vector.h>

#include <ompl/util/Console.h>

#include "bindings/arrays.hpp"
#include "planning/paths.hpp"
#include "planning/planning.hpp"
#include "planning/relax.hpp"

namespace plancurate {

namespace {

Path rows(const Array<double>& array) {
    Path list;
    for (const double* row = array.data(); row != array.data() + array.size(); row += array.shape(1))
        list.emplace_back(row, row + array.shape(1));
    return list;
}

// (w, n) waypoints; (0, n) when there is no path.
NumpyDoubles path_array(const Path& path, std::size_t dof) {
    NumpyDoubles array = new_array<double>({path.size(), dof});
    double* out = array.data();
    for (const Configuration& q : path) out = std::copy(q.begin(), q.end(), out);
    return array;
}

struct BoundResult {
    Result result;
    nb::object path;  // (w, n) array of its own
};

Simplification simplification_named(const std::string& name) {
    if (name == "off") return Simplification::off;
    if (name == "partial") return Simplification::partial;
    if (name == "full") return Simplification::full;
    throw std::invalid_argument("simplification: '" + name + "' is none of off, partial, full");
}

BoundResult bound_plan(const Robot& robot, const Scene& scene, const std::string& planner, const Array<double>& start,
                       const Array<double>& goals, const Parameters& params, std::uint64_t seed, const Budget& budget,
                       double resolution, const std::string& simplification) {
    require_shape(start, "start", {robot.dof});
    require_shape(goals, "goals", {-1, robot.dof});
    const Simplification amount = simplification_named(simplification);
    const Query query{robot, scene, {start.data(), start.data() + start.size()}, rows(goals), resolution};
    Result result;
    {
        const nb::gil_scoped_release released;
        result = plan(query, planner, params, seed, budget, amount);
    }
    nb::object path = nb::cast(path_array(result.path, robot.dof));
    return {std::move(result), std::move(path)};
}

NumpyDoubles bound_simplify(const Robot& robot, const Scene& scene, const Array<double>& path, std::uint64_t seed,
                            double resolution) {
    require_states(path, "path", robot.dof);
    require_resolution(resolution);
    Path shortened = rows(path);
    {
        const nb::gil_scoped_release released;
        shortened = simplify(robot, scene, shortened, seed, resolution);
    }
    return path_array(shortened, robot.dof);
}

NumpyDoubles bound_relax(const Robot& robot, const Robot& measured, const Scene& scene, const Scene& kept,
                         const Array<double>& path, const Array<double>& offsets, const Array<double>& pulls,
                         double resolution) {
    const std::size_t count = require_states(path, "path", robot.dof);
    require_shape(path, "path", {-1, measured.dof});
    if (count < 3) throw std::invalid_argument("path: at least three waypoints are needed");
    const auto inner = static_cast<std::int64_t>(count) - 2;
    require_shape(offsets, "offsets", {-1, inner, -1, robot.dof});
    require_finite(offsets, "offsets", robot.dof);
    require_shape(pulls, "pulls", {static_cast<std::int64_t>(offsets.shape(0)), inner, -1});
    require_finite(pulls, "pulls", 1);
    require_resolution(resolution);
    const Trials trials{offsets.shape(0), offsets.shape(2), pulls.shape(2), offsets.data(), pulls.data()};
    Path moved = rows(path);
    {
        const nb::gil_scoped_release released;
        moved = relax(robot, measured, scene, kept, std::move(moved), trials, resolution);
    }
    return path_array(moved, robot.dof);
}

template <auto member>
auto field() {
    return [](const BoundResult& bound) { return bound.result.*member; };
}

}  // namespace

}  // namespace plancurate

void bind_planning(nanobind::module_& module) {
    using namespace plancurate;
    ompl::msg::noOutputHandler();

    nb::class_<Budget>(module, "Budget")
        .def("__init__",
             [](Budget* budget, std::uint64_t state_checks, std::uint64_t polls, double seconds) {
                 new (budget) Budget{state_checks, polls, seconds};
             },
             nb::kw_only(), nb::arg("state_checks"), nb::arg("polls"), nb::arg("seconds"))
        .def_ro("state_checks", &Budget::state_checks)
        .def_ro("polls", &Budget::polls)
        .def_ro("seconds", &Budget::seconds);

    nb::class_<BoundResult>(module, "Result")
        .def_prop_ro("status", field<&Result::status>())
        .def_prop_ro("reason", field<&Result::reason>())
        .def_prop_ro("path", [](const BoundResult& bound) { return bound.path; })
        .def_prop_ro("cost", field<&Result::cost>())
        .def_prop_ro("goal_index", field<&Result::goal>())
        .def_prop_ro("state_checks", field<&Result::state_checks>())
        .def_prop_ro("motion_checks", field<&Result::motion_checks>())
        .def_prop_ro("polls", field<&Result::polls>())
        .def_prop_ro("seconds", field<&Result::seconds>())
        .def_prop_ro("termination", field<&Result::termination>());

    nb::class_<PlannerInfo>(module, "PlannerInfo")
        .def_ro("name", &PlannerInfo::name)
        .def_prop_ro("params", [](const PlannerInfo& info) { return info.params; })
        .def_ro("optimizing", &PlannerInfo::optimizing)
        .def_ro("deterministic", &PlannerInfo::deterministic)
        .def_ro("note", &PlannerInfo::note);

    module.def("plan", &bound_plan, nb::arg("robot"), nb::arg("scene"), nb::arg("planner"), nb::arg("start"),
               nb::arg("goals"), nb::kw_only(), nb::arg("params"), nb::arg("seed"), nb::arg("budget"),
               nb::arg("resolution"), nb::arg("simplification"));
    module.def("relax", &bound_relax, nb::arg("robot"), nb::arg("measured"), nb::arg("scene"), nb::arg("kept"),
               nb::arg("path"), nb::arg("offsets"), nb::arg("pulls"), nb::arg("resolution"));
    module.def("simplify", &bound_simplify, nb::arg("robot"), nb::arg("scene"), nb::arg("path"), nb::kw_only(),
               nb::arg("seed"), nb::arg("resolution") = 0.01);
    module.def("planners", &planners);
    module.def("ompl_version", &ompl_version);
}
