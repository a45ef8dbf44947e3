-- Whose trajectories the selections of a study keep, over selection seeds.
-- Grain: scene, pool label, selector, budget, planner.
-- $study: selections.study.
SELECT
    scene,
    pool_label,
    selector,
    budget,
    planner,
    count(*)::INTEGER AS kept,
    count(*) / sum(count(*)) OVER (    -- of all that these selections keep
        PARTITION BY scene, pool_label, selector, budget
    ) AS share
FROM selections
INNER JOIN studies USING (study, robot, scene, pool)
WHERE study = $study
GROUP BY scene, pool_label, selector, budget, planner
ORDER BY scene, pool_label, selector, budget NULLS FIRST, kept DESC, planner;
