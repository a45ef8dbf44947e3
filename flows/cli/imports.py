"""The command that brings others' joint trajectories in as candidates."""

from __future__ import annotations

import shlex
from pathlib import Path

from plancurate.flows.cli.console import console, output
from plancurate.flows.cli.study_options import StudyOptions


def import_(
    folder: Path,
    /,
    *,
    joints: str | None = None,
    dt: float | None = None,
    same_target: float = 1e-3,
    options: StudyOptions = StudyOptions(),
) -> None:
    """Bring a LeRobot or robomimic set of joint trajectories in as a source, checked and played back like any other.

    Args:
        folder: A LeRobotDataset v3.0, or robomimic's HDF5 or a folder with one.
        joints: The feature that holds the joint positions [default: observation.state; joint_positions or
            robot0_joint_pos].
        dt: Seconds from a frame to the next, where the set does not say.
        same_target: Episodes lead to one target when they end so near to each other, m; one that ends farther from the
            target that its frames tell is no candidate.
    """
    from plancurate.tasks.study.imported import import_set, reason  # h5py and the robot: no --help needs them

    config = options.study()
    if "name" not in options.fields:
        config = config.model_copy(update={"name": "imported"})
    with console.status("playing back"):
        imported = import_set(options.folder(), folder, config, joints, dt, same_target)
    rows = imported.rows
    console.print(
        f"recorded set {imported.set_id}: {imported.candidates} of {len(rows)} episodes to {imported.n_targets} "
        f"targets are candidates, robot {imported.pool.robot.name} in scene {imported.pool.scene.name}",
        highlight=False,
        soft_wrap=True,
    )
    if imported.candidates < len(rows):
        console.print(
            f"  the first that is none: {reason(rows)}", style="yellow", highlight=False, soft_wrap=True
        )
    if imported.elsewhere:
        console.print(
            f"  {imported.elsewhere} of them do not begin at the robot's home, and policies are tested from there",
            style="yellow",
            highlight=False,
            soft_wrap=True,
        )
    words = ["plancurate", "study", "--preset", options.preset, "--config", str(imported.study_file)]
    if options.home:
        words += ["--home", str(options.home)]
    output.print(shlex.join(words), highlight=False, soft_wrap=True)
