"""`plancurate doctor`: check the installation and say what is missing."""

from __future__ import annotations

import importlib
import os
import shutil
import sys
from collections.abc import Callable

from plancurate.errors import PlancurateError, shown
from plancurate.flows.cli.console import output
from plancurate.flows.cli.lake import check as check_lake
from plancurate.flows.cli.options import HomeOptions
from plancurate.flows.server.prefect_server import check_reachable, configured_url
from plancurate.tasks.lake.home import Home
from plancurate.tasks.study.mlflow_store import check_reachable as check_mlflow

MODULES = ("prefect", "mlflow", "duckdb", "pyarrow", "pybullet", "toppra", "torch", "sklearn")
FREE_GB = 2.0


def doctor(*, lake: bool = False, options: HomeOptions = HomeOptions()) -> None:
    """Check Python, the native core, the libraries, the home folder and configured servers.

    Parameters
    ----------
    lake
        Check what is in the home folder instead, as `plancurate lake check` does.
    """
    if lake:
        check_lake(options)
    else:
        check_installation(options.folder())


def check_installation(home: Home) -> None:
    """Print a line for each check; raises PlancurateError when one fails."""
    checks: list[tuple[str, Callable[[], str]]] = [
        ("python", python),
        ("native core", native_core),
        *((name, lambda name=name: library(name)) for name in MODULES),
        ("planning", planning),
        ("home folder", lambda: folder(home)),
        ("Prefect", prefect_api),
        ("MLflow", mlflow_store),
    ]
    problems = sum(not passes(name, check) for name, check in checks)
    if problems:
        raise PlancurateError(f"{problems} of {len(checks)} checks failed; see above what would be right")


def passes(name: str, check: Callable[[], str]) -> bool:
    """Run one check and print its line."""
    try:
        found = check()
    except Exception as error:  # whatever is broken is what a doctor reports
        output.print(f"[red]✗[/] {name:<12} {error}", highlight=False)
        return False
    output.print(f"[green]✓[/] {name:<12} {found}", highlight=False)
    return True


def python() -> str:
    """Version of Python."""
    return sys.version.split()[0]


def native_core() -> str:
    """Versions and counts of the compiled module."""
    try:
        native = importlib.import_module("plancurate.native")
    except ImportError as error:
        raise RuntimeError(
            f"{error}; install libompl-dev (conda: ompl, macOS: brew install ompl), then `make study` or "
            "`pip install .` again"
        ) from None
    return f"OMPL {native.ompl_version()}, {len(native.planners())} planners"


def library(name: str) -> str:
    """Version of a library."""
    module = importlib.import_module(name)
    return str(getattr(module, "__version__", "present"))


def planning() -> str:
    """Plan once, for real."""
    from plancurate.robots import DEFAULT_ROBOT, DEFAULT_SCENE, load_robot, load_scene
    from plancurate.tasks.candidates.plan import plan_candidate
    from plancurate.tasks.candidates.settings import GenerateSettings
    from plancurate.tasks.candidates.targets import sample_targets

    robot, scene = load_robot(DEFAULT_ROBOT), load_scene(DEFAULT_SCENE)
    target = sample_targets(robot, scene, GenerateSettings().targets, 0, 1)[0]
    result = plan_candidate(robot, scene, target, "RRTConnect", 0, GenerateSettings())
    if result.status != "exact":
        raise RuntimeError(f"RRTConnect found no path: {result.reason}")
    return f"RRTConnect solved {DEFAULT_ROBOT} in {1000 * result.seconds:.1f} ms"


def folder(home: Home) -> str:
    """Whether the home folder can be written and has room."""
    nearest = next(path for path in (home.root, *home.root.parents) if path.exists())
    if not os.access(nearest, os.W_OK):
        raise RuntimeError(f"{home.root}: {nearest} can't be written; choose another with --home")
    free = shutil.disk_usage(nearest).free / 1e9
    if free < FREE_GB:
        raise RuntimeError(f"{home.root}: {free:.1f} GB free, {FREE_GB:.0f} GB would be right")
    return f"{home.root}, {free:.0f} GB free"


def prefect_api() -> str:
    """Whether a configured Prefect API answers."""
    url = configured_url()
    if url is None:
        return "none configured: each command runs its own server on 127.0.0.1"
    check_reachable(url)
    return shown(url)


def mlflow_store() -> str:
    """Whether a configured MLflow server answers."""
    uri = os.environ.get("MLFLOW_TRACKING_URI")
    if uri is None:
        return "none configured: studies are recorded in the home folder"
    check_mlflow(uri)
    return shown(uri)
