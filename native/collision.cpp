#include "collision.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "kinematics.hpp"
#include "separation.hpp"

namespace plancurate {

namespace {

constexpr float kInfinity = std::numeric_limits<float>::infinity();

// Asks whether each open lane keeps a distance at every pair it is shown. A lane closes when it fails once.
struct FreeQuestion {
    struct Judge {
        float limit2;
        Mask open, free;

        void look(Floats distance2, Floats slab) {
            free |= open & (slab > 0.0f) & (slab * slab > limit2 * distance2);
            open &= ~free & (distance2 > limit2);
        }
    };

    float margin;
    Mask open;
    bool first_ends;  // one closed lane settles the question
    Mask asked = open;

    bool settled() const { return first_ends ? any(asked & ~open) : !any(open); }

    // Lanes in which two shapes may be nearer than allowed: centres at a squared distance, bodies within `reach`.
    Mask doubtful(Floats distance2, float reach) const {
        const float limit = reach + margin;
        return open & ~(distance2 > limit * limit);
    }

    template <class A, class B>
    void ask(const A& a, const B& b, float radii, Mask lanes) {
        const float limit = radii + margin;
        Judge judge{limit * limit, lanes, Mask{}};
        separate(a, b, judge);
        open &= ~lanes | judge.free;
    }

    void ask_height(Floats height, Mask lanes) { open &= ~lanes | (height > margin); }
};

// Asks for the smallest distance of each lane.
struct ClearanceQuestion {
    struct Judge {
        Floats bound;
        Mask open;

        void look(Floats distance2, Floats slab) {
            constexpr float kCloseEnough = 1e-5f;
            const Floats distance = sqrt(distance2);
            const Floats width = select(distance2 > 0.0f, slab / distance, splat<Floats>(0));
            bound = select(open, max(bound, width), bound);
            open &= distance - bound > kCloseEnough;
        }
    };

    Floats smallest = splat<Floats>(kInfinity);

    bool settled() const { return false; }

    Mask doubtful(Floats distance2, float reach) const { return ~(sqrt(distance2) - reach >= smallest); }

    template <class A, class B>
    void ask(const A& a, const B& b, float radii, Mask lanes) {
        Judge judge{splat<Floats>(-kInfinity), lanes};
        separate(a, b, judge);
        smallest = select(lanes, min(smallest, judge.bound - radii), smallest);
    }

    void ask_height(Floats height, Mask lanes) { smallest = select(lanes, min(smallest, height), smallest); }
};

// Shapes of one robot in eight configurations. Only centres are placed at once: most shapes are never near enough
// to anything for their axes to matter.
class Placement {
public:
    void place(const Robot& robot, const Doubles* q) {
        robot_ = &robot;
        frames_.resize(robot.shape_joints + 1);
        frames_[0] = spread(Transform<float>{{1, 0, 0}, {0, 1, 0}, {0, 0, 1}, {0, 0, 0}});
        place_frames(robot.collision_joints, robot.shape_joints, q, frames_.data() + 1);
        poses_.resize(robot.shapes.size());
        has_axes_.assign(robot.shapes.size(), false);
        for (std::size_t i = 0; i < poses_.size(); ++i)
            if (robot.shapes[i].frame <= robot.shape_joints) poses_[i].t = apply(frame(i), robot.shapes[i].shape.pose.t);
    }

    const Point& centre(int i) const { return poses_[i].t; }

    const Transform<Floats>& pose(int i) {
        if (!has_axes_[i]) {
            const Transform<float>& local = robot_->shapes[i].shape.pose;
            poses_[i].x = rotate(frame(i), local.x);
            poses_[i].y = rotate(frame(i), local.y);
            poses_[i].z = rotate(frame(i), local.z);
            has_axes_[i] = true;
        }
        return poses_[i];
    }

private:
    const Transform<Floats>& frame(int i) const { return frames_[robot_->shapes[i].frame]; }

