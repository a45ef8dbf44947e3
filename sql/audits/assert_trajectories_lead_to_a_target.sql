SELECT trajectories.trajectory_id, trajectories.target_id
FROM trajectories
LEFT JOIN targets USING (robot, scene, pool, target_id)
WHERE
    targets.target_id IS NULL
    OR distance_between(target_x, target_y, target_z, targets.x, targets.y, targets.z) > 1e-9;
