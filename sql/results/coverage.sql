-- What the selections of a study keep, on average over their selection seeds: trajectories a target (targets
-- without any count as 0), how many of them differ, planners, goal configurations, the share that goes to the
-- goal configuration of its target's shortest candidate, and the share of their steps that is learnt from.
-- Grain: scene, pool label, selector, budget.
-- $study: selections.study.
WITH candidates AS (
    SELECT * FROM study_candidates($study) WHERE solved AND verified
),

shortest AS (    -- goal configuration of each target's shortest candidate
    SELECT scene, pool, target_id, arg_min(goal_index, joint_movement) AS shortest_goal
    FROM candidates
    GROUP BY scene, pool, target_id
),

kept AS (
    SELECT
        selections.*,
        paths.pool_label,
        paths.n_waypoints,
        selections.goal_index = shortest.shortest_goal AS shortest_way,
        (paths.target_id, paths.n_waypoints, paths.joint_movement, paths.smoothness) AS shape
    FROM selections
    INNER JOIN candidates AS paths USING (scene, pool, trajectory_id)
    INNER JOIN shortest
        ON
            selections.scene = shortest.scene
            AND selections.pool = shortest.pool
            AND selections.target_id = shortest.target_id
    WHERE selections.study = $study
),

every_target AS (    -- a study's targets are numbered from 0
    SELECT DISTINCT scene, pool, selection_id, unnest(range(n_targets)) AS target_id FROM kept
),

per_target AS (
    SELECT
        every_target.scene,
        every_target.pool,
        every_target.selection_id,
        count(kept.trajectory_id) AS kept
    FROM every_target
    LEFT JOIN kept USING (scene, pool, selection_id, target_id)
    GROUP BY every_target.scene, every_target.pool, every_target.selection_id, every_target.target_id
),

spread AS (
    SELECT
        scene,
        pool,
        selection_id,
        min(kept) AS least,
        median(kept) AS median,
        max(kept) AS most,
        count_if(kept = 0) AS targets_without
    FROM per_target
    GROUP BY scene, pool, selection_id
),

by_selection AS (
    SELECT
        kept.scene,
        kept.pool_label,
        kept.selector,
        kept.budget,
        count(*) AS kept,
        any_value(kept.n_pool) AS pool,
        any_value(kept.n_targets) AS targets,
        any_value(spread.targets_without) AS targets_without,
        any_value(spread.least) AS least,
        any_value(spread.median) AS median,
        any_value(spread.most) AS most,
        count(DISTINCT kept.shape) AS distinct_kept,
        count(DISTINCT kept.planner) AS planners,
        count(DISTINCT (kept.target_id, kept.goal_index)) AS goal_configurations,
        avg(kept.shortest_way::INTEGER) AS shortest_way,
        sum(coalesce(len(kept.steps), kept.n_waypoints)) / sum(kept.n_waypoints) AS share_of_steps
    FROM kept
    INNER JOIN spread USING (scene, pool, selection_id)
    GROUP BY kept.scene, kept.pool_label, kept.selector, kept.budget, kept.selection_id
)

SELECT
    scene,
    pool_label,
    selector,
    budget,
    count(*)::INTEGER AS selections,
    avg(kept) AS kept,
    any_value(pool)::INTEGER AS pool,                       -- candidates to select from
    any_value(targets)::INTEGER AS targets,
    avg(targets_without) AS targets_without,
    min(least)::INTEGER AS least_per_target,
    avg(median) AS median_per_target,
    max(most)::INTEGER AS most_per_target,
    avg(distinct_kept) AS distinct_kept,
    avg(planners) AS planners,
    avg(goal_configurations) AS goal_configurations,
    avg(shortest_way) AS shortest_way,
    avg(share_of_steps)::DOUBLE AS share_of_steps
FROM by_selection
GROUP BY scene, pool_label, selector, budget
ORDER BY scene, pool_label, selector, budget NULLS FIRST;
