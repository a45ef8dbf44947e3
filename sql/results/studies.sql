-- Studies, the last run first. Grain: study.
SELECT
    study,                                        -- what result queries take as $study
    any_value(name) AS name,
    any_value(study_key) AS study_key,
    max(run_at) AS run_at
FROM studies
GROUP BY study
ORDER BY run_at DESC, study;
