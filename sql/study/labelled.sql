-- Targets of a pool whose candidates have their ways in a labelling. Grain: one target.
SELECT DISTINCT target_id
FROM ways
WHERE robot = $robot AND scene = $scene AND pool = $pool AND labelling = $labelling;
