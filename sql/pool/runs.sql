-- Runs of one source to the targets numbered in $targets, as they are stored. Grain: run.
SELECT *
FROM trajectories
WHERE
    robot = $robot
    AND scene = $scene
    AND pool = $pool
    AND planner = $planner
    AND target_id IN (SELECT unnest($targets))
ORDER BY target_id, run;
