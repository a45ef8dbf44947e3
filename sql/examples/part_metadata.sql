-- What each part file says about how it came to be: configuration hash, seed, versions.
SELECT file_name, decode(key) AS key, decode(value) AS value
FROM parquet_kv_metadata(lake_root() || '/trajectories/*/*/*/*/part-*.parquet')
WHERE starts_with(decode(key), 'plancurate.')
ORDER BY ALL;
