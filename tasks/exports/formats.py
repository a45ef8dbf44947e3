"""The formats by name, and a folder that appears whole or not at all."""

from __future__ import annotations

import shutil
from collections.abc import Callable
from pathlib import Path

from plancurate.errors import PlancurateError
from plancurate.tasks.exports.episodes import Episodes
from plancurate.tasks.exports.lerobot import write_lerobot
from plancurate.tasks.exports.names import Format
from plancurate.tasks.exports.robomimic import require_h5py, write_robomimic
from plancurate.tasks.lake.parts import temporary_path

FORMATS: dict[Format, Callable[[Episodes, Path], None]] = {
    "robomimic": write_robomimic,
    "lerobot": write_lerobot,
}


def require_possible(to: Format, folder: Path) -> None:
    """Raise PlancurateError where the folder holds something, or the format needs a library that is missing."""
    if folder.is_file() or (folder.is_dir() and any(folder.iterdir())):
        raise PlancurateError(f"{folder}: there is something already; a new or empty folder would be right")
    if to == "robomimic":
        require_h5py()


def write_export(episodes: Episodes, to: Format, folder: Path) -> None:
    """Write the episodes into a new or empty folder; PlancurateError where it is neither."""
    require_possible(to, folder)
    folder.parent.mkdir(parents=True, exist_ok=True)
    temporary = temporary_path(folder)
    try:
        temporary.mkdir()
        FORMATS[to](episodes, temporary)
        temporary.rename(folder)
    finally:
        shutil.rmtree(temporary, ignore_errors=True)
