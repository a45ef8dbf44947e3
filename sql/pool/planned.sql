-- What of a pool has been planned, solved or not; `planner` is the source's label. Grain: source, target.
SELECT DISTINCT
    planner,
    target_id
FROM trajectories
WHERE robot = $robot AND scene = $scene AND pool = $pool;
