-- Which planners' trajectories do the hybrids keep most often?
SELECT selector, budget, planner, count(*) AS kept
FROM selections
WHERE selector LIKE '%Hybrid'
GROUP BY ALL
ORDER BY selector, budget, kept DESC;
