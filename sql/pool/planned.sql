-- What of a pool has been planned, solved or not. Grain: one source and target; `planner` is the source's label.
SELECT DISTINCT
    planner,
    target_id
FROM trajectories
WHERE robot = $robot AND scene = $scene AND pool = $pool;
