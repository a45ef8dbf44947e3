-- Success of each trained network of a study, the clusters of a bootstrap: the trials of one network vary
-- together. Grain: selector, budget, policy, training seed.
-- $study: evaluations.study; $kind: 'displaced' or 'unseen' test targets.
SELECT
    selector,
    budget,
    policy,
    seed,
    count(*)::INTEGER AS n,
    count_if(success)::INTEGER AS successes,
    count_if(settled)::INTEGER AS settled
FROM evaluations
WHERE study = $study AND kind = $kind
GROUP BY selector, budget, policy, seed
ORDER BY selector, budget NULLS FIRST, policy, seed;
