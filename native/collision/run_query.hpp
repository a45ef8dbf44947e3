// Puts a question to eight configurations of a robot in a scene.
#pragma once

#include "collision/queries.hpp"
#include "collision/robot.hpp"
#include "collision/scene.hpp"

namespace plancurate {

// q holds one entry a joint. Compiled once for each question, so that all callers run the very same instructions.
void ask_all(const Robot& robot, const Scene& scene, const Doubles* q, FreeQuestion& question);
void ask_all(const Robot& robot, const Scene& scene, const Doubles* q, ClearanceQuestion& question);

}  // namespace plancurate
