-- One row a planning attempt, failed ones included. A part and the merged part that replaces it may lie
-- side by side for a while, hence the last line; DuckDB 2.0 turns row_number() = 1 and min(filename) into
-- two scans that list the folder one after the other, dense_rank() stays a single scan.
CREATE OR REPLACE VIEW trajectories AS
SELECT
    robot,
    scene,
    pool,
    planner,
    * EXCLUDE (robot, scene, pool, planner, filename),
    CASE WHEN NOT solved THEN reason WHEN NOT verified THEN verify_reason END AS failure_reason
FROM read_parquet(
    trajectories_parts(),
    filename = true,
    hive_partitioning = true,
    hive_types = {'robot': VARCHAR, 'scene': VARCHAR, 'pool': VARCHAR, 'planner': VARCHAR}
)
WHERE is_beside_catalog()
QUALIFY dense_rank() OVER (
    PARTITION BY robot, scene, pool, planner, trajectory_id ORDER BY filename
) = 1;
