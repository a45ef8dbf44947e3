"""The command that verifies a motion."""

from __future__ import annotations

import sys
from json import dumps
from pathlib import Path

from pydantic import ValidationError

from plancurate.errors import PlancurateError, field_of, first_problem
from plancurate.flows.cli.console import console, write
from plancurate.flows.cli.options import HomeOptions
from plancurate.robots import DEFAULT_ROBOT, DEFAULT_SCENE, load_world
from plancurate.tasks.candidates.payload import Payload
from plancurate.tasks.lake.store import Lake

FAILED = 1


def verify(
    file: Path | None = None,
    /,
    *,
    lake: str | None = None,
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
        scene: Name of a scene, or a YAML file [default: the trajectory's own, else free].
        payload_mass: Mass that the tool carries, kg.
        payload_centre: Its centre in the tool's frame, m.
        min_clearance: Distance that must be left to obstacles and floor, m.
        json: Print everything as JSON.
        plot: PNG file for a picture of the joints with what is wrong marked.
    """
    if (file is None) == (lake is None):
        raise PlancurateError("verify: a file or --lake with a trajectory's identifier is needed, not both")
    payload = payload_of(payload_mass, payload_centre)
    from plancurate.tasks.motion.lake_motions import stored_trajectory  # SciPy: no --help needs it
    from plancurate.tasks.motion.settings import MotionSettings
    from plancurate.tasks.motion.trajectory_files import read_motion
    from plancurate.tasks.motion.verify import verify_motion

    stored = stored_trajectory(Lake(options.folder().lake), lake) if lake else None
    world = load_world(
        robot or (stored.robot if stored else DEFAULT_ROBOT),
        scene or (stored.scene if stored else DEFAULT_SCENE),
    )
    motion = stored.motion(world[0]) if stored else read_motion(file or Path())
    found = verify_motion(*world, motion, MotionSettings(min_clearance_m=min_clearance), payload)
    if plot:
        from plancurate.tasks.motion.plot import plot_motion

        plot_motion(plot, world[0], motion, found)
        console.print(f"picture {plot}", highlight=False, soft_wrap=True)
    write(dumps(found.as_record(), indent=1) if json else found.text)
    sys.exit(0 if found.passed else FAILED)


def payload_of(mass: float | None, centre: tuple[float, float, float]) -> Payload | None:
    """The payload that the options give; PlancurateError for one that can't be."""
    if mass is None:
        return None
    try:
        return Payload(mass_kg=mass, centre_m=centre)
    except ValidationError as error:
        option = "--payload-mass" if field_of(error) == "mass_kg" else "--payload-centre"
        raise PlancurateError(first_problem(option, error, Payload)) from None
