"""The commands that make pictures: `plancurate show ...`."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from cyclopts import Parameter

from plancurate.errors import PlancurateError
from plancurate.flows.cli.console import console
from plancurate.flows.cli.network_options import NetworkOptions
from plancurate.flows.cli.options import HomeOptions
from plancurate.robots import DEFAULT_ROBOT, DEFAULT_SCENE, load_world
from plancurate.tasks.lake.store import Lake

if TYPE_CHECKING:
    from plancurate.tasks.pictures.shot import Shot

WIDTHS = (64, 4096)


@Parameter(name="*")
@dataclass(frozen=True, kw_only=True)
class PictureOptions:
    """Where the picture goes and how large it is."""

    out: Path | None = None
    """File: .png, .gif, .mp4 or .rrd (a Rerun recording) [default: a PNG or GIF in this folder]."""
    width: int = 640
    """Width in pixels; the height is three quarters of it."""

    def file(self, default: str) -> Path:
        """The file to write, before anything is done for it; PlancurateError for one that can't be written."""
        from plancurate.tasks.pictures.files import require_writable  # Pillow: no --help needs it

        if not WIDTHS[0] <= self.width <= WIDTHS[1]:
            raise PlancurateError(f"--width = {self.width}: {WIDTHS[0]} to {WIDTHS[1]} pixels would be right")
        file = self.out or Path(default)
        require_writable(file)
        return file

    def write(self, file: Path, *shots: Shot) -> None:
        """Write shots side by side and say where."""
        from plancurate.tasks.pictures.files import write_shots

        write_shots(file, shots, (self.width, self.width * 3 // 4))
        console.print(f"picture {file}", highlight=False, soft_wrap=True)


def scene(name: str, /, *, robot: str = DEFAULT_ROBOT, picture: PictureOptions = PictureOptions()) -> None:
    """Show a scene with the robot where it starts; a film goes around it.

    Args:
        name: Name of a scene, or a YAML file.
        robot: Name of a robot, or a folder.
    """
    world = load_world(robot, name)
    file = picture.file(f"{world[1].name}.png")
    from plancurate.tasks.pictures.shot import Shot

    picture.write(file, Shot(*world, title=f"{world[1].name}: {len(world[1].shapes)} obstacles"))


def robot(name: str, /, *, picture: PictureOptions = PictureOptions()) -> None:
    """Show a robot at home by its collision shapes; a film goes around it.

    Args:
        name: Name of a robot, or a folder.
    """
    world = load_world(name, DEFAULT_SCENE)
    file = picture.file(f"{world[0].name}.png")
    from plancurate.tasks.pictures.shot import Shot

    picture.write(file, Shot(*world, title=f"{world[0].name}: {world[0].dof} joints"))


def trajectory(
    motion: str,
    /,
    *,
    robot: str = DEFAULT_ROBOT,
    scene: str = DEFAULT_SCENE,
    picture: PictureOptions = PictureOptions(),
    options: HomeOptions = HomeOptions(),
) -> None:
    """Show a trajectory up to its end or its first collision.

    Args:
        motion: Identifier of the lake's trajectory, or a file that `verify` reads.
        robot: Robot of a file's motion.
        scene: Scene of a file's motion.
    """
    out = picture.file("trajectory.gif")
    from plancurate.tasks.motion.trajectory_files import FORMATS

    if Path(motion).suffix.lower() in FORMATS:
        shot = file_shot(Path(motion), robot, scene)
    else:
        from plancurate.tasks.pictures.lake_shots import trajectory_shot

        shot = trajectory_shot(Lake(options.folder().lake), motion)
    picture.write(out, shot)


def file_shot(file: Path, robot: str, scene: str) -> Shot:
    """The motion of a file; PlancurateError for one whose samples are no motion."""
    from plancurate.tasks.motion.samples import sample_violations
    from plancurate.tasks.motion.trajectory_files import read_motion
    from plancurate.tasks.pictures.shot import Shot, motion_run

    world, motion = load_world(robot, scene), read_motion(file)
    if wrong := sample_violations(world[0], motion):
        raise PlancurateError(f"{file}: {wrong[0].sentence}")
    return Shot(*world, (motion_run(*world, motion),), title=file.name)


def selection(
    selection_id: str,
    /,
    *,
    picture: PictureOptions = PictureOptions(),
    options: HomeOptions = HomeOptions(),
) -> None:
    """Show the tool paths of everything that a selection keeps.

    Args:
        selection_id: Identifier of a selection of the lake.
    """
    file = picture.file("selection.png")
    from plancurate.tasks.pictures.lake_shots import selection_rows, selection_shot

    rows = selection_rows(Lake(options.folder().lake), selection_id)
    picture.write(file, selection_shot(rows, *load_world(rows[0]["robot"], rows[0]["scene"])))


def ways(
    *,
    study: str,
    key: str | None = None,
    scene: str | None = None,
    target_id: int | None = None,
    picture: PictureOptions = PictureOptions(),
    options: HomeOptions = HomeOptions(),
) -> None:
    """Show in which ways the candidates of a study lead to a target, a colour each.

    Args:
        study: Name of the study.
        key: Key of an earlier study of that name.
        scene: The study's scene, where it has several.
        target_id: Number of the target [default: the one with most ways].
    """
    file = picture.file("ways.gif")
    from plancurate.tasks.pictures.lake_shots import ways_shot
    from plancurate.tasks.study.predictor import study_world
    from plancurate.tasks.study.studies import find_study

    lake = Lake(options.folder().lake)
    found = find_study(lake, study, key)
    world = study_world(lake, found, scene)
    picture.write(file, ways_shot(lake, found, world[1].name, target_id, world))


def rollout(
    *,
    network: NetworkOptions,
    target: tuple[float, float, float] | None = None,
    against: Annotated[str | None, Parameter(help="Selector whose policy is shown to the left.")] = None,
    picture: PictureOptions = PictureOptions(),
    options: HomeOptions = HomeOptions(),
) -> None:
    """Show a study's policy on its way to a target, and where it fails.

    Args:
        target: Position for the tool, m [default: a test that it reaches, and the policy to the left does not].
    """
    file = picture.file("rollout.gif")
    from plancurate.tasks.study.seen_rollouts import rollout_shots

    picture.write(file, *rollout_shots(options.folder(), network.choice(), target, against))
