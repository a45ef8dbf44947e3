SELECT selections.selection_id, selections.trajectory_id
FROM selections
LEFT JOIN trajectories USING (robot, scene, pool, planner, trajectory_id)
WHERE NOT coalesce(trajectories.solved AND trajectories.verified, false);
