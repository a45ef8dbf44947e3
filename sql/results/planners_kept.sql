-- Whose trajectories the selections of a study keep. Grain: selector, budget, planner.
-- $study: evaluations.study; $kind: 'displaced' or 'unseen' test targets.
WITH tested AS (
    SELECT DISTINCT robot, scene, pool, study, selection_id
    FROM evaluations
    WHERE study = $study AND kind = $kind
)

SELECT
    selector,
    budget,
    planner,
    count(*)::INTEGER AS kept,
    count(*) / sum(count(*)) OVER (PARTITION BY selector, budget) AS share    -- of what the selection keeps
FROM selections
INNER JOIN tested USING (robot, scene, pool, study, selection_id)
GROUP BY selector, budget, planner
ORDER BY selector, budget NULLS FIRST, kept DESC, planner;
