-- What of a pool has been planned, solved or not. Grain: one planner and target.
SELECT DISTINCT
    planner,
    target_id
FROM trajectories
WHERE robot = $robot AND scene = $scene AND pool = $pool;
