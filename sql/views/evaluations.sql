-- One row a trial: one policy, trained on one selection with one seed, sent to one test target.
CREATE OR REPLACE VIEW evaluations AS
SELECT
    robot,
    scene,
    pool,
    study,
    * EXCLUDE (robot, scene, pool, study, filename),
    CASE WHEN NOT success THEN concat_ws(': ', failure, nullif(failure_detail, '')) END AS failure_reason
FROM read_parquet(
    evaluations_parts(),
    filename = true,
    hive_partitioning = true,
    hive_types = {'robot': VARCHAR, 'scene': VARCHAR, 'pool': VARCHAR, 'study': VARCHAR}
)
WHERE is_beside_catalog()
QUALIFY dense_rank() OVER (
    PARTITION BY robot, scene, pool, study, evaluation_id, kind, test_id ORDER BY filename
) = 1;
