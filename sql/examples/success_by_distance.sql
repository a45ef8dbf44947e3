-- Success against the distance (cm) between a tested target and the trained one.
SELECT study, scene, selector, budget, distance_cm, count(*) AS n, avg(success::INTEGER) AS success_rate
FROM evaluations
WHERE kind = 'displaced'
GROUP BY ALL
ORDER BY ALL;
