-- What each part file says about how it came to be: configuration hash, seed, versions.
SELECT file_name, decode(key) AS key, decode(value) AS value
FROM parquet_kv_metadata(trajectories_parts())
WHERE starts_with(decode(key), 'plancurate.')
ORDER BY ALL;
