"""Commands in processes of their own that begin where their imports have ended.

Importing Prefect, MLflow and torch takes a command longer than most of what tests ask of it. So one process imports
them and forks for every command, which then goes on as one that was typed: its own environment, files, exit. It ends
as an interpreter does, with its threads and exit handlers, but doesn't free what it was forked with, which would copy
all of it first and take as long as importing it.
"""

from __future__ import annotations

import json
import subprocess
import sys
from collections.abc import Mapping
from dataclasses import dataclass
from itertools import count
from pathlib import Path

from ..homes import environment

TIMEOUT_S = 600
FORK = """
import atexit, gc, json, os, signal, sys, threading, traceback

import alembic.command, mlflow.pyfunc, mlflow.store.tracking.sqlalchemy_store, pandas, prefect.flow_engine
import prefect.task_engine, pyarrow.pandas_compat, scipy.signal, sklearn.cluster, toppra, torch
import plancurate.flows.cli.stages, plancurate.flows.cli.verdict, plancurate.flows.study
import plancurate.tasks.curation.selectors.cupid, plancurate.tasks.curation.selectors.dtw
from plancurate.flows.cli.app import main

gc.freeze()  # or each collection in a command would copy all of it
for line in sys.stdin:
    call = json.loads(line)
    if "ended" in call:
        answer = os.waitstatus_to_exitcode(os.waitpid(call["ended"], 0)[1])
    elif (answer := os.fork()) == 0:
        break
    print(answer, flush=True)
else:
    os._exit(0)
signal.alarm(call["seconds"])
os.chdir(call["folder"])
os.environ.clear()
os.environ.update(call["environment"])
for descriptor, name in enumerate(call["files"]):
    os.dup2(os.open(name, os.O_RDWR), descriptor)
code = 0
try:
    main(call["words"])
except SystemExit as end:
    code = end.code or 0
except BaseException:
    traceback.print_exc()
    code = 1
threading._shutdown()
atexit._run_exitfuncs()
sys.stdout.flush()
sys.stderr.flush()
os._exit(code)
"""


def command_line(*words: str) -> list[str]:
    """Return the plancurate command as this interpreter runs it from its first import on."""
    return [sys.executable, "-c", "from plancurate.flows.cli.app import main; main()", *words]


@dataclass(frozen=True)
class Running:
    """A command that was started."""

    commands: Commands
    words: tuple[str, ...]
    pid: int
    outputs: tuple[Path, Path]

    def has_ended(self) -> bool:
        """Whether it has ended, without waiting for it."""
        return Path(f"/proc/{self.pid}/stat").read_text().rpartition(")")[2].split()[0] == "Z"

    def result(self) -> subprocess.CompletedProcess[str]:
        """What it said and how it ended; waits for it, and is asked for once."""
        code = self.commands.ask({"ended": self.pid})
        return subprocess.CompletedProcess(self.words, code, *(file.read_text() for file in self.outputs))


class Commands:
    """Runs plancurate and captures what it says."""

    def __init__(self, folder: Path) -> None:
        self.folder, self.started = folder, count()
        pipe = subprocess.PIPE
        self.process = subprocess.Popen(
            [sys.executable, "-c", FORK], env=environment(), stdin=pipe, stdout=pipe, text=True
        )

    def ask(self, call: Mapping[str, object]) -> int:
        """The answer of the process that forks."""
        assert self.process.stdin is not None
        assert self.process.stdout is not None
        print(json.dumps(call), file=self.process.stdin, flush=True)
        return int(self.process.stdout.readline())

    def start(self, *words: str, folder: Path | None = None, **variables: str) -> Running:
        """Start a command in a folder with environment variables of its own; it is killed after TIMEOUT_S."""
        number = next(self.started)
        outputs = (self.folder / f"{number}.stdout", self.folder / f"{number}.stderr")
        for file in outputs:
            file.touch()
        call = {
            "words": words,
            "folder": str(folder or Path.cwd()),
            "environment": environment(**variables),
            "files": ["/dev/null", *map(str, outputs)],
            "seconds": TIMEOUT_S,
        }
        return Running(self, words, self.ask(call), outputs)

    def run(
        self, *words: str, folder: Path | None = None, **variables: str
    ) -> subprocess.CompletedProcess[str]:
        """Run a command to its end, as `start` does."""
        return self.start(*words, folder=folder, **variables).result()

    def close(self) -> None:
        """End the process that forks."""
        self.process.communicate()
