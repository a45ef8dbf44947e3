-- Mean and sample standard deviation (null for a single trial) of how the trials of a study went, over
-- policies and seeds: what t intervals and Welch tests need.
-- Grain: scene (and 'all scenes' of several), pool label, selector, budget.
-- $study: evaluations.study; $kind: test targets: 'displaced', 'unseen' or 'unseen_scene'.
SELECT
    scene,
    pool_label,
    selector,
    budget,
    count(*)::INTEGER AS n,
    avg(final_distance) AS final_distance,               -- m, when the rollout ended
    stddev_samp(final_distance) AS final_distance_std,
    avg(settled_distance) AS settled_distance,           -- m, at the step limit
    stddev_samp(settled_distance) AS settled_distance_std,
    avg(path_length) AS path_length,                     -- m
    stddev_samp(path_length) AS path_length_std,
    avg(joint_movement) AS joint_movement,               -- rad
    stddev_samp(joint_movement) AS joint_movement_std
FROM scene_trials($study, $kind)
GROUP BY scene, pool_label, selector, budget
ORDER BY scene, pool_label, selector, budget NULLS FIRST;
