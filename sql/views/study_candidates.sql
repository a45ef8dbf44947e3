-- What a study planned, in each of its pools: runs of its own planners for its own targets, failed ones
-- too, each with its way among them. Other studies may share the pool. For people: FROM
-- study_candidates('quick-0a1b2c3d').
CREATE OR REPLACE MACRO study_candidates(study_id) AS TABLE
SELECT studies.pool_label, trajectories.*, ways.way
FROM trajectories
INNER JOIN studies USING (robot, scene, pool)
LEFT JOIN ways
    ON
        trajectories.robot = ways.robot
        AND trajectories.scene = ways.scene
        AND trajectories.pool = ways.pool
        AND studies.labelling = ways.labelling
        AND trajectories.trajectory_id = ways.trajectory_id
WHERE
    studies.study = study_id
    AND trajectories.target_id < studies.n_targets
    AND list_contains(studies.planners, trajectories.planner);
