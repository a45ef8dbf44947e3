-- A trial of a study that succeeded and one that failed, of one test where there is such: rather a test that
-- a network on the selection asked for reaches and one on the other selector's does not, rather with a
-- collision, rather a hard one. Grain: one trial, at most one of each outcome.
-- $study, $kind: of tests; $scene, $pool_label: of the pool; $selector, $budget: whose success is shown;
-- $against: the selector whose failure is shown.
WITH trials AS (
    SELECT
        *,
        selector = $selector AND budget IS NOT DISTINCT FROM $budget AS own,
        selector = $against AS other
    FROM final_trials($study, $kind)
    WHERE scene = $scene AND pool_label = $pool_label
),

tests AS (
    SELECT
        test_id,
        bool_or(success) AND bool_or(NOT success) AS mixed,
        bool_or(success AND own) AND bool_or(NOT success AND other) AS telling,
        bool_or(collided AND other) AS touching
    FROM trials
    GROUP BY test_id
)

SELECT DISTINCT ON (trials.success)
    trials.success,
    trials.selector,
    trials.budget,
    trials.selection_seed,
    trials.policy,
    trials.seed,
    trials.round,
    trials.kind,
    trials.test_id,
    trials.target_id,
    trials.x,
    trials.y,
    trials.z
FROM trials
INNER JOIN tests USING (test_id)
ORDER BY
    trials.success DESC,
    tests.telling DESC,
    tests.mixed DESC,
    tests.touching AND tests.telling DESC,
    trials.hard DESC NULLS LAST,
    trials.test_id,
    CASE WHEN trials.success THEN trials.own ELSE trials.other END DESC,
    trials.collided DESC,
    trials.policy,
    trials.budget DESC,
    trials.selector,
    trials.selection_seed,
    trials.seed;
