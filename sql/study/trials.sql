-- Trials of one evaluation as they were recorded. Grain: one trial.
SELECT *
FROM evaluations
WHERE
    robot = $robot
    AND scene = $scene
    AND pool = $pool
    AND study = $study
    AND evaluation_id = $evaluation_id
ORDER BY kind, test_id;
