SELECT trajectory_id, count(*) AS times
FROM trajectories
GROUP BY trajectory_id
HAVING times > 1;
