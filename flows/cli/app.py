"""The `plancurate` command line: names of commands here, their modules are imported when they are called."""

from __future__ import annotations

import ast
import errno
import json
import os
import sys
from collections.abc import Sequence
from functools import cache
from itertools import count
from pathlib import Path

from cyclopts import App, CycloptsError, Group, Parameter

from plancurate import __version__
from plancurate.errors import IncompleteError, PlancurateError, shortened
from plancurate.flows.cli.console import complain, output
from plancurate.flows.cli.stopping import INTERRUPTED, ends_on_ctrl_c
from plancurate.yaml_files import parse_yaml

USER_ERROR, INCOMPLETE = 2, 1
# What a disk refuses, a user can mend.
FULL = {errno.ENOSPC, errno.EDQUOT, errno.EFBIG}
REFUSALS = {
    errno.EACCES, errno.EPERM, errno.EROFS, errno.ENOTDIR, errno.EISDIR, errno.EEXIST,
    errno.ENAMETOOLONG,
}  # fmt: skip
# Panels of the help; each command's module and function, in the order in which a person meets them.
COMMANDS = {
    "Run a study": [
        "stages:study", "stages:generate", "stages:curate", "stages:train", "stages:refine",
        "stages:evaluate",
    ],
    "Move": ["predict:predict", "verify:verify"],
    "See what came out": ["report:report", "compare:compare", "show", "sql:sql", "serve:serve"],
    "From others and to others": ["imports:import_", "export:export"],
    "See what there is": [
        "fields:fields", "robots", "scenes", "lake", "planning:planners", "registered:selectors",
        "registered:policies", "doctor:doctor",
    ],
}  # fmt: skip

# Commands with commands of their own, named above without a module.
FAMILIES = {
    "show": (
        "Make pictures, films and recordings: show scene NAME, show rollout --study NAME.",
        ["show:scene", "show:robot", "show:trajectory", "show:selection", "show:ways", "show:rollout"],
    ),
    "robots": (
        "List robots and scenes, add a robot from a URDF, check one.",
        ["robots:list", "robots:add", "robots:check"],
    ),
    "scenes": ("Look into scenes before a study: scenes check NAME.", ["scenes:check"]),
    "lake": (
        "Look after the lake: lake status, check, compact, gc.",
        ["lake:status", "lake:check", "stages:compact", "lake:gc"],
    ),
}


@cache
def functions(module: str) -> dict[str, str]:
    """Docstrings of a module's functions by name, read without importing it: that would take seconds."""
    tree = ast.parse(Path(__file__).with_name(f"{module}.py").read_text(encoding="utf-8"))
    return {
        node.name: ast.get_docstring(node) or "" for node in tree.body if isinstance(node, ast.FunctionDef)
    }


def build() -> App:
    """Return the command line, with every command described and none imported."""
    app = App(
        name="plancurate",
        version=__version__,
        help="Turn motion planners into imitation-learning data and see which of it is worth training on.",
        help_format="plaintext",  # as it is written, and without the import of a Markdown parser
        default_parameter=Parameter(
            negative_iterable=()
        ),  # no --empty-... for what is left out where it is not meant
    )
    place = count()
    for title, commands in COMMANDS.items():
        group = Group(title, sort_key=next(place))
        for command in commands:
            add(app, command, next(place), group)
    return app


def add(app: App, command: str, place: int, group: Group | None = None) -> None:
    """Add a command, by its module and function or as a family of commands, to an app or to a family."""
    if command in FAMILIES:
        help, members = FAMILIES[command]
        family = App(
            name=command, help=help, help_format="plaintext", version_flags=[], group=group, sort_key=place
        )
        for number, member in enumerate(members):
            add(family, member, number)
        app.command(family)
        return
    module, _, name = command.partition(":")  # import_ is `import`, which no function can be called
    path, help = f"{__package__}.{command}", functions(module)[name]
    app.command(path, name=name.rstrip("_"), help=help, group=group, sort_key=place)


app = build()


def main(argv: Sequence[str] | None = None) -> None:
    """Run the command line; a user's mistake ends it with one line and exit code 2."""
    try:
        words = gathered([as_json(word) for word in (sys.argv[1:] if argv is None else argv)])
        with ends_on_ctrl_c():
            app(words, exit_on_error=False, print_error=False, console=output)
    except (CycloptsError, PlancurateError) as error:
        stop(str(error), USER_ERROR)
    except OSError as error:
        if error.errno in FULL:
            stop(no_room(error), USER_ERROR)
        if error.errno not in REFUSALS or error.filename is None:
            raise
        stop(f"{error.filename}: {error.strerror}; another file or folder is needed", USER_ERROR)
    except IncompleteError as error:
        stop(str(error), INCOMPLETE)
    except KeyboardInterrupt:
        sys.exit(INTERRUPTED)


def no_room(error: OSError) -> str:
    """Say in one line what could not be written for want of space."""
    where = error.filename or "a file could not be written"
    return f"{where}: {os.strerror(error.errno or 0)}; make room, and the same command goes on from here"


def as_json(word: str) -> str:
    """Return a word that begins like a YAML mapping or list as JSON, which cyclopts reads, others as they are."""
    if not word.startswith(("{", "[")):
        return word
    return json.dumps(parse_yaml(word, shortened(word)), default=str)


def gathered(words: Sequence[str]) -> list[str]:
    """Return the words with several values of an option with dots as one JSON list, for cyclopts takes only one."""
    result: list[str] = []
    values: list[str] = []
    for word in [*words, "--"]:
        if word.startswith("--"):
            if len(values) > 1 and "." in result[-len(values) - 1]:
                result[-len(values) :] = [json.dumps(values)]
            values = []
        elif values or (result and result[-1].startswith("--")):
            values.append(word)
        result.append(word)
    return result[:-1]


def stop(message: str, code: int) -> None:
    """Say why in one line and exit."""
    complain(message)
    sys.exit(code)


if __name__ == "__main__":
    main()
