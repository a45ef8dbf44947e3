"""The command that hands curated data to other trainers."""

from __future__ import annotations

from pathlib import Path

from plancurate.flows.cli.console import console
from plancurate.flows.cli.options import HomeOptions
from plancurate.tasks.exports.names import Format


def export(
    folder: Path,
    /,
    *,
    selection: list[str],
    to: Format,
    observation: tuple[str, ...] | None = None,
    options: HomeOptions = HomeOptions(),
) -> None:
    """Write a pool's episodes, those that selections keep marked, for robomimic or LeRobot.

    Args:
        folder: Where to; new or empty.
        selection: Id of a selection, or the beginning of one; may be given several times.
        to: robomimic writes one HDF5 file with a mask a selection, lerobot a LeRobotDataset v3.
        observation: Observation terms beside the joint angles [default: target_offset, and scene_parameters where there
            are obstacles].
    """
    from plancurate.tasks.exports.formats import (  # pandas and torch: no --help needs them
        require_possible,
        write_export,
    )
    from plancurate.tasks.study.exported import exported_episodes

    require_possible(to, folder)
    episodes = exported_episodes(options.folder(), selection, observation)
    write_export(episodes, to, folder)
    for marks in episodes.marks:
        console.print(
            f"{marks.name}: {len(marks.kept)} of {len(episodes.about)} episodes kept", highlight=False
        )
    console.print(f"{to} {folder}", highlight=False, soft_wrap=True)
