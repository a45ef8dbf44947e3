"""A candidate as a row of `trajectories`: what became of one run, whether it succeeded or not."""

from __future__ import annotations

from typing import Any

import numpy as np

from plancurate.tasks.candidates.plan import PlannedPath
from plancurate.tasks.candidates.postprocess import Postprocessed
from plancurate.tasks.candidates.targets import Target

Columns = dict[str, Any]


def candidate_row(target: Target, planned: PlannedPath, finished: Postprocessed | None) -> Columns:
    """Describe a run; `finished` is None without an exact solution. Columns that are missing are null."""
    x, y, z = target.position
    columns = {"target_id": target.target_id, "target_x": x, "target_y": y, "target_z": z}
    return columns | planning_columns(planned) | finishing_columns(planned.result.reason, finished)


def planning_columns(planned: PlannedPath) -> Columns:
    """Columns that planning decides."""
    result = planned.result
    return {
        "run": planned.run,
        "seed": planned.seed,
        "status": result.status,
        "termination": result.termination,
        "state_checks": result.state_checks,
        "motion_checks": result.motion_checks,
        "goal_index": result.goal_index,
        "n_path_waypoints": len(result.path),
        "plan_s": result.seconds,
    }


def finishing_columns(plan_reason: str, finished: Postprocessed | None) -> Columns:
    """Columns that timing, metrics and playback decide; the reason is that of the first stage that failed."""
    if finished is None or finished.metrics is None or finished.verification is None:
        return {
            "solved": False,
            "reason": finished.timed.reason if finished else plan_reason,
            "timing_method": "",
            "n_waypoints": 0,
            "q": [],
            "verified": False,
            "timing_s": finished.timing_s if finished else 0.0,
            "verify_s": 0.0,
        }
    verification = finished.verification
    return {
        "solved": True,
        "reason": "",
        "timing_method": finished.timed.method,
        "q": list(finished.timed.q.astype(np.float32)),
        **finished.metrics,
        "verified": verification.verified,
        "max_tracking_error_rad": verification.max_tracking_error_rad,
        "final_tracking_error_m": verification.final_tracking_error_m,
        "contacts": verification.contacts,
        "saturated_share": verification.saturated_share,
        "verify_reason": verification.reason,
        "timing_s": finished.timing_s,
        "verify_s": finished.verify_s,
    }
