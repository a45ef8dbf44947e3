-- Which planners' trajectories do the hybrids of each study keep most often?
SELECT study, scene, selector, budget, planner, count(*) AS kept
FROM selections
WHERE selector LIKE '%Hybrid'
GROUP BY ALL
ORDER BY study, scene, selector, budget, kept DESC;
