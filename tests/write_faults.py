"""Real faults at the writes of a process: a library in C that it loads counts them and kills it or fills the disk."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from collections.abc import Callable, Iterator
from contextlib import closing
from pathlib import Path

import pytest

LIBRARY = Path(__file__).with_suffix(".c")
# One process imports, for all tests, and forks for each write, so that a fault costs milliseconds.
FAULT_AT_EVERY_WRITE = """
import json, os, shutil, signal, sys
import pandas, pyarrow.pandas_compat  # which pyarrow would import for each
from importlib import import_module
from itertools import count
from pathlib import Path

def code_at(number, fault, work, folder, template):
    root = shutil.copytree(template, Path(folder) / f"{number:04d}")
    if (child := os.fork()) == 0:
        os.environ |= {"FAULT": fault, "FAULT_AT": str(number + 1), "FAULT_UNDER": str(root)}
        signal.alarm(20)
        try:
            work(root)
        except OSError as error:
            os._exit(error.errno if error.filename else 1)
        os._exit(0)
    return os.waitstatus_to_exitcode(os.waitpid(child, 0)[1])

for line in sys.stdin:
    module, name, *how = json.loads(line)
    work = getattr(import_module(module), name)
    codes = (code_at(number, how[0], work, *how[1:]) for number in count())
    print(next(code for code in codes if code not in (-9, 28)), flush=True)
os._exit(0)  # freeing what was imported takes longer than a job
"""


class WriteFaults:
    """A process that counts the writes of jobs; they fail at those that FAULT, FAULT_AT and FAULT_UNDER name."""

    def __init__(self, library: Path) -> None:
        subprocess.run(
            ["cc", "-shared", "-fPIC", "-Wall", "-Werror", "-o", library, LIBRARY, "-ldl"], check=True
        )
        paths = os.pathsep.join(str(Path(path).absolute()) for path in sys.path if path)
        self.process = subprocess.Popen(
            [sys.executable, "-c", FAULT_AT_EVERY_WRITE],
            env=os.environ | {"LD_PRELOAD": str(library), "PYTHONPATH": paths},
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
        )

    def at_every_write(
        self, fault: str, job: Callable[[Path], object], folder: Path, template: Path
    ) -> tuple[list[Path], Path]:
        """Do a job, a function of a module, in copies of a folder, each time with another write at fault.

        `fault` is kill, or full: no room, which must end as an OSError that names a file. Returns the copies in the
        order of the writes, and the one in which there was no fault that mattered.
        """
        assert self.process.stdin is not None
        assert self.process.stdout is not None
        folder.mkdir()
        call = [job.__module__, job.__name__, fault, str(folder), str(template)]
        print(json.dumps(call), file=self.process.stdin, flush=True)
        assert int(self.process.stdout.readline()) == 0
        *faulted, undisturbed = sorted(folder.iterdir())
        return faulted, undisturbed

    def close(self) -> None:
        """End the process."""
        self.process.communicate()


@pytest.fixture(scope="session")
def write_faults(tmp_path_factory: pytest.TempPathFactory) -> Iterator[WriteFaults]:
    """Does jobs with a fault at each of their writes."""
    with closing(WriteFaults(tmp_path_factory.mktemp("write_faults") / "write_faults.so")) as faults:
        yield faults


def files(root: Path) -> dict[str, bytes]:
    """Content of every file below a folder, temporary ones included."""
    return {str(path.relative_to(root)): path.read_bytes() for path in root.rglob("*") if path.is_file()}
