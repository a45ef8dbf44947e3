-- Totals of a study over policies and seeds.
-- Grain: scene (and 'all scenes' of several), pool label, selector, budget.
-- $study: evaluations.study; $kind: test targets: 'displaced', 'unseen' or 'unseen_scene'.
WITH trials AS (
    SELECT * FROM scene_trials($study, $kind)
),

selected AS (
    SELECT DISTINCT scene, pool_label, selector, budget, pool, selection_id, selection_time_s, n_kept
    FROM trials
),

chosen AS (
    SELECT
        scene,
        pool_label,
        selector,
        budget,
        avg(selection_time_s) AS selection_time_s,
        avg(n_kept) AS n_kept
    FROM selected
    GROUP BY scene, pool_label, selector, budget
)

SELECT
    trials.scene,
    trials.pool_label,
    trials.selector,
    trials.budget,
    count(*)::INTEGER AS n,
    count_if(success)::INTEGER AS successes,
    count_if(settled)::INTEGER AS settled,
    count_if(hard)::INTEGER AS hard_n,           -- trials whose straight joint line is not free
    count_if(hard AND success)::INTEGER AS hard_successes,
    count(DISTINCT (trials.pool, trials.test_id))::INTEGER AS tests,
    count(motion_verdicts.passed)::INTEGER AS motions,  -- successes that were verified as motions
    count_if(motion_verdicts.passed)::INTEGER AS motions_passed,
    count(DISTINCT selection_seed)::INTEGER AS selection_seeds,
    count(DISTINCT seed)::INTEGER AS training_seeds,
    avg(final_distance) AS final_distance,       -- m
    avg(path_length) AS path_length,             -- m
    avg(joint_movement) AS joint_movement,       -- rad
    any_value(chosen.selection_time_s) AS selection_time_s,
    any_value(chosen.n_kept) AS n_kept
FROM trials
INNER JOIN chosen
    ON
        trials.scene = chosen.scene
        AND trials.pool_label = chosen.pool_label
        AND trials.selector = chosen.selector
        AND trials.budget IS NOT DISTINCT FROM chosen.budget
LEFT JOIN motion_verdicts USING (study, robot, pool, evaluation_id, kind, test_id)
GROUP BY trials.scene, trials.pool_label, trials.selector, trials.budget
ORDER BY trials.scene, trials.pool_label, successes / n DESC, trials.selector, trials.budget NULLS FIRST;
