-- How a study was set up. Grain: scene, pool label.
-- $study: studies.study.
SELECT
    study,
    name,
    study_key,
    config,                                       -- JSON
    robot,
    scene,
    pool,
    pool_label,
    planners,
    n_targets,
    run_at,
    package_version,
    ompl_version
FROM studies
WHERE study = $study
ORDER BY scene, pool_label;
