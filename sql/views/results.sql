-- One row a study, pool, kind of tests, selection's selector and budget, and policy: how many of its trials
-- succeeded after the study's last round of corrections, over selection seeds and training seeds.
CREATE OR REPLACE VIEW results AS
WITH last AS (
    SELECT study, max(round) AS round
    FROM evaluations
    GROUP BY study
),

counted AS (
    SELECT
        studies.name,
        studies.study_key,
        studies.pool_label,
        evaluations.study,
        evaluations.robot,
        evaluations.scene,
        evaluations.pool,
        evaluations.kind,
        evaluations.selector,
        evaluations.budget,
        evaluations.policy,
        evaluations.round,
        count(*)::INTEGER AS n,
        count_if(success)::INTEGER AS successes,
        count_if(settled)::INTEGER AS settled,
        median(final_distance) AS median_final_distance,
        avg(n_kept) AS n_kept
    FROM evaluations
    INNER JOIN last USING (study, round)
    INNER JOIN studies USING (study, robot, scene, pool)
    GROUP BY ALL
)

SELECT
    * EXCLUDE (settled, median_final_distance, n_kept),
    successes / n AS success_rate,
    wilson_low(successes, n) AS success_low,
    wilson_high(successes, n) AS success_high,
    settled / n AS settled_rate,
    median_final_distance,
    n_kept
FROM counted;
