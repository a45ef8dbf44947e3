"""The command that verifies a motion."""

from __future__ import annotations

import sys
from dataclasses import dataclass
from json import dumps
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from cyclopts import Parameter
from pydantic import ValidationError

from plancurate.errors import PlancurateError, field_of, first_problem
from plancurate.flows.cli.console import console, write
from plancurate.flows.cli.options import HomeOptions
from plancurate.robots import DEFAULT_ROBOT, DEFAULT_SCENE, Robot, Scene, load_world
from plancurate.tasks.candidates.payload import Payload
from plancurate.tasks.lake.store import Lake

if TYPE_CHECKING:
    from plancurate.tasks.motion.motion import Motion

FAILED = 1
World = tuple[Robot, Scene]


@Parameter(name="*")
@dataclass(frozen=True, kw_only=True)
class RolloutOptions:
    """A rollout instead of a file: which network of a study, and where it is sent."""

    study: str | None = None
    """Name of a study: its policy's rollout to --target is verified, in its own robot and scene."""
    key: str | None = None
    """Key of an earlier study of that name."""
    selector: str | None = None
    """Selector that the policy learnt from [default: the study's best]."""
    policy: str | None = None
    """Policy [default: the selector's best]."""
    target: tuple[float, float, float] | None = None
    """Position for the tool, m."""

    def read(
        self, options: HomeOptions, robot: str | None, scene: str | None
    ) -> tuple[World, Motion, Payload | None]:
        """The rollout, timed, with its world and payload; PlancurateError for one that does not come near."""
        if self.target is None or robot is not None:
            raise PlancurateError("verify: --study needs --target X Y Z, and takes no --robot")
        from plancurate.tasks.motion.timed import rollout_motion
        from plancurate.tasks.study.predictor import Choice, study_policy

        choice = Choice(self.study or "", self.key, scene, self.selector, self.policy)
        chosen = study_policy(options.folder(), choice)
        world, settings = (chosen.robot, chosen.scene), chosen.settings
        position, candidates = np.array(self.target), settings.candidates
        evaluation, seed = settings.rollout, settings.seed
        motion = rollout_motion(chosen.trained, *world, position, candidates, evaluation, seed)
        return world, motion, candidates.verify.payload


def verify(
    file: Path | None = None,
    /,
    *,
    lake: str | None = None,
    rollout: RolloutOptions = RolloutOptions(),
    robot: str | None = None,
    scene: str | None = None,
    payload_mass: float | None = None,
    payload_centre: tuple[float, float, float] = (0.0, 0.0, 0.0),
    min_clearance: float = 0.0,
    json: bool = False,
    plot: Path | None = None,
    options: HomeOptions = HomeOptions(),
) -> None:
    """Say whether a robot may run a motion in a scene, and what is wrong first; exit code 0, or 1 where it may not.

    Args:
        file: The motion: .csv, .parquet, .npy, .npz, or ROS's JointTrajectory in .yaml or .json.
        lake: Identifier of a trajectory of the lake instead of a file.
        robot: Name of a robot, or a folder [default: the trajectory's own, else a study's default].
        scene: Name of a scene, or a YAML file [default: the trajectory's own, else free]; of a rollout the study's.
        payload_mass: Mass that the tool carries, kg.
        payload_centre: Its centre in the tool's frame, m.
        min_clearance: Distance that must be left to obstacles and floor, m.
        json: Print everything as JSON.
        plot: PNG file for a picture of the joints with what is wrong marked.
    """
    if [file, lake, rollout.study].count(None) != 2:
        raise PlancurateError(
            "verify: a file, --lake with a trajectory's identifier, or --study with --target is needed, one of them"
        )
    payload = payload_of(payload_mass, payload_centre)
    from plancurate.tasks.motion.settings import MotionSettings  # SciPy: no --help needs it
    from plancurate.tasks.motion.verify import verify_motion

    if rollout.study is not None:
        world, motion, carried = rollout.read(options, robot, scene)
        payload = payload or carried
    elif lake is not None:
        world, motion = lake_motion(options, lake, robot, scene)
    else:
        world, motion = file_motion(file or Path(), robot, scene)
    found = verify_motion(*world, motion, MotionSettings(min_clearance_m=min_clearance), payload)
    if plot:
        from plancurate.tasks.motion.plot import plot_motion

        plot_motion(plot, world[0], motion, found)
        console.print(f"picture {plot}", highlight=False, soft_wrap=True)
    write(dumps(found.as_record(), indent=1) if json else found.text)
    sys.exit(0 if found.passed else FAILED)


def file_motion(file: Path, robot: str | None, scene: str | None) -> tuple[World, Motion]:
    """The motion of a file in the world that is named, else a study's default."""
    from plancurate.tasks.motion.trajectory_files import read_motion

    return load_world(robot or DEFAULT_ROBOT, scene or DEFAULT_SCENE), read_motion(file)


def lake_motion(
    options: HomeOptions, trajectory_id: str, robot: str | None, scene: str | None
) -> tuple[World, Motion]:
    """A trajectory of the lake in the world that is named, else its own."""
    from plancurate.tasks.motion.lake_motions import stored_trajectory

    stored = stored_trajectory(Lake(options.folder().lake), trajectory_id)
    world = load_world(robot or stored.robot, scene or stored.scene)
    return world, stored.motion(world[0])


def payload_of(mass: float | None, centre: tuple[float, float, float]) -> Payload | None:
    """The payload that the options give; PlancurateError for one that can't be."""
    if mass is None:
        return None
    try:
        return Payload(mass_kg=mass, centre_m=centre)
    except ValidationError as error:
        option = "--payload-mass" if field_of(error) == "mass_kg" else "--payload-centre"
        raise PlancurateError(first_problem(option, error, Payload)) from None
