-- Why trials of a study failed, over policies and seeds: with what they collided first, which joint's limit
-- they broke, or that they came to nothing. Grain: scene (and 'all scenes' of several), pool label, selector,
-- budget, failure, detail; '' where a kind of failure has none.
-- $study: evaluations.study; $kind: test targets: 'displaced', 'unseen' or 'unseen_scene'.
SELECT
    scene,
    pool_label,
    selector,
    budget,
    failure,
    failure_detail,
    sum(count(*)) OVER selection::INTEGER AS n,  -- trials, successes included
    count(*)::INTEGER AS failures
FROM scene_trials($study, $kind)
GROUP BY scene, pool_label, selector, budget, failure, failure_detail
WINDOW selection AS (PARTITION BY scene, pool_label, selector, budget)
QUALIFY failure <> ''
ORDER BY scene, pool_label, selector, budget NULLS FIRST, failures DESC, failure, failure_detail;
