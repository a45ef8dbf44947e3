-- Waypoints (waypoints x joints) of the trajectories named in $ids. Grain: one trajectory.
-- $first, $last: the lowest and highest of the ids, by which whole row groups are passed over unread.
SELECT trajectory_id, q
FROM trajectories
WHERE
    robot = $robot
    AND scene = $scene
    AND pool = $pool
    AND trajectory_id BETWEEN $first AND $last
    AND trajectory_id IN (SELECT unnest($ids));
