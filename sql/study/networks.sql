-- Networks that studies refer to: those evaluated, and those corrected or learning from corrections.
-- Grain: study, network.
SELECT DISTINCT
    study,
    regexp_replace(evaluation_id, '-[^-]*$', '') AS network_id    -- the rest says on which tests
FROM evaluations
UNION
SELECT DISTINCT
    studies.study,
    unnest([corrections.network_id, corrections.parent]) AS network_id
FROM corrections
INNER JOIN studies USING (robot, scene, pool);
