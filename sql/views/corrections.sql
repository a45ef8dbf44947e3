-- One row a path by which a network is corrected: from a state that the network of the round before, its
-- parent, came to on its way to a training target, to the goal configuration that demonstrations to that
-- target end at.
CREATE OR REPLACE VIEW corrections AS
SELECT robot, scene, pool, * EXCLUDE (robot, scene, pool, filename)
FROM read_parquet(
    corrections_parts(),
    filename = true,
    hive_partitioning = true,
    hive_types = {'robot': VARCHAR, 'scene': VARCHAR, 'pool': VARCHAR}
)
WHERE is_beside_catalog()
QUALIFY dense_rank() OVER (
    PARTITION BY robot, scene, pool, correction_id ORDER BY filename
) = 1;
