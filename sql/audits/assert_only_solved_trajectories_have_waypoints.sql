SELECT trajectory_id, solved, status, len(q) AS waypoints, joint_movement
FROM trajectories
WHERE
    solved <> (len(q) > 0)
    OR (solved AND status <> 'exact')
    OR solved <> (
        joint_movement IS NOT NULL
        AND smoothness IS NOT NULL
        AND path_length IS NOT NULL
        AND duration IS NOT NULL
        AND final_distance IS NOT NULL
        AND tool_x IS NOT NULL
    );
