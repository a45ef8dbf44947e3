-- The study that ran last under a name. Grain: one row, none without such a study.
SELECT study
FROM studies
WHERE name = $study_name
ORDER BY run_at DESC
LIMIT 1;
