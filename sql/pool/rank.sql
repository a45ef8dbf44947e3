-- The $budget candidates with the lowest key in each group, or all where it holds fewer; equal keys in the
-- order of tie, which is drawn: ids begin with the planner's name, and no planner is to win by the alphabet.
-- Grain: one kept candidate.
-- keyed: row (of the candidate), group_id, key, tie.
SELECT
    "row",
    row_number() OVER (PARTITION BY group_id ORDER BY key, tie)::INTEGER AS rank
FROM keyed
QUALIFY rank <= $budget
ORDER BY group_id, rank;
