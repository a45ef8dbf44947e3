-- Targets of a pool. Grain: one target. $targets: list of ids, or NULL for all.
SELECT target_id, x, y, z
FROM targets
WHERE
    robot = $robot
    AND scene = $scene
    AND pool = $pool
    AND ($targets IS NULL OR list_contains($targets, target_id))
ORDER BY target_id;
