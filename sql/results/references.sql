-- What no policy does, on the tests of a study's policies: a planner, a replayed trajectory, a straight line.
-- Grain: scene (and 'all scenes' of several), pool label, reference.
-- $study: reference_trials.study; $kind: test targets: 'displaced', 'unseen' or 'unseen_scene'.
SELECT
    CASE WHEN grouping(scene) = 1 THEN 'all scenes' ELSE scene END AS scene,
    pool_label,
    reference,
    count(*)::INTEGER AS n,
    count_if(success)::INTEGER AS successes,
    count_if(hard)::INTEGER AS hard_n,           -- tests whose straight joint line is not free
    count_if(hard AND success)::INTEGER AS hard_successes
FROM reference_trials
INNER JOIN studies USING (study, robot, scene, pool)
WHERE study = $study AND kind = $kind
GROUP BY GROUPING SETS ((pool_label, reference, scene), (pool_label, reference))
HAVING grouping(scene) = 0 OR count(DISTINCT scene) > 1
ORDER BY grouping(scene) DESC, scene, pool_label, reference;
