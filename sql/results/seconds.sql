-- Seconds of work that a study took, by stage, over all processes. Grain: one row.
-- $study: evaluations.study; $kind: 'displaced' or 'unseen' test targets; $planners, $n_targets: of its
-- configuration.
WITH trials AS (
    SELECT * FROM evaluations WHERE study = $study AND kind = $kind
),

pools AS (
    SELECT DISTINCT robot, scene, pool FROM trials
),

planned AS (
    SELECT sum(plan_s) AS plan_s, sum(timing_s) AS timing_s, sum(verify_s) AS verify_s
    FROM trajectories
    INNER JOIN pools USING (robot, scene, pool)
    WHERE target_id < $n_targets AND planner IN (SELECT unnest($planners::VARCHAR[]))
),

selected AS (
    SELECT sum(selection_time_s) AS selection_s
    FROM (SELECT DISTINCT selection_id, selection_time_s FROM trials)
),

trained AS (
    SELECT sum(train_s) AS train_s
    FROM (SELECT DISTINCT evaluation_id, train_s FROM trials)
)

SELECT plan_s, timing_s, verify_s, selection_s, train_s
FROM planned, selected, trained;
