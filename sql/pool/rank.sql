-- The $budget candidates with the lowest key in each group. Grain: one kept candidate.
-- keyed: row (of the candidate), group_id, key.
SELECT
    "row",
    row_number() OVER (PARTITION BY group_id ORDER BY key, trajectory_id)::INTEGER AS rank
FROM keyed
INNER JOIN candidates USING ("row")
QUALIFY rank <= $budget
ORDER BY group_id, rank;
