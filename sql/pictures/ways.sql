-- Verified candidates of a study to one of its targets, each with its way: to the one with most ways, unless
-- asked for one. Grain: one candidate. $study: studies.study. $target_id: or NULL.
WITH candidates AS (
    SELECT * FROM study_candidates($study) WHERE scene = $scene AND verified
),

chosen AS (
    SELECT target_id
    FROM candidates
    WHERE $target_id IS NULL OR target_id = $target_id
    GROUP BY target_id
    ORDER BY count(DISTINCT way) DESC, target_id
    LIMIT 1
)

SELECT robot, scene, trajectory_id, target_id, way, path_length, target_x, target_y, target_z, dt, q
FROM candidates
WHERE target_id = (SELECT target_id FROM chosen)
ORDER BY way, path_length, trajectory_id;
