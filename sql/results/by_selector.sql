-- Totals of a study over policies and training seeds. Grain: selector, budget.
-- $study: evaluations.study; $kind: 'displaced' or 'unseen' test targets.
WITH trials AS (
    SELECT * FROM evaluations WHERE study = $study AND kind = $kind
),

selected AS (
    SELECT selector, budget, avg(selection_time_s) AS selection_time_s, avg(n_kept) AS n_kept
    FROM (SELECT DISTINCT selector, budget, selection_id, selection_time_s, n_kept FROM trials)
    GROUP BY selector, budget
)

SELECT
    trials.selector,
    trials.budget,
    count(*)::INTEGER AS n,
    count_if(success)::INTEGER AS successes,
    count_if(settled)::INTEGER AS settled,
    avg(final_distance) AS final_distance,       -- m
    avg(path_length) AS path_length,             -- m
    avg(joint_movement) AS joint_movement,       -- rad
    any_value(selected.selection_time_s) AS selection_time_s,
    any_value(selected.n_kept) AS n_kept
FROM trials
INNER JOIN selected
    ON trials.selector = selected.selector AND trials.budget IS NOT DISTINCT FROM selected.budget
GROUP BY trials.selector, trials.budget
ORDER BY successes / n DESC, trials.selector, trials.budget NULLS FIRST;
