"""A candidate as a row of `trajectories`: what became of one run, whether it succeeded or not."""

from __future__ import annotations

from typing import Any

import numpy as np

from plancurate.tasks.candidates.postprocess import Postprocessed
from plancurate.tasks.candidates.sources import PlannedPath
from plancurate.tasks.candidates.targets import Target

Columns = dict[str, Any]


def candidate_row(target: Target, planned: PlannedPath, processed: Postprocessed | None) -> Columns:
    """Describe a run; `processed` is None without an exact solution. Columns that are missing are null."""
    x, y, z = target.position
    columns = {"target_id": target.target_id, "target_x": x, "target_y": y, "target_z": z}
    planning = planning_columns(planned) | goal_columns(target, planned)
    return columns | planning | processed_columns(planned.reason, processed)


def planning_columns(planned: PlannedPath) -> Columns:
    """Columns that planning decides."""
    return {
        "run": planned.run,
        "seed": planned.seed,
        "status": planned.status,
        "termination": planned.termination,
        "state_checks": planned.state_checks,
        "motion_checks": planned.motion_checks,
        "n_path_waypoints": len(planned.path),
        "plan_s": planned.seconds,
    }


def goal_columns(target: Target, planned: PlannedPath) -> Columns:
    """The goal configuration that the path ends at, and which of the target's goals is nearest to it.

    That is the very goal where a run is given the target's goals, and says what kind of goal it is where a run draws
    its own. -1 and null without an exact solution, -1 also for a target without goals.
    """
    if planned.status != "exact":
        return {"goal_index": -1, "goal": None}
    goal = planned.path[-1]
    distances = np.linalg.norm(target.goals - goal, axis=1)
    return {"goal_index": int(distances.argmin()) if len(distances) else -1, "goal": goal.tolist()}


def processed_columns(plan_reason: str, processed: Postprocessed | None) -> Columns:
    """Columns that timing, metrics and playback decide; the reason is that of the first stage that failed."""
    if processed is None or processed.metrics is None or processed.verification is None:
        return {
            "solved": False,
            "reason": processed.timed.reason if processed else plan_reason,
            "timing_method": "",
            "n_waypoints": 0,
            "q": [],
            "verified": False,
            "timing_s": processed.timing_s if processed else 0.0,
            "verify_s": 0.0,
        }
    verification = processed.verification
    return {
        "solved": True,
        "reason": "",
        "timing_method": processed.timed.method,
        "q": list(processed.timed.q.astype(np.float32)),
        **processed.metrics,
        "verified": verification.verified,
        "max_tracking_error_rad": verification.max_tracking_error_rad,
        "final_tracking_error_m": verification.final_tracking_error_m,
        "contacts": verification.contacts,
        "saturated_share": verification.saturated_share,
        "verify_reason": verification.reason,
        "timing_s": processed.timing_s,
        "verify_s": processed.verify_s,
    }
