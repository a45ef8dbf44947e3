"""All that is needed to repeat a study: configuration, seeds, versions, pools, machine."""

from __future__ import annotations

import os
import platform
from collections.abc import Mapping
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any

from plancurate import __version__, native
from plancurate.tasks.study.comparison import flattened
from plancurate.tasks.study.results import StudyResults

LIBRARIES = ("torch", "prefect", "mlflow", "duckdb", "pyarrow", "numpy", "scipy", "scikit-learn", "pybullet",
             "toppra")  # fmt: skip


def setup(results: StudyResults) -> dict[str, Any]:
    """What was done with what; only values that JSON has."""
    study = results.study
    return {
        "study": study.study,
        "command": "plancurate study --config config.yaml",
        "run_at": str(study.run_at),
        "robot": study.robot,
        "pools": {f"{pool.scene} {pool.pool_label}".strip(): pool.pool for pool in study.pools},
        "pool_hash": ", ".join(results.pool_hashes),
        "seeds": seeds(study.config),
        "seconds_of_work": {stage: round(spent, 3) for stage, spent in results.seconds.items()},
        "versions_of_the_study": {"plancurate": study.package_version, "ompl": study.ompl_version},
        "versions_of_this_report": versions(),
        "machine_of_this_report": machine(),
        "configuration": dict(study.config),
    }


def seeds(config: Mapping[str, Any]) -> dict[str, Any]:
    """Every seed of a configuration, by its path in it."""
    return {path: value for path, value in flattened(config).items() if path.endswith(("seed", "seeds"))}


def versions() -> dict[str, str]:
    """Versions of the libraries that are installed now."""
    known = {"plancurate": __version__, "ompl": native.ompl_version(), "python": platform.python_version()}
    for name in LIBRARIES:
        try:
            known[name] = version(name)
        except PackageNotFoundError:
            known[name] = "not installed"
    return known


def machine() -> dict[str, Any]:
    """This machine's processor and system."""
    return {"cpu": cpu_model(), "cpus": os.cpu_count(), "platform": platform.platform()}


def cpu_model() -> str:
    """The processor's name, as far as the system tells it."""
    try:
        lines = Path("/proc/cpuinfo").read_text().splitlines()
    except OSError:
        lines = []
    names = (line.partition(":")[2].strip() for line in lines if line.startswith("model name"))
    return next(names, platform.processor() or platform.machine())
