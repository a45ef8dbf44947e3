"""The `plancurate` command line: names of commands here, their modules are imported when they are called."""

from __future__ import annotations

import sys
from collections.abc import Sequence

from cyclopts import App, CycloptsError

from plancurate import __version__
from plancurate.errors import IncompleteError, PlancurateError
from plancurate.flows.cli.console import console

USER_ERROR, INCOMPLETE, INTERRUPTED = 2, 1, 130

app = App(
    name="plancurate",
    version=__version__,
    help="Turn motion planners into imitation-learning data and see which of it is worth training on.",
)
for _name in ("study", "generate", "curate", "train", "evaluate", "compact"):
    app.command(f"plancurate.flows.cli.stages:{_name}", name=_name)
for _name in ("report", "sql"):
    app.command(f"plancurate.flows.cli.queries:{_name}", name=_name)
for _name in ("robots", "planners", "selectors", "policies"):
    app.command(f"plancurate.flows.cli.registered:{_name}", name=_name)
app.command("plancurate.flows.cli.compare:compare", name="compare")
app.command("plancurate.flows.cli.doctor:doctor", name="doctor")
app.command("plancurate.flows.cli.serve:serve", name="serve")


def main(argv: Sequence[str] | None = None) -> None:
    """Run the command line; a user's mistake ends it with one line and exit code 2."""
    try:
        app(argv, exit_on_error=False, print_error=False, console=console)
    except (CycloptsError, PlancurateError) as error:
        stop(str(error), USER_ERROR)
    except IncompleteError as error:
        stop(str(error), INCOMPLETE)
    except KeyboardInterrupt:
        stop("stopped; the same command goes on from here", INTERRUPTED)


def stop(message: str, code: int) -> None:
    """Say why in one line and exit."""
    console.print(f"[red]plancurate:[/] {' '.join(message.split())}", soft_wrap=True, highlight=False)
    sys.exit(code)


if __name__ == "__main__":
    main()
