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
    if (child := os.fork()) == 0:
        break
    print(os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]), flush=True)
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


class Commands:
    """Runs plancurate and captures what it says, one command at a time."""

    def __init__(self, folder: Path) -> None:
        self.outputs = [folder / "stdout", folder / "stderr"]
        pipe = subprocess.PIPE
        self.process = subprocess.Popen(
            [sys.executable, "-c", FORK], env=environment(), stdin=pipe, stdout=pipe, text=True
        )

    def run(
        self, *words: str, folder: Path | None = None, **variables: str
    ) -> subprocess.CompletedProcess[str]:
        """Run a command in a folder with environment variables of its own; one that hangs is killed after TIMEOUT_S."""
        assert self.process.stdin is not None
        assert self.process.stdout is not None
        for file in self.outputs:
            file.write_bytes(b"")
        call = {
            "words": words,
            "folder": str(folder or Path.cwd()),
            "environment": environment(**variables),
            "files": ["/dev/null", *map(str, self.outputs)],
            "seconds": TIMEOUT_S,
        }
        print(json.dumps(call), file=self.process.stdin, flush=True)
        code = int(self.process.stdout.readline())
        return subprocess.CompletedProcess(words, code, *(file.read_text() for file in self.outputs))

    def close(self) -> None:
        """End the process that forks."""
        self.process.communicate()
