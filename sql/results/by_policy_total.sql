-- Success of a study by policy, over training seeds. Grain: selector, budget, policy.
-- $study: evaluations.study; $kind: 'displaced' or 'unseen' test targets.
SELECT
    selector,
    budget,
    policy,
    count(*)::INTEGER AS n,
    count_if(success)::INTEGER AS successes,
    count_if(settled)::INTEGER AS settled,
    count(DISTINCT seed)::INTEGER AS seeds
FROM evaluations
WHERE study = $study AND kind = $kind
GROUP BY selector, budget, policy
ORDER BY selector, budget NULLS FIRST, policy;
