-- Corrections that networks named in $networks learn from. Grain: one correction.
SELECT correction_id, target_id, q
FROM corrections
WHERE
    robot = $robot
    AND scene = $scene
    AND pool = $pool
    AND list_contains($networks::VARCHAR[], network_id)
ORDER BY round, correction_id;
