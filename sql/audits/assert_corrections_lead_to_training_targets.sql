-- Whoever corrects a policy on the way to anything but a target that was planned to trains it on a test.
SELECT corrections.correction_id, corrections.target_id
FROM corrections
LEFT JOIN (
    SELECT DISTINCT robot, scene, pool, target_id
    FROM trajectories
    WHERE solved AND verified
) AS planned USING (robot, scene, pool, target_id)
WHERE planned.target_id IS NULL;
