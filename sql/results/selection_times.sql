-- Seconds that each selection of a study took, in all and by stage. Grain: selector, budget.
-- $study: evaluations.study; $kind: 'displaced' or 'unseen' test targets.
WITH tested AS (
    SELECT DISTINCT robot, scene, pool, study, selection_id
    FROM evaluations
    WHERE study = $study AND kind = $kind
)

SELECT
    selector,
    budget,
    any_value(prepare_s) AS prepare_s,
    any_value(base_policy_s) AS base_policy_s,
    any_value(rollouts_s) AS rollouts_s,
    any_value(cluster_s) AS cluster_s,
    any_value(score_s) AS score_s,
    any_value(select_s) AS select_s,
    any_value(selection_time_s) AS selection_time_s,
    any_value(pool_hash) AS pool_hash
FROM selections
INNER JOIN tested USING (robot, scene, pool, study, selection_id)
GROUP BY selector, budget, selection_id
ORDER BY selector, budget NULLS FIRST, selection_id;
