-- A stored metric computed again from the waypoints.
SELECT trajectory_id, joint_movement, joint_movement(q) AS from_waypoints
FROM trajectories
WHERE solved
LIMIT 20;
