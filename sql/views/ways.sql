-- One row a run and labelling: in which way its trajectory leads to the target, "g<goal class>.p<path
-- class>", null where none is verified. A labelling is that of one set of sources; a study names its own
-- in studies.labelling.
CREATE OR REPLACE VIEW ways AS
SELECT robot, scene, pool, labelling, * EXCLUDE (robot, scene, pool, labelling, filename)
FROM read_parquet(
    ways_parts(),
    filename = true,
    hive_partitioning = true,
    hive_types = {'robot': VARCHAR, 'scene': VARCHAR, 'pool': VARCHAR, 'labelling': VARCHAR}
)
WHERE is_beside_catalog()
QUALIFY dense_rank() OVER (
    PARTITION BY robot, scene, pool, labelling, trajectory_id ORDER BY filename
) = 1;
