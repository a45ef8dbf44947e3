-- Trials of one evaluation as they were recorded: what the view adds is not among them. Grain: one trial.
SELECT * EXCLUDE (failure_reason)
FROM evaluations
WHERE
    robot = $robot
    AND scene = $scene
    AND pool = $pool
    AND study = $study
    AND evaluation_id = $evaluation_id
ORDER BY kind, test_id;
