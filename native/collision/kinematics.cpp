#include "collision/kinematics.hpp"

#include <algorithm>

namespace plancurate {

namespace {

using Frames = std::vector<Transform<Doubles>>;

void store(const Transform<Doubles>& f, int lane, double* matrix) {
    const double rows[16] = {f.x.x[lane], f.y.x[lane], f.z.x[lane], f.t.x[lane],
                             f.x.y[lane], f.y.y[lane], f.z.y[lane], f.t.y[lane],
                             f.x.z[lane], f.y.z[lane], f.z.z[lane], f.t.z[lane],
                             0, 0, 0, 1};
    std::copy(rows, rows + 16, matrix);
}

// Calls use(frames, first row, number of rows) for each eight rows of q.
template <class Use>
void for_each_block(const Robot& robot, const double* q, std::size_t count, const Use& use) {
    std::vector<Doubles> lanes(robot.dof);
    Frames frames(robot.dof);
    for (std::size_t row = 0; row < count; row += kLanes) {
        const int rows = static_cast<int>(std::min<std::size_t>(kLanes, count - row));
        load_rows(q + row * robot.dof, rows, robot.dof, robot.dof, lanes.data());
        forward_kinematics(robot.joints, robot.dof, lanes.data(), frames.data());
        use(frames, row, rows);
    }
}

}  // namespace

void load_rows(const double* q, int count, std::size_t stride, int dof, Doubles* lanes) {
    for (int lane = 0; lane < kLanes; ++lane) {
        const double* row = q + std::min(lane, count - 1) * stride;
        for (int i = 0; i < dof; ++i) lanes[i][lane] = row[i];
    }
}

void tool_poses(const Robot& robot, const double* q, std::size_t count, double* poses) {
    for_each_block(robot, q, count, [&](const Frames& frames, std::size_t first, int rows) {
        const Transform<Doubles> tool = frames.back() * robot.tool;
        for (int lane = 0; lane < rows; ++lane) store(tool, lane, poses + (first + lane) * 16);
    });
}

void joint_frames(const Robot& robot, const double* q, std::size_t count, double* matrices) {
    for_each_block(robot, q, count, [&](const Frames& frames, std::size_t first, int rows) {
        for (int i = 0; i < robot.dof; ++i) {
            const Transform<Doubles> frame = frames[i] * robot.outward[i];
            for (int lane = 0; lane < rows; ++lane) store(frame, lane, matrices + ((first + lane) * robot.dof + i) * 16);
        }
    });
}

}  // namespace plancurate
