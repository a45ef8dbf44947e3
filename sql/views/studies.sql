-- One row a configuration of a study; its trials are evaluations.study = study || '-' || study_key.
CREATE OR REPLACE VIEW studies AS
SELECT study, * EXCLUDE (study, filename)
FROM read_parquet(
    studies_parts(),
    filename = true,
    hive_partitioning = true,
    hive_types = {'study': VARCHAR}
)
WHERE is_beside_catalog()
QUALIFY dense_rank() OVER (PARTITION BY study, study_key ORDER BY filename) = 1;
