-- How stably scores that are estimated from rollouts rank candidates: mean and least split-half correlation
-- over selection seeds. Grain: scene, pool label, selector, budget.
-- $study: selections.study.
WITH made AS (
    SELECT DISTINCT scene, pool_label, selector, budget, split_half, selection_id
    FROM selections
    INNER JOIN studies USING (study, robot, scene, pool)
    INNER JOIN rankings USING (robot, scene, pool, selection_id)
    WHERE study = $study
)

SELECT
    scene,
    pool_label,
    selector,
    budget,
    count(*)::INTEGER AS selections,
    avg(split_half) AS split_half,
    min(split_half) AS least
FROM made
GROUP BY scene, pool_label, selector, budget
ORDER BY scene, pool_label, selector, budget NULLS FIRST;
