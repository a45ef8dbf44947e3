// Forward kinematics of eight configurations at once.
#pragma once

#include <cstddef>
#include <vector>

#include "collision/robot.hpp"
#include "vector/lanes.hpp"

namespace plancurate {

// The same transform in every lane.
template <class Real>
Transform<Lanes<Real>> broadcast(const Transform<Real>& f) {
    const auto all = [](const Vec3<Real>& v) { return Vec3<Lanes<Real>>{splat(v.x), splat(v.y), splat(v.z)}; };
    return {all(f.x), all(f.y), all(f.z), all(f.t)};
}

// Writes the moving frames of the first `count` joints. q holds eight configurations, one entry a joint.
template <class Real>
void forward_kinematics(const std::vector<Joint<Real>>& joints, int count, const Doubles* q,
                        Transform<Lanes<Real>>* frames) {
    using L = Lanes<Real>;
    for (int i = 0; i < count; ++i) {
        const Joint<Real>& joint = joints[i];
        Transform<L> frame = i == 0 ? broadcast(joint.origin) : frames[i - 1] * joint.origin;
        if (joint.prismatic) {
            frame.t = frame.t + frame.z * convert<L>(q[i]);
        } else {
            Doubles sine, cosine;
            sincos(q[i], sine, cosine);
            const L s = convert<L>(sine), c = convert<L>(cosine);
            const Vec3<L> x = frame.x;
            frame.x = x * c + frame.y * s;
            frame.y = frame.y * c - x * s;
        }
        frames[i] = frame;
    }
}

// Loads up to eight rows of q, each dof numbers that begin `stride` after those of the row before; lanes beyond `count`
// repeat the last row.
void load_rows(const double* q, int count, std::size_t stride, int dof, Doubles* lanes);

// Tool poses as row-major 4 x 4 matrices. q: count rows of dof, poses: count matrices.
void tool_poses(const Robot& robot, const double* q, std::size_t count, double* poses);

// The user's moving frame of every joint. q: count rows of dof, frames: count * dof matrices.
void joint_frames(const Robot& robot, const double* q, std::size_t count, double* frames);

}  // namespace plancurate
