-- Pools of studies, and the labelling that each looks at; the study that ran last first. Grain: study, pool.
SELECT study, robot, scene, pool, labelling
FROM studies
ORDER BY run_at DESC, study, pool;
