-- The trajectories that a selection kept, as they were planned; as kept where a selector changed them.
-- Grain: one trajectory. $selection_id: selections.selection_id; studies share selections, hence DISTINCT.
SELECT DISTINCT ON (trajectory_id)
    selections.robot,
    selections.scene,
    selections.selector,
    selections.budget,
    trajectories.trajectory_id,
    trajectories.target_id,
    trajectories.target_x,
    trajectories.target_y,
    trajectories.target_z,
    trajectories.dt,
    trajectories.q
FROM selections
INNER JOIN trajectories USING (robot, scene, pool, trajectory_id)
WHERE selections.selection_id = $selection_id
ORDER BY trajectory_id;
