-- One row a planning attempt, failed ones included. A part and the merged part that replaces it may lie
-- side by side for a while, hence the last line.
CREATE OR REPLACE VIEW trajectories AS
SELECT robot, scene, pool, planner, * EXCLUDE (robot, scene, pool, planner, filename)
FROM read_parquet(
    lake_root() || '/trajectories/robot=*/scene=*/pool=*/planner=*/part-*.parquet',
    filename = true,
    hive_partitioning = true,
    hive_types = {'robot': VARCHAR, 'scene': VARCHAR, 'pool': VARCHAR, 'planner': VARCHAR}
)
QUALIFY row_number() OVER (
    PARTITION BY robot, scene, pool, planner, trajectory_id ORDER BY filename
) = 1;
