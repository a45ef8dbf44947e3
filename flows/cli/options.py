"""Options that the commands share."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

from cyclopts import Parameter

from plancurate.tasks.lake.home import Home
from plancurate.tasks.study.config import StudyConfig, load_config

Names = Annotated[tuple[str, ...] | None, Parameter(consume_multiple=True, negative="")]
Numbers = Annotated[tuple[int, ...] | None, Parameter(consume_multiple=True, negative="")]


@Parameter(name="*")
@dataclass(frozen=True, kw_only=True)
class HomeOptions:
    """Where everything is kept."""

    home: Path | None = None
    """Folder of the lake, MLflow, Prefect and the reports [default: PLANCURATE_HOME, else ./data]."""

    def folder(self) -> Home:
        """Return the home folder's layout."""
        return Home.resolve(self.home)


@Parameter(name="*")
@dataclass(frozen=True, kw_only=True)
class StudyOptions(HomeOptions):
    """What to study: a preset, then a file, then single options, each over the one before."""

    preset: str = "quick"
    """smoke (a minute), quick (some minutes) or paper (the publication's size)."""
    config: Path | None = None
    """YAML file with fields that differ from the preset."""
    name: str | None = None
    """Name of the study; the preset's by default."""
    robot: str | None = None
    """A registered robot, or a folder with robot.yaml and a URDF."""
    scenes: Names = None
    """A registered scene, or a YAML file."""
    targets: int | None = None
    """Number of training targets."""
    planners: Names = None
    """OMPL planners by class name."""
    selectors: Names = None
    """Selectors to compare."""
    budgets: Numbers = None
    """Trajectories kept for each target."""
    policies: Names = None
    """Policies to train."""
    seeds: Numbers = None
    """Training seeds."""
    workers: int | None = None
    """Planning tasks in flight at once."""
    targets_per_task: int | None = None
    """Targets in one planning task; more than 1 helps with thousands of targets."""

    def study(self) -> StudyConfig:
        """Build the configuration; raises PlancurateError naming the field that is wrong."""
        overrides = {
            "name": self.name,
            "robot": self.robot,
            "scenes": self.scenes,
            "n_targets": self.targets,
            "planners": self.planners,
            "selectors": self.selectors,
            "budgets": self.budgets,
            "policies": self.policies,
            "seeds": self.seeds,
            "workers": self.workers,
            "targets_per_task": self.targets_per_task,
        }
        given = {name: value for name, value in overrides.items() if value is not None}
        return load_config(self.preset, self.config, given)
