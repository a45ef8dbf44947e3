-- One row a target: position of the tool (m) and the goal configurations that reach it (rad, m).
CREATE OR REPLACE VIEW targets AS
SELECT robot, scene, pool, * EXCLUDE (robot, scene, pool, filename)
FROM read_parquet(
    targets_parts(),
    filename = true,
    hive_partitioning = true,
    hive_types = {'robot': VARCHAR, 'scene': VARCHAR, 'pool': VARCHAR}
)
WHERE is_beside_catalog()
QUALIFY dense_rank() OVER (PARTITION BY robot, scene, pool, target_id ORDER BY filename) = 1;
