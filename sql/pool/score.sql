-- Composite score of every candidate, lower is better. Grain: one candidate.
-- $scaling: 'zscore' standardises each metric over the pool ("equal weighting" needs it, the units
-- differ), 'raw' adds them as they are.
WITH pool AS (
    SELECT
        avg(joint_movement) AS joint_movement_mean,
        avg(smoothness) AS smoothness_mean,
        avg(path_length) AS path_length_mean,
        stddev_pop(joint_movement) AS joint_movement_std,
        stddev_pop(smoothness) AS smoothness_std,
        stddev_pop(path_length) AS path_length_std
    FROM candidates
),

scaled AS (
    SELECT
        "row",
        CASE WHEN $scaling = 'raw' THEN joint_movement
            ELSE coalesce((joint_movement - joint_movement_mean) / nullif(joint_movement_std, 0), 0)
        END AS joint_movement,
        CASE WHEN $scaling = 'raw' THEN smoothness
            ELSE coalesce((smoothness - smoothness_mean) / nullif(smoothness_std, 0), 0)
        END AS smoothness,
        CASE WHEN $scaling = 'raw' THEN path_length
            ELSE coalesce((path_length - path_length_mean) / nullif(path_length_std, 0), 0)
        END AS path_length
    FROM candidates, pool
)

SELECT
    "row",
    $joint_movement * joint_movement
    + $smoothness * smoothness
    + $path_length * path_length AS score
FROM scaled
ORDER BY "row";
