// The shapes of one robot in eight configurations.
#pragma once

#include <vector>

#include "collision/convex.hpp"
#include "collision/kinematics.hpp"

namespace plancurate {

// Computes centres at once and axes on demand: most shapes are never near enough to anything to need theirs.
class PosedShapes {
public:
    // q holds eight configurations, one entry a joint. `robot` must outlive what is read afterwards.
    void update(const Robot& robot, const Doubles* q) {
        robot_ = &robot;
        frames_.resize(robot.shape_joints + 1);
        frames_[0] = broadcast(Transform<float>{{1, 0, 0}, {0, 1, 0}, {0, 0, 1}, {0, 0, 0}});
        forward_kinematics(robot.collision_joints, robot.shape_joints, q, frames_.data() + 1);
        poses_.resize(robot.shapes.size());
        has_axes_.assign(robot.shapes.size(), false);
        for (std::size_t i = 0; i < poses_.size(); ++i)
            if (robot.shapes[i].frame <= robot.shape_joints) poses_[i].t = apply(frame(i), robot.shapes[i].shape.pose.t);
    }

    const Point& centre(int i) const { return poses_[i].t; }

    Point ball_centre(int frame) const { return apply(frames_[frame], robot_->balls[frame].centre); }

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

}  // namespace plancurate
