-- Of a network's first tests, unseen ones first, those that it reached. Grain: one test.
-- $robot, $scene, $pool, $study, $evaluation_id: whose trials; $tests: how many tests are looked at.
WITH first AS (
    SELECT kind, test_id, target_id, x, y, z, success
    FROM evaluations
    WHERE
        robot = $robot
        AND scene = $scene
        AND pool = $pool
        AND study = $study
        AND evaluation_id = $evaluation_id
    ORDER BY kind <> 'displaced' DESC, test_id
    LIMIT $tests
)

SELECT kind, test_id, target_id, x, y, z
FROM first
WHERE success
ORDER BY kind <> 'displaced' DESC, test_id;
