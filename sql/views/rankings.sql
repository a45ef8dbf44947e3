-- One row a selection whose scores are estimated from rollouts: how stable the order is that they give.
CREATE OR REPLACE VIEW rankings AS
SELECT robot, scene, pool, * EXCLUDE (robot, scene, pool, filename)
FROM read_parquet(
    rankings_parts(),
    filename = true,
    hive_partitioning = true,
    hive_types = {'robot': VARCHAR, 'scene': VARCHAR, 'pool': VARCHAR}
)
WHERE is_beside_catalog()
QUALIFY dense_rank() OVER (
    PARTITION BY robot, scene, pool, selection_id ORDER BY filename
) = 1;
