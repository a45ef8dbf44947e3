#include "collision/run_query.hpp"

#include <cmath>
#include <limits>

#include "collision/posed_shapes.hpp"

namespace plancurate {

namespace {

template <class Question>
void ask_self(const Robot& robot, Placement& placed, Question& question) {
    for (const auto& pair : robot.pairs) {
        const int i = pair[0], j = pair[1];
        const Shape &a = robot.shapes[i].shape, &b = robot.shapes[j].shape;
        const Point between = placed.centre(i) - placed.centre(j);
        const Mask lanes = question.doubtful(dot(between, between), a.bounding + b.bounding + robot.rounding);
        if (!any(lanes)) continue;
        with_core(a, placed.pose(i), [&](const auto& core_a) {
            with_core(b, placed.pose(j), [&](const auto& core_b) {
                question.ask(core_a, core_b, a.radius + b.radius + robot.rounding, lanes);
            });
        });
        if (question.settled()) return;
    }
}

// Lanes in which the spheres around a shape and an obstacle come near enough to look closer.
template <class Question>
Mask spheres_meet(const Shape& a, const Point& centre, const Obstacle& obstacle, float rounding, Question& question) {
    const Point between = centre - obstacle.shape.pose.t;
    return question.doubtful(dot(between, between), a.bounding + obstacle.shape.bounding + rounding);
}

// Looks closer in two steps: the sphere around the shape against the obstacle itself, then both themselves.
template <class Question>
void ask_obstacle(const Shape& a, int i, const Obstacle& obstacle, float rounding, Mask near, Placement& placed,
                  Question& question) {
    with_core(obstacle.shape, obstacle.shape.pose, [&](const auto& core_b) {
        const Point between = placed.centre(i) - core_b.nearest(placed.centre(i));
        const float around = obstacle.shape.radius + rounding;
        const Mask lanes = near & question.doubtful(dot(between, between), a.bounding + around);
        if (!any(lanes)) return;
        with_core(a, placed.pose(i), [&](const auto& core_a) { question.ask(core_a, core_b, a.radius + around, lanes); });
    });
}

template <class Question>
void ask_scene(const Robot& robot, const Scene& scene, Placement& placed, Question& question) {
    for (const int i : robot.scene_shapes) {
        const Shape& a = robot.shapes[i].shape;
        for (const Obstacle& obstacle : scene.obstacles) {
            const float rounding = obstacle.rounding + robot.rounding;
            const Mask near = spheres_meet(a, placed.centre(i), obstacle, rounding, question);
            if (!any(near)) continue;
            ask_obstacle(a, i, obstacle, rounding, near, placed, question);
            if (question.settled()) return;
        }
    }
}

template <class Question>
void ask_ground(const Robot& robot, float ground, Placement& placed, Question& question) {
    const float rounding = robot.rounding + 2 * std::numeric_limits<float>::epsilon() * std::abs(ground);
    const Point up{splat<float>(0), splat<float>(0), splat<float>(1)};
    for (const int i : robot.scene_shapes) {
        const Shape& a = robot.shapes[i].shape;
        const Floats height = max(placed.centre(i).z - ground, splat<float>(0));
        const Mask lanes = question.doubtful(height * height, a.bounding + rounding);
        if (!any(lanes)) continue;
        with_core(a, placed.pose(i), [&](const auto& core) {
            question.ask_height(core.centre.z - core.reach(up) - (ground + a.radius + rounding), lanes);
        });
        if (question.settled()) return;
    }
}

template <class Question>
void ask_everything(const Robot& robot, const Scene& scene, const Doubles* q, Question& question) {
    thread_local Placement placed;  // only scratch memory, kept because allocating it would cost more than using it
    placed.place(robot, q);
    ask_self(robot, placed, question);
    if (question.settled()) return;
    if (scene.ground) ask_ground(robot, *scene.ground, placed, question);
    if (question.settled()) return;
    ask_scene(robot, scene, placed, question);
}

}  // namespace

void ask_all(const Robot& robot, const Scene& scene, const Doubles* q, FreeQuestion& question) {
    ask_everything(robot, scene, q, question);
}

void ask_all(const Robot& robot, const Scene& scene, const Doubles* q, ClearanceQuestion& question) {
    ask_everything(robot, scene, q, question);
}

}  // namespace plancurate
