-- One row a waypoint of a solved trajectory, from step 0 on at t seconds; q holds a value a joint (rad, m).
CREATE OR REPLACE VIEW waypoints AS
SELECT
    robot,
    scene,
    pool,
    planner,
    trajectory_id,
    target_id,
    unnest(range(len(q)))::INTEGER AS step,
    unnest(range(len(q))) * dt AS t,
    unnest(q) AS q
FROM trajectories
WHERE solved;
