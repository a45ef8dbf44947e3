-- One row a pool of a study: what the study is made of, and when it last became the latest of its name.
-- `study` (name-key) is the study's identifier in selections, evaluations and MLflow too.
CREATE OR REPLACE VIEW studies AS
SELECT study, * EXCLUDE (study, filename)
FROM read_parquet(
    studies_parts(),
    filename = true,
    hive_partitioning = true,
    hive_types = {'study': VARCHAR}
)
WHERE is_beside_catalog()
QUALIFY row_number() OVER (PARTITION BY study, pool ORDER BY run_at DESC, filename) = 1;
