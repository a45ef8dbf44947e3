-- Seconds that each selection of a study took, in all and by stage.
-- Grain: scene, pool label, selector, budget, selection seed.
-- $study: selections.study.
SELECT
    scene,
    pool_label,
    selector,
    budget,
    seed AS selection_seed,
    any_value(prepare_s) AS prepare_s,
    any_value(base_policy_s) AS base_policy_s,
    any_value(rollouts_s) AS rollouts_s,
    any_value(cluster_s) AS cluster_s,
    any_value(score_s) AS score_s,
    any_value(select_s) AS select_s,
    any_value(selection_time_s) AS selection_time_s,
    any_value(pool_hash) AS pool_hash
FROM selections
INNER JOIN studies USING (study, robot, scene, pool)
WHERE study = $study
GROUP BY scene, pool_label, selector, budget, selection_seed
ORDER BY scene, pool_label, selector, budget NULLS FIRST, selection_seed;
