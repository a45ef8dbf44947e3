"""What the catalog says of its views, macros and columns to whoever opens it with a tool of his own."""

from __future__ import annotations

import re
from collections.abc import Iterator

import duckdb

from plancurate.sql import load

COLUMNS = {
    # What a row belongs to.
    "robot": "Robot, as its folder is called",
    "scene": "Scene, as its file is called",
    "pool": "Id of the pool: a hash of all that decides its candidates",
    "pool_label": "Variant of the candidates; empty where the study has a single one",
    "planner": "Planner or other source of the trajectory",
    "planners": "Sources of the study's candidates",
    "study": "The study's identifier: its name and key",
    "name": "The study's name",
    "study_key": "Hash of all that decides the study's results",
    "labelling": "Set of sources whose candidates were labelled beside each other",
    "kind": "Kind of the tests: displaced (from a training target), unseen, or unseen_scene (in another scene)",
    "config": "The study's configuration, JSON",
    "run_at": "When the study became the latest of its name, UTC",
    "package_version": "Version of plancurate",
    "ompl_version": "Version of OMPL",
    # Targets.
    "target_id": "Number of the training target; null for a test that belongs to none",
    "x": "Position of the target along the base's x axis, m",
    "y": "Position of the target along the base's y axis, m",
    "z": "Position of the target along the base's z axis, m",
    "goals": "Collision-free goal configurations that reach the target, joints each, rad (m for a sliding joint)",
    "goal": "Goal configuration that the path ends at, joints, rad (m for a sliding joint)",
    "goal_index": "Number of the goal configuration that the path ends at; -1 where it ends at none",
    "target_x": "Position of the target along the base's x axis, m",
    "target_y": "Position of the target along the base's y axis, m",
    "target_z": "Position of the target along the base's z axis, m",
    "n_targets": "Number of training targets",
    # Trajectories.
    "trajectory_id": "The trajectory's name: target, planner, run and pool",
    "run": "Number of the planner's run to the target",
    "seed": "Seed of the randomness: of the planner's run, of the selection, or of the training",
    "status": "How planning ended, as OMPL says it: exact, approximate, ...",
    "reason": "Why the run gave no trajectory; empty for a solved one",
    "verify_reason": "Why the playback in PyBullet was not accepted; empty for a verified one",
    "failure_reason": "Why it is of no use: planning, timing or playback of a run, the rule that a rollout broke; "
    "null where nothing failed",
    "solved": "Whether the run gave a timed, collision-free trajectory",
    "verified": "Whether the playback in PyBullet was accepted",
    "termination": "What ended planning: solved, or which limit",
    "state_checks": "States that planning checked for collision",
    "motion_checks": "Motions between states that planning checked for collision",
    "n_path_waypoints": "Waypoints of the path before it was timed",
    "timing_method": "How the path was given its times; empty for an unsolved run",
    "n_waypoints": "Waypoints of the trajectory",
    "plan_s": "Time that planning took, s",
    "timing_s": "Time that simplifying and timing took, s",
    "verify_s": "Time that the playback took, s",
    "dt": "Time from a waypoint to the next, s",
    "q": "Waypoints, joint angles each, rad (m for a sliding joint); null or empty where there are none of its own",
    "waypoints.q": "Joint angles, rad (m for a sliding joint)",
    "step": "Number of the waypoint, from 0 on",
    "corrections.step": "Number of the move after which the parent was in the path's first state",
    "t": "Time since the first waypoint, s",
    "tool_x": "Final position of the tool along the base's x axis, m",
    "tool_y": "Final position of the tool along the base's y axis, m",
    "tool_z": "Final position of the tool along the base's z axis, m",
    "joint_movement": "Sum over steps and joints of the absolute joint differences, rad (m for a sliding joint)",
    "smoothness": "Sum over steps of the norm of the tool's acceleration, m/s^2; less is smoother",
    "path_length": "Length of the tool's path, m",
    "duration": "Time from the first waypoint to the last one, s",
    "final_distance": "Distance of the tool from the target at the end, m",
    "max_tracking_error_rad": "Largest joint error during the playback, rad (m for a sliding joint)",
    "final_tracking_error_m": "Distance between the tool's planned and played back end, m",
    "contacts": "Contacts during the playback",
    "saturated_share": "Share of joints and steps of the playback that were at the effort limit, 0 to 1",
    "min_clearance": "Smallest distance of the robot from obstacles on the way, m; null where there are none",
    "way": "How the trajectory leads to the target: class of goal configurations and class of paths, such as g0.p1",
    # Selections.
    "selection_id": "The selection's name: selector, budget, seed and a hash of all that decides it",
    "selector": "The selector, with the parameters that it was given",
    "budget": "Trajectories to keep a target; null for a selector that has no budget",
    "pool_hash": "Hash of the candidates that were selected from",
    "params": "The selector's parameters, JSON",
    "n_pool": "Distinct candidates that were selected from",
    "n_kept": "Trajectories that were kept",
    "cluster": "Cluster of the trajectory; null where the selector makes none",
    "score": "Score of the trajectory as its selector counts it; null where it gives none",
    "rank": "Place of the trajectory among those kept of its group, from 1 on; null where the selector ranks none",
    "steps": "Waypoints at which a training window may begin; null for all",
    "evaluations.steps": "Moves of the trial until it ended",
    "weight": "How often windows of the trajectory are drawn, in proportion; null for all alike",
    "prepare_s": "Time to prepare the selection, s",
    "base_policy_s": "Time to train a policy that the selector needs, s",
    "rollouts_s": "Time to roll that policy out, s",
    "cluster_s": "Time to cluster, s",
    "score_s": "Time to score, s",
    "select_s": "Time to choose, s",
    "selection_time_s": "Time from the loaded candidates to the list of what is kept, s",
    "split_half": "How far two halves of the rollouts that its scores are estimated from rank candidates alike: "
    "Spearman's correlation, 1 for the same order and 0 for none in common",
    # Corrections.
    "correction_id": "The correction's name",
    "network_id": "Network that learns from the correction",
    "parent": "Network of the round before, which came to the path's first state",
    "round": "Number of rounds of corrections that the network has had",
    "failure": "How it failed: collided, limits or lost; empty where it did not",
    "failure_detail": "What it collided with first, or which limit it broke; empty where there is no more to say",
    # Tests.
    "evaluation_id": "The evaluated network's name",
    "selection_seed": "Seed of the selection that the network was trained on",
    "policy": "Kind of the policy",
    "train_s": "Time that training took, s",
    "test_id": "Number of the test, the same for every policy of a study's pool",
    "hard": "Whether the straight joint line to the nearest goal configuration is not free",
    "success": "Whether the tool came within reach of the target with no rule broken before; of Planner and Replay, "
    "whether it stayed there",
    "settled": "Whether the tool is within reach of the target at the step limit, with no rule broken on the way",
    "precise": "Whether the tool is within the finer tolerance at the step limit, with no rule broken on the way",
    "reached": "Whether the tool came within reach of the target",
    "collided": "Whether a collision ended the trial",
    "out_of_limits": "Whether a joint's limit, broken, ended the trial",
    "settled_distance": "Distance of the tool from the target at the step limit, m",
    "distance_cm": "How far the test is displaced from its training target, cm; null for an unseen one",
    "reference": "What no policy did: Planner, Replay or StraightLine",
    # Motions.
    "passed": "Whether the motion verifier let the rollout, timed, pass",
    "failed_check": "The first check that it failed: one of the verifier's, rollout or timing; empty where it passed",
    "motion_verdicts.reason": "What is wrong first; empty where it passed",
    "motion_verdicts.duration": "Time that the motion takes, s; null for a path that could not be timed",
    # Results.
    "n": "Trials",
    "successes": "Trials that succeeded",
    "success_rate": "Share of the trials that succeeded, 0 to 1",
    "success_low": "Lower end of Wilson's 95 % interval of the success rate; trials counted as independent",
    "success_high": "Upper end of Wilson's 95 % interval of the success rate; trials counted as independent",
    "settled_rate": "Share of the trials that are settled, 0 to 1",
    "median_final_distance": "Median distance of the tool from the target at the end, m",
}  # fmt: skip
"""Of columns by name, or by view and name where that view means something else by it."""


