-- Result rows of a study. Grain: selector, budget, policy, training seed.
-- $study: evaluations.study; $kind: 'displaced' or 'unseen' test targets.
SELECT
    scene,
    '' AS pool_label,
    selection_seed,
    selector,
    budget,
    policy,
    seed,
    count(*)::INTEGER AS n,
    count_if(success)::INTEGER AS successes,
    count_if(settled)::INTEGER AS settled,
    avg(final_distance) AS final_distance,       -- m
    avg(path_length) AS path_length,             -- m
    avg(joint_movement) AS joint_movement,       -- rad
    any_value(selection_time_s) AS selection_time_s,
    any_value(n_kept) AS n_kept
FROM evaluations
WHERE study = $study AND kind = $kind
GROUP BY scene, selection_seed, selector, budget, policy, seed
ORDER BY selector, budget NULLS FIRST, policy, seed;
