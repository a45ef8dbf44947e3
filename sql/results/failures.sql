-- Why trials of a study failed, over policies and seeds: with what they collided first, which joint's limit
-- they broke, or that they came to nothing. Grain: scene (and 'all scenes' of several), pool label, selector,
-- budget, failure, detail; '' where a kind of failure has none.
-- $study: evaluations.study; $kind: 'displaced' or 'unseen' test targets.
WITH trials AS (
    SELECT * FROM scene_trials($study, $kind)
),

tried AS (
    SELECT
        scene,
        pool_label,
        selector,
        budget,
        count(*)::INTEGER AS n
    FROM trials
    GROUP BY scene, pool_label, selector, budget
)

SELECT
    trials.scene,
    trials.pool_label,
    trials.selector,
    trials.budget,
    trials.failure,
    trials.failure_detail,
    any_value(tried.n) AS n,                     -- trials, successes included
    count(*)::INTEGER AS failures
FROM trials
INNER JOIN tried
    ON
        trials.scene = tried.scene
        AND trials.pool_label = tried.pool_label
        AND trials.selector = tried.selector
        AND trials.budget IS NOT DISTINCT FROM tried.budget
WHERE trials.failure <> ''
GROUP BY
    trials.scene, trials.pool_label, trials.selector, trials.budget, trials.failure, trials.failure_detail
ORDER BY
    trials.scene, trials.pool_label, trials.selector, trials.budget NULLS FIRST,
    failures DESC, trials.failure, trials.failure_detail;
