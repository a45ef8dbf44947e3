-- Runs of some planners ($planners) to some targets ($targets) of a pool, with the waypoints of those that
-- are candidates. Grain: one run.
SELECT
    trajectory_id,
    target_id,
    CASE WHEN solved AND verified THEN q END AS q
FROM trajectories
WHERE
    robot = $robot
    AND scene = $scene
    AND pool = $pool
    AND list_contains($planners, planner)
    AND list_contains($targets, target_id)
ORDER BY trajectory_id;
