-- What each selection of a pool covers. Grain: selection.
WITH per_target AS (
    SELECT selector, budget, seed, selection_id, n_targets, target_id, count(*) AS kept
    FROM selections
    WHERE study = $study
    GROUP BY ALL
),

other AS (
    SELECT
        selection_id,
        count(DISTINCT planner)::INTEGER AS planners,
        count(DISTINCT (target_id, goal_index))::INTEGER AS goal_configurations
    FROM selections
    WHERE study = $study
    GROUP BY selection_id
)

SELECT
    selector,
    budget,
    seed,
    selection_id,
    sum(kept)::INTEGER AS kept,
    (any_value(n_targets) - count(*))::INTEGER AS targets_without,
    CASE WHEN count(*) < any_value(n_targets) THEN 0 ELSE min(kept) END::INTEGER AS least_per_target,
    median(kept) AS median_of_covered_targets,
    max(kept)::INTEGER AS most_per_target,
    any_value(planners) AS planners,
    any_value(goal_configurations) AS goal_configurations
FROM per_target
INNER JOIN other USING (selection_id)
GROUP BY selector, budget, seed, selection_id
ORDER BY selector, budget NULLS FIRST, seed;
