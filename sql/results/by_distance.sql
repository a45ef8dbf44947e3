-- Success of a study by the distance of the tested from the trained target, over policies and seeds.
-- Fresh targets have no such distance.
-- Grain: scene (and 'all scenes' of several), pool label, selector, budget, distance.
-- $study: evaluations.study; $kind: test targets: 'displaced', 'unseen' or 'unseen_scene'.
SELECT
    scene,
    pool_label,
    selector,
    budget,
    distance_cm,
    count(*)::INTEGER AS n,
    count_if(success)::INTEGER AS successes,
    count_if(settled)::INTEGER AS settled
FROM scene_trials($study, $kind)
WHERE distance_cm IS NOT NULL
GROUP BY scene, pool_label, selector, budget, distance_cm
ORDER BY scene, pool_label, selector, budget NULLS FIRST, distance_cm;
