WITH kept AS (
    SELECT robot, scene, pool, study, selection_id, count(*) AS n_selected
    FROM selections
    GROUP BY ALL
)

SELECT DISTINCT
    evaluations.evaluation_id,
    evaluations.selection_id,
    evaluations.n_kept,
    kept.n_selected
FROM evaluations
LEFT JOIN kept USING (robot, scene, pool, study, selection_id)
WHERE evaluations.n_kept IS DISTINCT FROM kept.n_selected;
