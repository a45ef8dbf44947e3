-- Results of each network of a study. Grain: scene, pool label, selector, budget, policy, training seed,
-- selection seed, round of corrections.
-- $study: evaluations.study; $kind: test targets: 'displaced', 'unseen' or 'unseen_scene'.
SELECT
    scene,
    pool_label,
    any_value(kind) AS kind,
    selector,
    budget,
    policy,
    seed,                                        -- of training
    selection_seed,
    round,                                       -- of corrections; 0: none
    count(*)::INTEGER AS n,
    count_if(success)::INTEGER AS successes,
    count_if(settled)::INTEGER AS settled,
    count_if(hard)::INTEGER AS hard_n,           -- the straight line in joint space is not free
    count_if(hard AND success)::INTEGER AS hard_successes,
    count_if(hard AND settled)::INTEGER AS hard_settled,
    avg(final_distance) AS final_distance,       -- m
    avg(path_length) AS path_length,             -- m
    avg(joint_movement) AS joint_movement,       -- rad
    any_value(selection_time_s) AS selection_time_s,
    any_value(n_kept) AS n_kept
FROM study_trials($study)
WHERE kind = $kind
GROUP BY scene, pool_label, selector, budget, policy, seed, selection_seed, round
ORDER BY scene, pool_label, selector, budget NULLS FIRST, policy, seed, selection_seed, round;
