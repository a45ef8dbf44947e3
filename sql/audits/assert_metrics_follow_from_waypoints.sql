-- A stored metric equals its SQL definition. Waypoints are stored as 32-bit numbers, hence 1e-5.
WITH defined AS (
    SELECT
        trajectory_id,
        joint_movement,
        duration,
        n_waypoints,
        final_distance,
        joint_movement(q) AS defined_joint_movement,
        duration(q, dt) AS defined_duration,
        len(q) AS defined_n_waypoints,
        distance_between(tool_x, tool_y, tool_z, target_x, target_y, target_z) AS defined_final_distance
    FROM trajectories
    WHERE solved
)

SELECT *
FROM defined
WHERE
    abs(joint_movement - defined_joint_movement) > 1e-5 * (1 + defined_joint_movement)
    OR abs(duration - defined_duration) > 1e-9
    OR n_waypoints <> defined_n_waypoints
    OR abs(final_distance - defined_final_distance) > 1e-5;
