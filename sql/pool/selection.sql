-- One selection as it was recorded. Grain: one kept trajectory.
SELECT *
FROM selections
WHERE
    robot = $robot
    AND scene = $scene
    AND pool = $pool
    AND study = $study
    AND selection_id = $selection_id
ORDER BY trajectory_id;
