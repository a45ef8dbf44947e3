-- Why runs found nothing, commonest reason first.
SELECT robot, scene, planner, status, reason, count(*) AS runs
FROM trajectories
WHERE NOT solved
GROUP BY ALL
ORDER BY runs DESC;
