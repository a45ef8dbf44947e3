-- Trials of a study on one kind of test after its last round of corrections, and once more under the scene
-- 'all scenes' those of every selection that was tested in each of several scenes.
-- tests: 'displaced', 'unseen' or 'unseen_scene'.
CREATE OR REPLACE MACRO scene_trials(study_id, tests) AS TABLE
WITH trials AS (
    SELECT * FROM final_trials(study_id, tests)
),

scenes AS (
    SELECT pool_label, count(DISTINCT scene) AS n_scenes
    FROM trials
    GROUP BY pool_label
),

complete AS (    -- selections that no scene lacks
    SELECT pool_label, selector, budget
    FROM trials
    INNER JOIN scenes USING (pool_label)
    GROUP BY pool_label, selector, budget, n_scenes
    HAVING n_scenes > 1 AND count(DISTINCT scene) = n_scenes
)

SELECT * FROM trials
UNION ALL BY NAME
SELECT 'all scenes' AS scene, trials.* EXCLUDE (scene)
FROM trials
INNER JOIN complete
    ON
        trials.pool_label = complete.pool_label
        AND trials.selector = complete.selector
        AND trials.budget IS NOT DISTINCT FROM complete.budget;
