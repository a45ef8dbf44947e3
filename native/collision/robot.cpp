#include "collision/robot.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>
#include <string>

namespace plancurate {

namespace {

constexpr Transform<double> kIdentity{{1, 0, 0}, {0, 1, 0}, {0, 0, 1}, {0, 0, 0}};

void require(bool holds, const std::string& otherwise) {
    if (!holds) throw std::invalid_argument(otherwise);
}

void require_index(std::int32_t index, std::size_t count, const std::string& name) {
    require(index >= 0 && index < static_cast<std::int64_t>(count),
            name + " is " + std::to_string(index) + ", must be from 0 to " + std::to_string(count) + " - 1");
}

// A rotation that takes z to the given unit vector; the identity where that is z already.
Transform<double> rotation_from_z(const Vec3<double>& axis) {
    if (axis.z == 1.0) return kIdentity;
    const Vec3<double> aside = std::abs(axis.x) < 0.5 ? Vec3<double>{1, 0, 0} : Vec3<double>{0, 1, 0};
    const Vec3<double> across = aside - axis * dot(aside, axis);
    const Vec3<double> x = across * (1 / std::sqrt(dot(across, across)));
    const Vec3<double> y{axis.y * x.z - axis.z * x.y, axis.z * x.x - axis.x * x.z, axis.x * x.y - axis.y * x.x};
    return {x, y, axis, {0, 0, 0}};
}

void require_sound(const RobotTable& table) {
    require(!table.origins.empty(), "a robot needs at least one joint");
    require_rigid(table.tool, "tool");
    for (std::size_t i = 0; i < table.origins.size(); ++i) {
        const std::string joint = "joint " + std::to_string(i);
        const Vec3<double>& axis = table.axes[i];
        require_rigid(table.origins[i], joint + ": its origin");
        require(std::abs(dot(axis, axis) - 1) < 1e-6, joint + ": its axis must be a unit vector");
        require(std::isfinite(table.lower[i]) && std::isfinite(table.upper[i]) && table.lower[i] < table.upper[i],
                joint + ": its limits must be finite, lower below upper");
    }
    const std::size_t shapes = table.shapes.kinds.size();
    for (std::size_t i = 0; i < table.pairs.size(); ++i) {
        const std::string pair = "pair " + std::to_string(i);
        for (const std::int32_t shape : table.pairs[i]) require_index(shape, shapes, pair + ": its shape");
        require(table.pairs[i][0] != table.pairs[i][1], pair + ": a shape cannot be checked against itself");
    }
    for (const std::int32_t shape : table.scene_shapes) require_index(shape, shapes, "scene_shapes: a shape");
}

void add_joints(const RobotTable& table, Robot& robot) {
    Transform<double> inward = kIdentity;  // the user's frame before joint i -> the internal one
    for (std::size_t i = 0; i < table.origins.size(); ++i) {
        const Vec3<double>& axis = table.axes[i];
        const Transform<double> from_z = rotation_from_z(axis * (1 / std::sqrt(dot(axis, axis))));
        const Transform<double> origin = inward * table.origins[i] * from_z;
        robot.joints.push_back({origin, table.prismatic[i]});
        robot.collision_joints.push_back({cast<float>(origin), table.prismatic[i]});
        inward = transposed(from_z);
        robot.outward.push_back(inward);
    }
    robot.tool = inward * table.tool;
}

void add_shapes(const RobotTable& table, Robot& robot) {
    for (std::size_t i = 0; i < table.shapes.kinds.size(); ++i) {
        const std::int32_t frame = table.shape_frames[i];
        require_index(frame, robot.joints.size() + 1, "shape " + std::to_string(i) + ": its frame");
        const Transform<double>& outward = frame == 0 ? kIdentity : robot.outward[frame - 1];
        robot.shapes.push_back({make_shape(table.shapes, i, outward), frame});
    }
    const auto note = [&robot](std::int32_t shape) {
        robot.shape_joints = std::max(robot.shape_joints, robot.shapes[shape].frame);
    };
    for (const auto& pair : table.pairs) std::for_each(pair.begin(), pair.end(), note);
    std::for_each(table.scene_shapes.begin(), table.scene_shapes.end(), note);
}

// The order of checks stays the table's, so that grouping changes no result.
void add_checks(const RobotTable& table, Robot& robot) {
    for (const auto& [shape, other] : table.pairs) {
        const int frame = robot.shapes[other].frame;
        auto& checks = robot.self_checks;
        if (checks.empty() || checks.back().shape != shape || checks.back().others.frame != frame)
            checks.push_back({shape, {frame, {}}});
        checks.back().others.shapes.push_back(other);
    }
    for (const std::int32_t shape : table.scene_shapes) {
        const int frame = robot.shapes[shape].frame;
        auto& groups = robot.scene_groups;
        if (groups.empty() || groups.back().frame != frame) groups.push_back({frame, {}});
        groups.back().shapes.push_back(shape);
    }
}

// The middle of the shapes' own bounding spheres, and the distance that the farthest of them reaches from there.
Ball ball_of(const Robot& robot, int frame) {
    constexpr float kFar = std::numeric_limits<float>::max();
    Vec3<float> lower{kFar, kFar, kFar}, upper{-kFar, -kFar, -kFar};
    for (const AttachedShape& attached : robot.shapes) {
        if (attached.frame != frame) continue;
        const Vec3<float>& t = attached.shape.pose.t;
        const float r = attached.shape.bounding;
        lower = {std::min(lower.x, t.x - r), std::min(lower.y, t.y - r), std::min(lower.z, t.z - r)};
        upper = {std::max(upper.x, t.x + r), std::max(upper.y, t.y + r), std::max(upper.z, t.z + r)};
    }
    Ball ball{(lower + upper) * 0.5f, 0};
    for (const AttachedShape& attached : robot.shapes) {
        if (attached.frame != frame) continue;
        const Vec3<float> away = attached.shape.pose.t - ball.centre;
        ball.radius = std::max(ball.radius, std::sqrt(dot(away, away)) + attached.shape.bounding);
    }
    return ball;
}

// Each joint multiplies by a rotation known to a few units in the last place and adds a translation; the
// distance of two shapes then takes a few operations more.
float rounding_bound(const Robot& robot) {
    double reach = 0, farthest = 0;
    for (int i = 0; i < robot.dof; ++i) {
        const Vec3<double>& t = robot.joints[i].origin.t;
        reach += std::sqrt(dot(t, t));
        if (robot.joints[i].prismatic) reach += std::max(std::abs(robot.lower[i]), std::abs(robot.upper[i]));
    }
    for (const AttachedShape& attached : robot.shapes) {
        const Vec3<float>& t = attached.shape.pose.t;
        farthest = std::max<double>(farthest, std::sqrt(dot(t, t)) + attached.shape.bounding);
    }
    constexpr double kUnit = std::numeric_limits<float>::epsilon() / 2;
    return static_cast<float>((8 * robot.dof + 16) * kUnit * (reach + farthest));
}

}  // namespace

Robot make_robot(const RobotTable& table) {
    require_sound(table);
    Robot robot;
    robot.dof = static_cast<int>(table.origins.size());
    robot.lower = table.lower;
    robot.upper = table.upper;
    add_joints(table, robot);
    add_shapes(table, robot);
    add_checks(table, robot);
    for (int frame = 0; frame <= robot.dof; ++frame) robot.balls.push_back(ball_of(robot, frame));
    robot.rounding = rounding_bound(robot);
    return robot;
}

}  // namespace plancurate
