"""Every query of the project, one .sql file each; values are bound as $parameters, never pasted."""

from __future__ import annotations

from functools import cache
from importlib.resources import files

from plancurate.errors import UnknownNameError

FOLDERS = ("views", "pool", "motion", "pictures", "study", "results", "audits", "examples")


@cache
def load(name: str) -> str:
    """The text of sql/<name>.sql, such as "results/by_policy"; UnknownNameError if there is none."""
    if name not in names():
        raise UnknownNameError("query", name, names())
    return files(__name__).joinpath(f"{name}.sql").read_text(encoding="utf-8")


@cache
def names(folder: str = "") -> tuple[str, ...]:
    """Names of all queries, or of those in one folder, sorted."""
    found = [
        f"{part}/{file.name.removesuffix('.sql')}"
        for part in FOLDERS
        for file in files(__name__).joinpath(part).iterdir()
        if file.name.endswith(".sql")
    ]
    return tuple(sorted(name for name in found if name.startswith(f"{folder}/" if folder else "")))
