#include "collision/run_query.hpp"

#include <cmath>
#include <limits>

#include "collision/posed_shapes.hpp"

namespace plancurate {

namespace {

// A frame's ball is asked with more room for rounding than the shapes in it: what it leaves out, they would as well.
constexpr float kRoom = 4;

// Asking the ball first pays for groups of more shapes than this.
constexpr std::size_t kFew = 3;

// Whether it had to look closer than at bounding spheres.
template <class Query>
bool check_pair(const Robot& robot, int i, int j, PosedShapes& posed, Query& query) {
    const Shape &a = robot.shapes[i].shape, &b = robot.shapes[j].shape;
    const Point between = posed.centre(i) - posed.centre(j);
    const Mask lanes = query.broad_phase(dot(between, between), a.bounding + b.bounding + robot.rounding);
    if (!any(lanes)) return false;
    with_convex_set(a, posed.pose(i), [&](const auto& set_a) {
        with_convex_set(b, posed.pose(j), [&](const auto& set_b) {
            query.narrow_phase(set_a, set_b, a.radius + b.radius + robot.rounding, lanes);
        });
    });
    return true;
}

// Whether a shape comes near the ball of a group, in any lane.
template <class Query>
bool ball_meets_shape(const Robot& robot, int frame, int i, PosedShapes& posed, Query& query) {
    const Point between = posed.centre(i) - posed.ball_centre(frame);
    const float reach = robot.shapes[i].shape.bounding + robot.balls[frame].radius + kRoom * robot.rounding;
    return any(query.broad_phase(dot(between, between), reach));
}

template <class Query>
void check_self(const Robot& robot, PosedShapes& posed, Query& query) {
    for (const auto& [i, others] : robot.self_checks) {
        if (others.shapes.size() > kFew && !ball_meets_shape(robot, others.frame, i, posed, query)) continue;
        for (const int j : others.shapes) {
            if (check_pair(robot, i, j, posed, query) && query.done()) return;
        }
    }
}

// Lanes in which the bounding spheres of a shape and an obstacle come near enough to look closer.
template <class Query>
Mask spheres_meet(const Shape& a, const Point& centre, const Obstacle& obstacle, float rounding, Query& query) {
    const Point between = centre - obstacle.shape.pose.t;
    return query.broad_phase(dot(between, between), a.bounding + obstacle.shape.bounding + rounding);
}

// Looks closer in two steps: the shape's bounding sphere against the obstacle itself, then both themselves.
template <class Query>
void check_obstacle(const Shape& a, int i, const Obstacle& obstacle, float rounding, Mask near, PosedShapes& posed,
                    Query& query) {
    with_convex_set(obstacle.shape, obstacle.shape.pose, [&](const auto& set_b) {
        const Point between = posed.centre(i) - set_b.project(posed.centre(i));
        const float around = obstacle.shape.radius + rounding;
        const Mask lanes = near & query.broad_phase(dot(between, between), a.bounding + around);
        if (!any(lanes)) return;
        with_convex_set(a, posed.pose(i), [&](const auto& set_a) {
            query.narrow_phase(set_a, set_b, a.radius + around, lanes);
        });
    });
}

// Whether a frame's ball comes near an obstacle, in any lane.
template <class Query>
bool ball_meets_obstacle(const Ball& ball, const Point& centre, const Obstacle& obstacle, float rounding,
                         Query& query) {
    bool meets = true;
    with_convex_set(obstacle.shape, obstacle.shape.pose, [&](const auto& set) {
        const Point between = centre - set.project(centre);
        const float reach = ball.radius + obstacle.shape.radius + kRoom * rounding;
        meets = any(query.broad_phase(dot(between, between), reach));
    });
    return meets;
}

// Whether it had to look closer than at bounding spheres.
template <class Query>
bool check_shape(const Robot& robot, int i, const Obstacle& obstacle, PosedShapes& posed, Query& query) {
    const Shape& a = robot.shapes[i].shape;
    const float rounding = obstacle.rounding + robot.rounding;
    const Mask near = spheres_meet(a, posed.centre(i), obstacle, rounding, query);
    if (!any(near)) return false;
    check_obstacle(a, i, obstacle, rounding, near, posed, query);
    return true;
}

// Obstacles that a frame's ball comes near, in any lane.
template <class Query>
const std::vector<Obstacle>& obstacles_met(const Robot& robot, const Scene& scene, int frame, PosedShapes& posed,
                                           Query& query) {
    thread_local std::vector<Obstacle> met;  // scratch memory
    met.clear();
    const Point centre = posed.ball_centre(frame);
    for (const Obstacle& obstacle : scene.obstacles)
        if (ball_meets_obstacle(robot.balls[frame], centre, obstacle, obstacle.rounding + robot.rounding, query))
            met.push_back(obstacle);
    return met;
}

template <class Query>
void check_scene(const Robot& robot, const Scene& scene, PosedShapes& posed, Query& query) {
    for (const ShapeGroup& group : robot.scene_groups) {
        const bool few = group.shapes.size() <= kFew;
        const auto& obstacles = few ? scene.obstacles : obstacles_met(robot, scene, group.frame, posed, query);
        for (const int i : group.shapes) {
            for (const Obstacle& obstacle : obstacles) {
                if (check_shape(robot, i, obstacle, posed, query) && query.done()) return;
            }
        }
    }
}

template <class Query>
void check_ground(const Robot& robot, float ground, PosedShapes& posed, Query& query) {
    const float rounding = robot.rounding + 2 * std::numeric_limits<float>::epsilon() * std::abs(ground);
    const Point up{splat<float>(0), splat<float>(0), splat<float>(1)};
    for (const ShapeGroup& group : robot.scene_groups) {
        if (group.shapes.size() > kFew) {
            const Floats low = max(posed.ball_centre(group.frame).z - ground, splat<float>(0));
            if (!any(query.broad_phase(low * low, robot.balls[group.frame].radius + kRoom * rounding))) continue;
        }
        for (const int i : group.shapes) {
            const Shape& a = robot.shapes[i].shape;
            const Floats height = max(posed.centre(i).z - ground, splat<float>(0));
            const Mask lanes = query.broad_phase(height * height, a.bounding + rounding);
            if (!any(lanes)) continue;
            with_convex_set(a, posed.pose(i), [&](const auto& set) {
                query.ground_test(set.centre.z - set.support(up) - (ground + a.radius + rounding), lanes);
            });
            if (query.done()) return;
        }
    }
}

template <class Query>
void check_all_pairs(const Robot& robot, const Scene& scene, const Doubles* q, Query& query) {
    thread_local PosedShapes posed;  // only scratch memory, kept because allocating it would cost more than using it
    posed.update(robot, q);
    check_self(robot, posed, query);
    if (query.done()) return;
    if (scene.ground) check_ground(robot, *scene.ground, posed, query);
    if (query.done()) return;
    check_scene(robot, scene, posed, query);
}

}  // namespace

void run_query(const Robot& robot, const Scene& scene, const Doubles* q, FreeQuery& query) {
    check_all_pairs(robot, scene, q, query);
}

void run_query(const Robot& robot, const Scene& scene, const Doubles* q, ClearanceQuery& query) {
    check_all_pairs(robot, scene, q, query);
}

void run_query(const Robot& robot, const Scene& scene, const Doubles* q, WayQuery& query) {
    check_all_pairs(robot, scene, q, query);
}

}  // namespace plancurate
