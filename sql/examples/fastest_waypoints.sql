-- The steps with the largest joint difference, from the waypoints themselves.
WITH steps AS (
    SELECT
        trajectory_id,
        step,
        q,
        lag(q) OVER (PARTITION BY trajectory_id ORDER BY step) AS previous
    FROM waypoints
)

SELECT
    trajectory_id,
    step,
    list_max(list_transform(q, lambda angle, joint: abs(angle - previous[joint]))) AS largest_difference
FROM steps
WHERE previous IS NOT NULL
ORDER BY largest_difference DESC
LIMIT 20;
