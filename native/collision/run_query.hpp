// Runs a query on eight configurations of a robot in a scene: broad phase, then narrow phase, pair by pair.
#pragma once

#include "collision/queries.hpp"
#include "collision/robot.hpp"
#include "collision/scene.hpp"

namespace plancurate {

// q holds one entry a joint. Compiled once for each query, so that all callers run the very same instructions.
void run_query(const Robot& robot, const Scene& scene, const Doubles* q, FreeQuery& query);
void run_query(const Robot& robot, const Scene& scene, const Doubles* q, ClearanceQuery& query);
void run_query(const Robot& robot, const Scene& scene, const Doubles* q, WayQuery& query);

}  // namespace plancurate
