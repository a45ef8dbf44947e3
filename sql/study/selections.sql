-- Selections of all studies. Grain: selection, study that uses it, the one that ran last first.
SELECT
    selections.selection_id,
    selections.study,
    selections.robot,
    selections.scene,
    selections.pool
FROM selections
INNER JOIN studies USING (study, robot, scene, pool)
GROUP BY ALL
ORDER BY selection_id, max(studies.run_at) DESC, study;
