"""Commands that run a stage of a study, or all of them."""

from __future__ import annotations

from contextlib import ExitStack
from functools import cache
from importlib import import_module
from typing import TYPE_CHECKING

from plancurate.errors import IncompleteError, PlancurateError
from plancurate.flows.cli.console import console
from plancurate.flows.cli.stopping import ends_on_sigterm
from plancurate.flows.cli.study_options import StudyOptions
from plancurate.flows.server.prefect_server import prefect_server
from plancurate.flows.server.server_loss import ends_with_server
from plancurate.flows.server.services import last_line
from plancurate.tasks.study.config import GrowBy

if TYPE_CHECKING:
    from collections.abc import Callable

    from plancurate.tasks.lake.home import Home
    from plancurate.tasks.study.config import StudyConfig
    from plancurate.tasks.study.context import StudyContext


def study(*, grow: int = 0, grow_by: GrowBy = "targets", options: StudyOptions = StudyOptions()) -> None:
    """Plan, curate, train, evaluate and report: the whole way, from where an earlier run stopped.

    Args:
        grow: Training targets, or runs, to add to what the study was last run to its end with.
        grow_by: What is added: training targets, or runs of each planner to a target.
    """
    config, home = options.study(), options.folder()
    if grow:
        from plancurate.tasks.study.growth import grown  # torch and SciPy: seconds, which no --help needs

        config = grown(config, home, grow, grow_by)
    done = run("study", config, home)
    from plancurate.flows.cli.verdict import show_results  # only now: SciPy would hold up the start

    show_results(done)


def generate(options: StudyOptions = StudyOptions()) -> None:
    """Fill the lake with candidates: plan, time, play back in PyBullet, store."""
    run("generate", options.study(), options.folder())


def curate(options: StudyOptions = StudyOptions()) -> None:
    """Select trajectories from the lake with every selector and budget."""
    run("curate", options.study(), options.folder())


def train(options: StudyOptions = StudyOptions()) -> None:
    """Train every policy on every selection."""
    run("train", options.study(), options.folder())


def refine(options: StudyOptions = StudyOptions()) -> None:
    """Correct every policy on its training targets, from where it gets to, and train it again: --corrections.rounds."""
    if not options.study().corrections.rounds:
        raise PlancurateError(
            "corrections.rounds = 0: nothing is corrected; --corrections.rounds 1 asks for a round"
        )
    run("refine", options.study(), options.folder())


def evaluate(options: StudyOptions = StudyOptions()) -> None:
    """Roll every trained policy out on the study's tests."""
    run("evaluate", options.study(), options.folder())


def compact(options: StudyOptions = StudyOptions()) -> None:
    """Merge the many small files of a study's pool into one a planner; queries get faster."""
    run("compact", options.study(), options.folder())


def run(name: str, config: StudyConfig, home: Home) -> StudyContext:
    """Run the flow of that name on a Prefect server: the configured one, or one of our own for the time of it."""
    module = f"plancurate.flows.{name}"

    @cache
    def opened() -> StudyContext:
        from plancurate.tasks.study.context import (
            open_study,  # torch and SciPy: seconds, which no --help needs
        )

        return open_study(config, home)

    def prepare() -> None:
        console.print(f"[bold]{name} {opened().study}[/]  [dim]{home.root}[/]", highlight=False)
        import_module(module)

    if not home.prefect.exists():
        opened()  # a robot or scene that can't be loaded is said before anything is started or written
    home.require_writable()
    with ExitStack() as stack:
        with console.status("starting Prefect's server"):
            url = stack.enter_context(prefect_server(home, meanwhile=prepare))
        stack.enter_context(ends_with_server(home, url))
        run_flow(getattr(import_module(module), name), config, home)
    return opened()


def run_flow(flow: Callable[..., object], config: StudyConfig, home: Home) -> None:
    """Run a flow; IncompleteError where Prefect's server refuses to record it, as it does on a full disk."""
    from prefect.exceptions import PrefectHTTPStatusError

    try:
        with ends_on_sigterm():
            flow(config, home=str(home.root))
    except PrefectHTTPStatusError as error:
        answer, log = error.response, home.prefect / "server.log"
        told = f"; {log}: {last_line(log)}" if log.exists() else ""  # a configured server keeps its own
        raise IncompleteError(
            f"Prefect's server could not record the run ({answer.request.url}: status {answer.status_code}{told}); "
            "what was finished is kept, and the same command goes on from here"
        ) from None
