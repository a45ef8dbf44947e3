SELECT trajectory_id, status
FROM trajectories
WHERE verified AND NOT solved;
