-- How many of a study's candidates for a target are the same trajectory: where the straight line is free,
-- every optimising planner finds it. Grain: scene, pool label, target.
-- $study: studies.study.
SELECT
    scene,
    pool_label,
    target_id,
    count(*)::INTEGER AS candidates,
    count(DISTINCT (n_waypoints, joint_movement, path_length, smoothness))::INTEGER AS distinct_candidates
FROM study_candidates($study)
WHERE solved AND verified
GROUP BY scene, pool_label, target_id
ORDER BY scene, pool_label, target_id;
