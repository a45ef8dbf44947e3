-- The steps with the largest joint difference, from the waypoints themselves.
SELECT
    trajectory_id,
    step,
    list_max([abs(a - b) for a, b in list_zip(q, lag(q) OVER w)]) AS largest_difference
FROM waypoints
WINDOW w AS (PARTITION BY trajectory_id ORDER BY step)
ORDER BY largest_difference DESC NULLS LAST
LIMIT 20;
