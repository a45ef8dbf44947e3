-- Success of a study by policy, over training and selection seeds.
-- Grain: scene (and 'all scenes' of several), pool label, selector, budget, policy.
-- $study: evaluations.study; $kind: test targets: 'displaced', 'unseen' or 'unseen_scene'.
SELECT
    scene,
    pool_label,
    selector,
    budget,
    policy,
    count(*)::INTEGER AS n,
    count_if(success)::INTEGER AS successes,
    count_if(settled)::INTEGER AS settled
FROM scene_trials($study, $kind)
GROUP BY scene, pool_label, selector, budget, policy
ORDER BY scene, pool_label, selector, budget NULLS FIRST, policy;
