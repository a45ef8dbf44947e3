-- How a study was set up. Grain: one row.
-- $study: evaluations.study.
SELECT study, study_key, config, robot, scene, pool, created_at, package_version, ompl_version
FROM studies
WHERE study || '-' || study_key = $study
ORDER BY created_at DESC
LIMIT 1;
