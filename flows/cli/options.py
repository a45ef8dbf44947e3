"""The option that every command has."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from cyclopts import Parameter

from plancurate.tasks.lake.home import Home


@Parameter(name="*")
@dataclass(frozen=True, kw_only=True)
class HomeOptions:
    """Where everything is kept."""

    home: Path | None = None
    """Folder of the lake, MLflow, Prefect and the reports [default: PLANCURATE_HOME, else ./data]."""

    def folder(self) -> Home:
        """Return the home folder's layout."""
        return Home.resolve(self.home)
