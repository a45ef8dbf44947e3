-- One row a trajectory that selection a or selection b keeps: kept_by is 'both', 'a' or 'b'. Selections are
-- named by their ids, or by a beginning that no other has (an error otherwise).
CREATE OR REPLACE MACRO selection_diff(a, b) AS TABLE
WITH kept_by_a AS (
    SELECT trajectory_id, any_value(target_id) AS target_id, any_value(planner) AS planner,
        any_value(score) AS score, any_value(rank) AS rank
    FROM selections
    WHERE selection_id = only_selection(a)
    GROUP BY trajectory_id
),

kept_by_b AS (
    SELECT trajectory_id, any_value(target_id) AS target_id, any_value(planner) AS planner,
        any_value(score) AS score, any_value(rank) AS rank
    FROM selections
    WHERE selection_id = only_selection(b)
    GROUP BY trajectory_id
)

SELECT
    trajectory_id,
    coalesce(kept_by_a.target_id, kept_by_b.target_id) AS target_id,
    coalesce(kept_by_a.planner, kept_by_b.planner) AS planner,
    CASE
        WHEN kept_by_b.planner IS NULL THEN 'a'
        WHEN kept_by_a.planner IS NULL THEN 'b'
        ELSE 'both'
    END AS kept_by,
    kept_by_a.score AS score_a,
    kept_by_b.score AS score_b,
    kept_by_a.rank AS rank_a,
    kept_by_b.rank AS rank_b
FROM kept_by_a
FULL JOIN kept_by_b USING (trajectory_id);
