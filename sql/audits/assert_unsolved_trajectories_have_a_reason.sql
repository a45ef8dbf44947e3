SELECT trajectory_id, status, termination
FROM trajectories
WHERE NOT solved AND reason = '';
