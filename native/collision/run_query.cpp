#include "collision/run_query.hpp"

#include <cmath>
#include <limits>

#include "collision/posed_shapes.hpp"

namespace plancurate {

namespace {

template <class Query>
void check_self(const Robot& robot, PosedShapes& posed, Query& query) {
    for (const auto& pair : robot.pairs) {
        const int i = pair[0], j = pair[1];
        const Shape &a = robot.shapes[i].shape, &b = robot.shapes[j].shape;
        const Point between = posed.centre(i) - posed.centre(j);
        const Mask lanes = query.broad_phase(dot(between, between), a.bounding + b.bounding + robot.rounding);
        if (!any(lanes)) continue;
        with_convex_set(a, posed.pose(i), [&](const auto& set_a) {
            with_convex_set(b, posed.pose(j), [&](const auto& set_b) {
                query.narrow_phase(set_a, set_b, a.radius + b.radius + robot.rounding, lanes);
            });
        });
        if (query.done()) return;
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

template <class Query>
void check_scene(const Robot& robot, const Scene& scene, PosedShapes& posed, Query& query) {
    for (const int i : robot.scene_shapes) {
        const Shape& a = robot.shapes[i].shape;
        for (const Obstacle& obstacle : scene.obstacles) {
            const float rounding = obstacle.rounding + robot.rounding;
            const Mask near = spheres_meet(a, posed.centre(i), obstacle, rounding, query);
            if (!any(near)) continue;
            check_obstacle(a, i, obstacle, rounding, near, posed, query);
            if (query.done()) return;
        }
    }
}

template <class Query>
void check_ground(const Robot& robot, float ground, PosedShapes& posed, Query& query) {
    const float rounding = robot.rounding + 2 * std::numeric_limits<float>::epsilon() * std::abs(ground);
    const Point up{splat<float>(0), splat<float>(0), splat<float>(1)};
    for (const int i : robot.scene_shapes) {
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

}  // namespace plancurate
