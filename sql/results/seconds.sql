-- Seconds of work that a study's results took, by stage, over all processes. Grain: one row.
-- $study: studies.study.
WITH planned AS (
    SELECT sum(plan_s) AS plan_s, sum(timing_s) AS timing_s, sum(verify_s) AS verify_s
    FROM study_candidates($study)
),

selected AS (
    SELECT sum(selection_time_s) AS selection_s
    FROM (
        SELECT DISTINCT robot, scene, pool, selection_id, selection_time_s
        FROM selections
        WHERE study = $study
    )
),

trained AS (
    SELECT sum(train_s) AS train_s
    FROM (
        SELECT DISTINCT robot, scene, pool, evaluation_id, train_s
        FROM evaluations
        WHERE study = $study
    )
)

SELECT plan_s, timing_s, verify_s, selection_s, train_s
FROM planned, selected, trained;
