-- Success of a study by the distance of the tested from the trained target, over policies and training seeds.
-- Fresh targets have no such distance. Grain: selector, budget, distance.
-- $study: evaluations.study; $kind: 'displaced' or 'unseen' test targets.
SELECT
    selector,
    budget,
    distance_cm,
    count(*)::INTEGER AS n,
    count_if(success)::INTEGER AS successes,
    count_if(settled)::INTEGER AS settled
FROM evaluations
WHERE study = $study AND kind = $kind AND distance_cm IS NOT NULL
GROUP BY selector, budget, distance_cm
ORDER BY selector, budget NULLS FIRST, distance_cm;