def comment(connection: duckdb.DuckDBPyConnection) -> None:
    """Comment everything in the connection's current database; KeyError for a column that nothing is said of."""
    connection.execute("BEGIN")  # one write to the disk instead of one a comment
    for statement in list(_statements(connection)):
        connection.execute(statement)
    connection.execute("COMMIT")


def _statements(connection: duckdb.DuckDBPyConnection) -> Iterator[str]:
    here = "database_name = current_database()"
    for view, column in connection.execute(
        f"SELECT table_name, column_name FROM duckdb_columns() WHERE {here} ORDER BY ALL"
    ).fetchall():
        said = COLUMNS.get(f"{view}.{column}") or COLUMNS[column]
        yield f'COMMENT ON COLUMN {view}."{column}" IS {quoted(said)}'
    for (view,) in connection.execute(f"SELECT view_name FROM duckdb_views() WHERE {here}").fetchall():
        yield f"COMMENT ON VIEW {view} IS {quoted(first_sentence(load(f'views/{view}')))}"


def first_sentence(query: str) -> str:
    """What a query's opening comment says first: the view's one line."""
    lines = re.match(r"(?:--.*\n)+", query)
    text = " ".join(line.removeprefix("--").strip() for line in (lines[0] if lines else "").splitlines())
    return re.split(r"(?<=\.) ", text, maxsplit=1)[0].rstrip(".")


def quoted(text: str) -> str:
    """The text as a literal of SQL."""
    return "'" + text.replace("'", "''") + "'"
