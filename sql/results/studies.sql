-- Studies that have trials, latest first. Grain: one configuration of a study.
SELECT
    evaluations.study,                            -- what result queries take as $study
    any_value(studies.name) AS name,
    any_value(studies.run_at) AS created_at,
    count(*) AS trials
FROM evaluations
LEFT JOIN studies USING (study, pool)
GROUP BY evaluations.study
ORDER BY created_at DESC NULLS LAST, evaluations.study;
