-- One row a test of a study's policies and reference that they are set beside: Planner (the ceiling), Replay
-- (the nearest training target's best trajectory, unchanged), StraightLine (in joint space to the goal
-- nearest to the start). What succeeds ends at the target and stays there.
CREATE OR REPLACE VIEW reference_trials AS
SELECT robot, scene, pool, study, * EXCLUDE (robot, scene, pool, study, filename)
FROM read_parquet(
    reference_trials_parts(),
    filename = true,
    hive_partitioning = true,
    hive_types = {'robot': VARCHAR, 'scene': VARCHAR, 'pool': VARCHAR, 'study': VARCHAR}
)
WHERE is_beside_catalog()
QUALIFY dense_rank() OVER (
    PARTITION BY robot, scene, pool, study, reference, kind, test_id ORDER BY filename
) = 1;
