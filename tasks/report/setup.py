"""All that is needed to repeat a study: configuration, seeds, versions, pool, machine."""

from __future__ import annotations

import os
import platform
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any

from plancurate import __version__, native
from plancurate.tasks.report.source import Source

LIBRARIES = ("torch", "prefect", "mlflow", "duckdb", "pyarrow", "numpy", "scipy", "scikit-learn", "statsmodels",
             "pybullet", "toppra")  # fmt: skip


def setup(source: Source) -> dict[str, Any]:
    """What was done with what; only values that JSON has."""
    recorded = source.recorded
    times = source.rows("selection_times")
    return {
        "study": source.study,
        "command": "plancurate study --config config.yaml",
        "recorded_at": str(recorded.get("created_at", "")),
        "robot": recorded.get("robot", ""),
        "scene": recorded.get("scene", ""),
        "pool": recorded.get("pool", ""),
        "pool_hash": ", ".join(sorted({row["pool_hash"] for row in times})),
        "seeds": seeds(source.config),
        "seconds_of_work": seconds(source),
        "versions_of_the_study": {
            "plancurate": recorded.get("package_version", ""),
            "ompl": recorded.get("ompl_version", ""),
        },
        "versions_of_this_report": versions(),
        "machine_of_this_report": machine(),
        "configuration": source.config,
    }


def seeds(config: dict[str, Any]) -> dict[str, Any]:
    """Every seed of a configuration."""
    if not config:
        return {}
    return {
        "targets_and_planners": config["candidates"]["targets"]["seed"],
        "selectors": config["selection_seeds"],
        "training": config["seeds"],
        "tests": config["evaluation"]["seed"],
    }


def seconds(source: Source) -> dict[str, float]:
    """Seconds of work by stage, over all processes; empty where the study's configuration is not recorded."""
    config = source.config
    if not config:
        return {}
    query = source.query("seconds", planners=list(config["planners"]), n_targets=config["n_targets"])
    return {stage: round(found or 0.0, 3) for stage, found in query.rows(source.lake)[0].items()}


def versions() -> dict[str, str]:
    """Versions of the libraries that are installed now."""
    found = {"plancurate": __version__, "ompl": native.ompl_version(), "python": platform.python_version()}
    for name in LIBRARIES:
        try:
            found[name] = version(name)
        except PackageNotFoundError:
            found[name] = "not installed"
    return found


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
