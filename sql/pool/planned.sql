-- What of a pool has been planned, solved or not; `planner` is the source's label. Grain: source, target.
SELECT
    planner,
    target_id,
    count(*)::INTEGER AS runs
FROM trajectories
WHERE robot = $robot AND scene = $scene AND pool = $pool
GROUP BY planner, target_id;
