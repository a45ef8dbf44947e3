-- Waypoints (waypoints x joints) of the trajectories named in $ids. Grain: one trajectory.
SELECT trajectory_id, target_x, target_y, target_z, dt, q
FROM trajectories
WHERE
    robot = $robot
    AND scene = $scene
    AND pool = $pool
    AND trajectory_id IN (SELECT unnest($ids));
