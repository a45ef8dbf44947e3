-- What each selection of a study keeps: trajectories a target (targets without any count as 0), how many of
-- them differ, planners, goal configurations, the share that goes to the goal configuration of its target's
-- shortest candidate, and the share of their steps that is learnt from.
-- Grain: selector, budget.
-- $study: evaluations.study; $kind: 'displaced' or 'unseen' test targets.
WITH tested AS (
    SELECT DISTINCT robot, scene, pool, study, selection_id
    FROM evaluations
    WHERE study = $study AND kind = $kind
),

shortest AS (    -- goal configuration of each target's shortest candidate
    SELECT robot, scene, pool, target_id, arg_min(goal_index, joint_movement) AS shortest_goal
    FROM trajectories
    WHERE solved AND verified
    GROUP BY robot, scene, pool, target_id
),

kept AS (
    SELECT
        selections.*,
        paths.n_waypoints,
        selections.goal_index = shortest.shortest_goal AS shortest_way,
        (paths.target_id, paths.n_waypoints, paths.joint_movement, paths.smoothness) AS shape
    FROM selections
    INNER JOIN tested USING (robot, scene, pool, study, selection_id)
    INNER JOIN trajectories AS paths USING (robot, scene, pool, trajectory_id)
    INNER JOIN shortest
        ON
            shortest.robot = selections.robot
            AND shortest.scene = selections.scene
            AND shortest.pool = selections.pool
            AND shortest.target_id = selections.target_id
),

every_target AS (    -- a study's targets are numbered from 0
    SELECT DISTINCT selection_id, unnest(range(n_targets)) AS target_id FROM kept
),

per_target AS (
    SELECT every_target.selection_id, count(kept.trajectory_id) AS kept
    FROM every_target
    LEFT JOIN kept USING (selection_id, target_id)
    GROUP BY every_target.selection_id, every_target.target_id
),

spread AS (
    SELECT
        selection_id,
        min(kept) AS least,
        median(kept) AS median,
        max(kept) AS most,
        count_if(kept = 0) AS targets_without
    FROM per_target
    GROUP BY selection_id
)

SELECT
    kept.selector,
    kept.budget,
    count(*)::INTEGER AS kept,
    any_value(kept.n_pool) AS pool,
    any_value(kept.n_targets) AS targets,
    any_value(spread.targets_without)::INTEGER AS targets_without,
    any_value(spread.least)::INTEGER AS least_per_target,
    any_value(spread.median) AS median_per_target,
    any_value(spread.most)::INTEGER AS most_per_target,
    count(DISTINCT kept.shape)::INTEGER AS distinct_kept,
    count(DISTINCT kept.planner)::INTEGER AS planners,
    count(DISTINCT (kept.target_id, kept.goal_index))::INTEGER AS goal_configurations,
    avg(kept.shortest_way::INTEGER) AS shortest_way,
    (sum(coalesce(len(kept.steps), kept.n_waypoints)) / sum(kept.n_waypoints))::DOUBLE AS share_of_steps
FROM kept
INNER JOIN spread USING (selection_id)
GROUP BY kept.selector, kept.budget, kept.selection_id
ORDER BY kept.selector, kept.budget NULLS FIRST, kept.selection_id;
