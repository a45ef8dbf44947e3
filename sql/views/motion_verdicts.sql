-- One row a test that a network reached: whether the robot may run the rollout, timed, as a motion. Only of
-- the first tests of each network, as many as the study's `verified_tests` says.
CREATE OR REPLACE VIEW motion_verdicts AS
SELECT robot, scene, pool, study, * EXCLUDE (robot, scene, pool, study, filename)
FROM read_parquet(
    motion_verdicts_parts(),
    filename = true,
    hive_partitioning = true,
    hive_types = {'robot': VARCHAR, 'scene': VARCHAR, 'pool': VARCHAR, 'study': VARCHAR}
)
WHERE is_beside_catalog()
QUALIFY dense_rank() OVER (
    PARTITION BY robot, scene, pool, study, evaluation_id, kind, test_id ORDER BY filename
) = 1;
