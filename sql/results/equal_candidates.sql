-- How many candidates of a target are the same trajectory: where the straight line is free, every
-- optimising planner finds it. Grain: target.
SELECT
    target_id,
    count(*)::INTEGER AS candidates,
    count(DISTINCT (n_waypoints, joint_movement, path_length, smoothness))::INTEGER AS distinct_candidates
FROM trajectories
WHERE robot = $robot AND scene = $scene AND pool = $pool AND solved AND verified
GROUP BY target_id
ORDER BY target_id;
