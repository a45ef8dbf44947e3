-- What became of each planner's runs in a study. Grain: scene, pool label, planner.
-- $study: studies.study.
SELECT
    scene,
    pool_label,
    planner,
    count(*)::INTEGER AS runs,
    count_if(solved)::INTEGER AS solved,
    count_if(solved AND verified)::INTEGER AS verified,
    count_if(status = 'approximate')::INTEGER AS approximate,
    count_if(status = 'exact' AND NOT solved)::INTEGER AS lost_in_timing,
    count_if(termination = 'seconds')::INTEGER AS cut_by_clock,     -- not repeatable elsewhere
    mode(reason) FILTER (NOT solved) AS commonest_reason,
    avg(plan_s) AS plan_s,
    avg(timing_s) AS timing_s,
    avg(verify_s) AS verify_s,
    avg(state_checks) AS state_checks,
    avg(joint_movement) AS joint_movement,       -- rad, solved runs
    avg(path_length) AS path_length,             -- m, solved runs
    avg(duration) AS duration                    -- s, solved runs
FROM study_candidates($study)
GROUP BY scene, pool_label, planner
ORDER BY scene, pool_label, planner;
