-- How each network of a study, after its last round of corrections, did at each test target, in lists of
-- equal length: what a bootstrap draws from.
-- Grain: scene, pool label, selector, budget, policy, training seed, selection seed.
-- $study: evaluations.study; $kind: test targets: 'displaced', 'unseen' or 'unseen_scene'.
SELECT
    scene,
    pool_label,
    selector,
    budget,
    policy,
    seed,                                        -- of training
    selection_seed,
    list(test_id ORDER BY test_id) AS test_ids,
    list(success ORDER BY test_id) AS success,
    list(settled ORDER BY test_id) AS settled,
    list(coalesce(distance_cm, -1) ORDER BY test_id) AS distances_cm    -- -1: a fresh target
FROM final_trials($study, $kind)
GROUP BY scene, pool_label, selector, budget, policy, seed, selection_seed
ORDER BY scene, pool_label, selector, budget NULLS FIRST, policy, seed, selection_seed;
