"""Verify a motion in a file: a task for any flow."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from prefect import task
from prefect.cache_policies import NO_CACHE

from plancurate.robots import load_world
from plancurate.tasks.candidates.payload import Payload
from plancurate.tasks.motion.settings import MotionSettings
from plancurate.tasks.motion.trajectory_files import read_motion
from plancurate.tasks.motion.verify import verify_motion


@task(task_run_name="verify {file}", cache_policy=NO_CACHE, persist_result=False)
def verify(
    file: str, robot: str, scene: str, settings: MotionSettings, payload: Payload | None = None
) -> dict[str, Any]:
    """Verify a motion's file for a robot in a scene, each by name or path; gives the verdict as plain data."""
    world = load_world(robot, scene)
    return verify_motion(*world, read_motion(Path(file)), settings, payload).as_record()
