-- How many of a study's candidates for a target are the same trajectory (where the straight line is free,
-- every optimising planner finds it), and in how many ways they lead there. Grain: scene, pool label,
-- target.
-- $study: studies.study.
SELECT
    scene,
    pool_label,
    target_id,
    count(*)::INTEGER AS candidates,
    count(DISTINCT (n_waypoints, joint_movement, path_length, smoothness))::INTEGER AS distinct_candidates,
    count(DISTINCT split_part(way, '.', 1))::INTEGER AS goal_classes,
    count(DISTINCT way)::INTEGER AS ways
FROM study_candidates($study)
WHERE solved AND verified
GROUP BY scene, pool_label, target_id
ORDER BY scene, pool_label, target_id;
