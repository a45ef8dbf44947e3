"""The home folder: where a study's data, records and services keep what they write."""

from __future__ import annotations

import os
import tempfile
from dataclasses import dataclass
from pathlib import Path

from plancurate.errors import PlancurateError


@dataclass(frozen=True)
class Home:
    """Paths under one home folder; nothing is created before somebody writes there."""

    root: Path

    @classmethod
    def resolve(cls, folder: str | Path | None = None) -> Home:
        """The folder asked for, else `PLANCURATE_HOME`, else `./data`, as an absolute path.

        PlancurateError for a user's folder (~name) that nobody has, and for links that lead in a circle.
        """
        chosen = folder or os.environ.get("PLANCURATE_HOME") or "data"
        try:
            return cls(Path(chosen).expanduser().resolve())
        except RuntimeError as error:
            raise PlancurateError(f"home folder {chosen}: {error}") from None

    def require_writable(self) -> None:
        """Make the folder; PlancurateError where it can't be made or nothing can be written into it."""
        try:
            self.root.mkdir(parents=True, exist_ok=True)
            with tempfile.TemporaryFile(dir=self.root):
                pass
        except OSError as error:
            raise PlancurateError(
                f"{self.root}: cannot be written: {error.strerror}; another folder with --home would be right"
            ) from None

    @property
    def lake(self) -> Path:
        """Parquet tables: the truth about what was planned, selected and evaluated."""
        return self.root / "lake"

    @property
    def mlflow_db(self) -> Path:
        """MLflow's SQLite database."""
        return self.root / "mlflow.db"

    @property
    def artifacts(self) -> Path:
        """Files of MLflow runs and models."""
        return self.root / "artifacts"

    @property
    def prefect(self) -> Path:
        """Prefect's database, locks and log files."""
        return self.root / "prefect"

    @property
    def models(self) -> Path:
        """Trained policies."""
        return self.root / "models"

    @property
    def reports(self) -> Path:
        """Tables and figures for people."""
        return self.root / "reports"

    @property
    def locks(self) -> Path:
        """Files that say which studies are being worked on."""
        return self.root / "locks"
