-- The pool: what a selector may keep. Grain: one trajectory; all scalar columns, no waypoints.
-- $targets, $planners: lists, or NULL for all of them.
SELECT
    trajectory_id,
    target_id,
    planner,
    run,
    goal_index,
    target_x,
    target_y,
    target_z,
    tool_x,
    tool_y,
    tool_z,
    joint_movement,
    smoothness,
    path_length,
    duration,
    final_distance,
    n_waypoints,
    dt
FROM trajectories
WHERE
    robot = $robot
    AND scene = $scene
    AND pool = $pool
    AND ($planners IS NULL OR list_contains($planners, planner))
    AND ($targets IS NULL OR list_contains($targets, target_id))
    AND solved
    AND verified
ORDER BY target_id, planner, run;
