-- Studies that have trials, the last run first. Grain: study.
SELECT
    study,                                        -- what result queries take as $study
    any_value(name) AS name,
    any_value(study_key) AS study_key,
    any_value(n_targets) AS n_targets,            -- training targets in each pool
    any_value(config) AS config,                  -- JSON
    max(run_at) AS run_at
FROM studies
WHERE study IN (SELECT study FROM evaluations)
GROUP BY study
ORDER BY run_at DESC, study;
