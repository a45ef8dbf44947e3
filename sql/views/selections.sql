-- One row a trajectory that a selector kept.
CREATE OR REPLACE VIEW selections AS
SELECT robot, scene, pool, selector, * EXCLUDE (robot, scene, pool, selector, filename)
FROM read_parquet(
    selections_parts(),
    filename = true,
    hive_partitioning = true,
    hive_types = {'robot': VARCHAR, 'scene': VARCHAR, 'pool': VARCHAR, 'selector': VARCHAR}
)
WHERE is_beside_catalog()
QUALIFY dense_rank() OVER (
    PARTITION BY robot, scene, pool, selector, selection_id, trajectory_id ORDER BY filename
) = 1;
