-- The pool: what a selector may keep. Grain: one distinct trajectory to a target; all scalar columns.
-- Planners find many a trajectory more than once; the first by id stands for its copies, multiplicity counts
-- them. Copies are known by what is measured of them, to the last bit: another motion to a target measures
-- otherwise, and hashing waypoints would take many times as long as all the rest.
-- $targets, $planners: lists, or NULL for all of them. $labelling: whose ways to show, or NULL for none.
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
    dt,
    labelled.way,
    count(*) OVER copies AS multiplicity
FROM trajectories
LEFT JOIN (
    SELECT trajectory_id, way
    FROM ways
    WHERE robot = $robot AND scene = $scene AND pool = $pool AND labelling = $labelling
) AS labelled USING (trajectory_id)
WHERE
    robot = $robot
    AND scene = $scene
    AND pool = $pool
    AND ($planners IS NULL OR list_contains($planners, planner))
    AND ($targets IS NULL OR list_contains($targets, target_id))
    AND solved
    AND verified
WINDOW copies AS (
    PARTITION BY
        target_id, goal_index, joint_movement, smoothness, path_length, duration, final_distance,
        tool_x, tool_y, tool_z, n_waypoints, dt
)
QUALIFY row_number() OVER (copies ORDER BY trajectory_id) = 1
ORDER BY target_id, planner, run;
