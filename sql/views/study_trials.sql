-- Trials of a study with the label of their pool. For people: FROM study_trials('quick-0a1b2c3d').
CREATE OR REPLACE MACRO study_trials(study_id) AS TABLE
SELECT studies.pool_label, evaluations.*
FROM evaluations
INNER JOIN studies USING (study, robot, scene, pool)
WHERE evaluations.study = study_id;
