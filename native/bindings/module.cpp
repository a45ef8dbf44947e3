// The Python module plancurate.native: robots, scenes, kinematics and collision. Planning is bound beside it.

#include <nanobind/stl/optional.h>

#include "bindings/arrays.hpp"
#include "collision/collision.hpp"
#include "collision/kinematics.hpp"

using namespace nanobind::literals;

void bind_planning(nanobind::module_& module);

namespace plancurate {

namespace {

ShapeTable shape_table(const Array<std::int32_t>& kinds, const Array<double>& poses, const Array<double>& sizes) {
    const std::vector<std::int32_t> kind_list = to_vector(kinds, "shape_kinds", -1);
    const std::int64_t count = static_cast<std::int64_t>(kind_list.size());
    return {kind_list, to_transforms(poses, "shape_poses", count), to_vectors3(sizes, "shape_sizes", count)};
}

std::vector<std::array<std::int32_t, 2>> index_pairs(const Array<std::int32_t>& pairs) {
    require_shape(pairs, "pairs", {-1, 2});
    std::vector<std::array<std::int32_t, 2>> list;
    for (std::size_t i = 0; i < pairs.size(); i += 2) list.push_back({pairs.data()[i], pairs.data()[i + 1]});
    return list;
}

void init_robot(Robot* self, const Array<double>& origins, const Array<double>& axes, const Array<bool>& prismatic,
                const Array<double>& tool, const Array<double>& lower, const Array<double>& upper,
                const Array<std::int32_t>& shape_kinds, const Array<std::int32_t>& shape_frames,
                const Array<double>& shape_poses, const Array<double>& shape_sizes, const Array<std::int32_t>& pairs,
                const Array<std::int32_t>& scene_shapes) {
    RobotTable table;
    table.origins = to_transforms(origins, "origins", -1);
    const std::int64_t dof = static_cast<std::int64_t>(table.origins.size());
    table.axes = to_vectors3(axes, "axes", dof);
    table.prismatic = to_vector(prismatic, "prismatic", dof);
    require_shape(tool, "tool", {4, 4});
    table.tool = to_transform(tool.data());
    table.lower = to_vector(lower, "lower", dof);
    table.upper = to_vector(upper, "upper", dof);
    table.shapes = shape_table(shape_kinds, shape_poses, shape_sizes);
    table.shape_frames = to_vector(shape_frames, "shape_frames", static_cast<std::int64_t>(table.shapes.kinds.size()));
    table.pairs = index_pairs(pairs);
    table.scene_shapes = to_vector(scene_shapes, "scene_shapes", -1);
    new (self) Robot(make_robot(table));
}

void init_scene(Scene* self, const Array<std::int32_t>& shape_kinds, const Array<double>& shape_poses,
                const Array<double>& shape_sizes, std::optional<double> ground, double margin) {
    new (self) Scene(make_scene(shape_table(shape_kinds, shape_poses, shape_sizes), ground, margin));
}

NumpyDoubles fk(const Robot& robot, const Array<double>& q) {
    const std::size_t count = require_states(q, "q", robot.dof);
    NumpyDoubles poses = new_array<double>({count, 4, 4});
    nb::gil_scoped_release unlocked;
    tool_poses(robot, q.data(), count, poses.data());
    return poses;
}

NumpyDoubles all_joint_frames(const Robot& robot, const Array<double>& q) {
    const std::size_t count = require_states(q, "q", robot.dof);
    NumpyDoubles frames = new_array<double>({count, static_cast<std::size_t>(robot.dof), 4, 4});
    nb::gil_scoped_release unlocked;
    joint_frames(robot, q.data(), count, frames.data());
    return frames;
}

NumpyBools free_states(const Robot& robot, const Scene& scene, const Array<double>& q) {
    const std::size_t count = require_states(q, "q", robot.dof);
    NumpyBools free = new_array<bool>({count});
    nb::gil_scoped_release unlocked;
    are_free(robot, scene, q.data(), count, free.data());
    return free;
}

NumpyBools free_edges(const Robot& robot, const Scene& scene, const Array<double>& q0, const Array<double>& q1,
                      double resolution) {
    const std::size_t count = require_states(q0, "q0", robot.dof);
    require_shape(q1, "q1", {static_cast<std::int64_t>(count), robot.dof});
    require_states(q1, "q1", robot.dof);
    require_resolution(resolution);
    NumpyBools free = new_array<bool>({count});
    nb::gil_scoped_release unlocked;
    std::uint64_t state_checks = 0;
    for (std::size_t i = 0; i < count; ++i) {
        const std::size_t row = i * robot.dof;
        free.data()[i] = edge_is_free(robot, scene, q0.data() + row, q1.data() + row, resolution, state_checks);
    }
    return free;
}

NumpyDoubles state_clearances(const Robot& robot, const Scene& scene, const Array<double>& q) {
    const std::size_t count = require_states(q, "q", robot.dof);
    NumpyDoubles distances = new_array<double>({count});
    nb::gil_scoped_release unlocked;
    clearances(robot, scene, q.data(), count, distances.data());
    return distances;
}

NumpyDoubles least_clearances(const Robot& robot, const Scene& scene, const Array<double>& ways, double most) {
    require_shape(ways, "ways", {-1, -1, robot.dof});
    const std::size_t count = ways.shape(0), points = ways.shape(1);
    require_finite(ways, "ways", robot.dof);
    if (!(most >= 0)) throw std::invalid_argument("most must be at least 0 m");
    NumpyDoubles distances = new_array<double>({count});
    nb::gil_scoped_release unlocked;
    way_clearances(robot, scene, ways.data(), count, points, static_cast<float>(most), distances.data());
    return distances;
}

}  // namespace

}  // namespace plancurate

NB_MODULE(native, module) {
    using namespace plancurate;
    nb::set_leak_warnings(false);  // a process that ends by an exception keeps objects alive: no news to a user
    module.doc() = "Compiled core: kinematics, collision checking and planning. Arrays are float64 and C-contiguous.";

    nb::class_<Robot>(module, "Robot")
        .def("__init__", &init_robot, nb::kw_only(), "origins"_a, "axes"_a, "prismatic"_a, "tool"_a, "lower"_a, "upper"_a,
             "shape_kinds"_a, "shape_frames"_a, "shape_poses"_a, "shape_sizes"_a, "pairs"_a, "scene_shapes"_a)
        .def_ro("dof", &Robot::dof);
    nb::class_<Scene>(module, "Scene")
        .def("__init__", &init_scene, nb::kw_only(), "shape_kinds"_a, "shape_poses"_a, "shape_sizes"_a,
             "ground"_a.none(), "margin"_a);

    module.def("fk", &fk, "robot"_a, "q"_a);
    module.def("joint_frames", &all_joint_frames, "robot"_a, "q"_a);
    module.def("is_free", &free_states, "robot"_a, "scene"_a, "q"_a);
    module.def("edge_is_free", &free_edges, "robot"_a, "scene"_a, "q0"_a, "q1"_a, "resolution"_a);
    module.def("clearance", &state_clearances, "robot"_a, "scene"_a, "q"_a);
    module.def("way_clearance", &least_clearances, "robot"_a, "scene"_a, "ways"_a, "most"_a);
    bind_planning(module);
}