    const Robot* robot_ = nullptr;
    std::vector<Transform<Floats>> frames_, poses_;
    std::vector<char> has_axes_;
};

template <class Question>
void ask_self(const Robot& robot, Placement& placed, Question& question) {
    for (const auto& [i, j] : robot.pairs) {
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

template <class Question>
void ask_obstacle(const Robot& robot, int i, const Obstacle& obstacle, Placement& placed, Question& question) {
    const Shape& a = robot.shapes[i].shape;
    const float around = obstacle.shape.radius + obstacle.rounding + robot.rounding;
    with_core(obstacle.shape, obstacle.shape.pose, [&](const auto& core_b) {
        const Point& centre = placed.centre(i);
        const Point between = centre - core_b.nearest(centre);
        const Mask lanes = question.doubtful(dot(between, between), a.bounding + around);
        if (!any(lanes)) return;
        with_core(a, placed.pose(i), [&](const auto& core_a) { question.ask(core_a, core_b, a.radius + around, lanes); });
    });
}

template <class Question>
void ask_scene(const Robot& robot, const Scene& scene, Placement& placed, Question& question) {
    for (const int i : robot.scene_shapes) {
        for (const Obstacle& obstacle : scene.obstacles) {
            const Point between = placed.centre(i) - obstacle.shape.pose.t;
            const float reach = robot.shapes[i].shape.bounding + obstacle.shape.bounding;
            if (!any(question.doubtful(dot(between, between), reach + obstacle.rounding + robot.rounding))) continue;
            ask_obstacle(robot, i, obstacle, placed, question);
            if (question.settled()) return;
        }
    }
}

template <class Question>
void ask_ground(const Robot& robot, float ground, Placement& placed, Question& question) {
    const float rounding = robot.rounding + 2 * std::numeric_limits<float>::epsilon() * std::abs(ground);
    const Point up{splat<Floats>(0), splat<Floats>(0), splat<Floats>(1)};
    for (const int i : robot.scene_shapes) {
        const Shape& a = robot.shapes[i].shape;
        const Floats height = max(placed.centre(i).z - ground, splat<Floats>(0));
        const Mask lanes = question.doubtful(height * height, a.bounding + rounding);
        if (!any(lanes)) continue;
        with_core(a, placed.pose(i), [&](const auto& core) {
            question.ask_height(core.centre.z - core.reach(up) - (ground + a.radius + rounding), lanes);
        });
        if (question.settled()) return;
    }
}

// Puts the question to eight configurations. Never inlined, so that every caller runs the very same instructions.
template <class Question>
__attribute__((noinline)) void ask_all(const Robot& robot, const Scene& scene, const Doubles* q, Question& question) {
    thread_local Placement placed;  // only scratch memory, kept because allocating it would cost more than using it
    placed.place(robot, q);
    ask_self(robot, placed, question);
    if (question.settled()) return;
    if (scene.ground) ask_ground(robot, *scene.ground, placed, question);
    if (question.settled()) return;
    ask_scene(robot, scene, placed, question);
}

// The number of steps an edge is cut into; negative where the edge is not finite.
double edge_steps(const double* q0, const double* q1, int dof, double resolution) {
    double longest = 0;
    for (int i = 0; i < dof; ++i) {
        const double length = std::abs(q1[i] - q0[i]);
        if (!std::isfinite(length)) return -1;
        longest = std::max(longest, length);
    }
    return std::ceil(longest / resolution);
}

// The block to look at after `block` when blocks are visited by halving gaps (bit-reversed order below `blocks`).
class CoarseToFine {
public:
    explicit CoarseToFine(std::uint64_t blocks) : blocks_(blocks) {
        while ((std::uint64_t{1} << bits_) < blocks) ++bits_;
    }

    std::uint64_t next() {
        std::uint64_t reversed;
        do {
            reversed = 0;
            for (int bit = 0; bit < bits_; ++bit) reversed |= ((turn_ >> bit) & 1) << (bits_ - 1 - bit);
            ++turn_;
        } while (reversed >= blocks_);
        return reversed;
    }

private:
    std::uint64_t blocks_, turn_ = 0;
    int bits_ = 0;
};

}  // namespace

bool is_free(const Robot& robot, const Scene& scene, const double* q) {
    bool free;
    are_free(robot, scene, q, 1, &free);
    return free;
}

void are_free(const Robot& robot, const Scene& scene, const double* q, std::size_t count, bool* free) {
    std::vector<Doubles> lanes(robot.dof);
    for (std::size_t row = 0; row < count; row += kLanes) {
        const int rows = static_cast<int>(std::min<std::size_t>(kLanes, count - row));
        load_rows(q + row * robot.dof, rows, robot.dof, lanes.data());
        FreeQuestion question{scene.margin, first(rows), false};
        ask_all(robot, scene, lanes.data(), question);
        for (int lane = 0; lane < rows; ++lane) free[row + lane] = question.open[lane] != 0;
    }
}

bool edge_is_free(const Robot& robot, const Scene& scene, const double* q0, const double* q1, double resolution,
                  std::uint64_t& state_checks) {
    const double steps = edge_steps(q0, q1, robot.dof, resolution);
    if (steps < 0) return false;
    // Lane l of block b looks at state l * blocks + b: the first block alone spans the edge.
    const std::uint64_t states = static_cast<std::uint64_t>(steps) + 1;
    const std::uint64_t blocks = (states + kLanes - 1) / kLanes;
    CoarseToFine order(blocks);
    std::vector<Doubles> lanes(robot.dof);
    for (std::uint64_t visited = 0; visited < blocks; ++visited) {
        const std::uint64_t block = order.next();
        const int count = static_cast<int>((states - block + blocks - 1) / blocks);
        Doubles t;
        for (int lane = 0; lane < kLanes; ++lane) {
            const std::uint64_t state = std::min(lane, count - 1) * blocks + block;
            t[lane] = states == 1 ? 0.0 : static_cast<double>(state) / steps;
        }
        for (int i = 0; i < robot.dof; ++i) lanes[i] = (1.0 - t) * q0[i] + t * q1[i];
        FreeQuestion question{scene.margin, first(count), true};
        ask_all(robot, scene, lanes.data(), question);
        state_checks += count;
        if (question.settled()) return false;
    }
    return true;
}

void clearances(const Robot& robot, const Scene& scene, const double* q, std::size_t count, double* distances) {
    std::vector<Doubles> lanes(robot.dof);
    for (std::size_t row = 0; row < count; row += kLanes) {
        const int rows = static_cast<int>(std::min<std::size_t>(kLanes, count - row));
        load_rows(q + row * robot.dof, rows, robot.dof, lanes.data());
        ClearanceQuestion question;
        ask_all(robot, scene, lanes.data(), question);
        for (int lane = 0; lane < rows; ++lane) distances[row + lane] = question.smallest[lane];
    }
}

}  // namespace plancurate
