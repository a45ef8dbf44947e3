-- One row a trajectory that a selector kept, in each study that uses the selection.
CREATE OR REPLACE VIEW selections AS
SELECT robot, scene, pool, study, * EXCLUDE (robot, scene, pool, study, filename)
FROM read_parquet(
    selections_parts(),
    filename = true,
    hive_partitioning = true,
    hive_types = {'robot': VARCHAR, 'scene': VARCHAR, 'pool': VARCHAR, 'study': VARCHAR}
)
WHERE is_beside_catalog()
QUALIFY dense_rank() OVER (
    PARTITION BY robot, scene, pool, study, selection_id, trajectory_id ORDER BY filename
) = 1;
