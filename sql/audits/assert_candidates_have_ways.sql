-- A labelled run is in the lake, leads to the same target and has a way if, and only if, it is a candidate.
SELECT ways.trajectory_id, ways.target_id, ways.way
FROM ways
LEFT JOIN trajectories USING (robot, scene, pool, trajectory_id)
WHERE
    trajectories.trajectory_id IS NULL
    OR ways.target_id != trajectories.target_id
    OR (ways.way IS NOT NULL) != (solved AND verified);
