-- How a study was set up. Grain: one row.
-- $study: evaluations.study.
SELECT study, study_key, config, robot, scene, pool, run_at AS created_at, package_version, ompl_version
FROM studies
WHERE study = $study
ORDER BY run_at DESC
LIMIT 1;
