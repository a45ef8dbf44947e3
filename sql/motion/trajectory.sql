-- One trajectory by its id: where it was planned, and its samples.
-- $trajectory_id: trajectories.trajectory_id; an id names its pool, and so at most one row.
SELECT robot, scene, pool, solved, reason, dt, q
FROM trajectories
WHERE trajectory_id = $trajectory_id
