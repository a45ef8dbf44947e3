-- Trials of a study on one kind of test after its last round of corrections.
-- tests: 'displaced', 'unseen' or 'unseen_scene'.
CREATE OR REPLACE MACRO final_trials(study_id, tests) AS TABLE
SELECT *
FROM study_trials(study_id)
WHERE kind = tests AND round = (SELECT max(round) FROM evaluations WHERE study = study_id);
