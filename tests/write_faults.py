"""Real faults at the writes of a process: a library in C that it loads counts them and kills it or fills the disk."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

LIBRARY = Path(__file__).with_suffix(".c")
# One process imports and forks for each write, so that a fault costs milliseconds.
FAULT_AT_EVERY_WRITE = """
import os, shutil, signal, sys
import pandas, pyarrow.pandas_compat  # which pyarrow would import for each
from itertools import count
from pathlib import Path

{work}
fault, folder, template = sys.argv[1], *map(Path, sys.argv[2:])
for number in count():
    root = shutil.copytree(template, folder / f"{{number:04d}}")
    if (child := os.fork()) == 0:
        os.environ |= {{"FAULT": fault, "FAULT_AT": str(number + 1), "FAULT_UNDER": str(root)}}
        signal.alarm(20)
        try:
            work(root)
        except OSError as error:
            os._exit(error.errno if error.filename else 1)
        os._exit(0)
    code = os.waitstatus_to_exitcode(os.waitpid(child, 0)[1])
    if code not in (-9, 28):
        sys.exit(code)
"""


@pytest.fixture(scope="session")
def write_faults(tmp_path_factory: pytest.TempPathFactory) -> dict[str, str]:
    """Environment of a process that counts its writes; it fails at those that FAULT, FAULT_AT and FAULT_UNDER name."""
    library = tmp_path_factory.mktemp("write_faults") / "write_faults.so"
    subprocess.run(["cc", "-shared", "-fPIC", "-Wall", "-Werror", "-o", library, LIBRARY, "-ldl"], check=True)
    return {"LD_PRELOAD": str(library)}


def faulted_at_every_write(
    fault: str, work: str, folder: Path, template: Path, write_faults: dict[str, str]
) -> tuple[list[Path], Path]:
    """Run `work(root)`, a function in Python source, in copies of a folder, each time with another write at fault.

    `fault` is kill, or full: no room, which must end as an OSError that names a file. Returns the copies in the order
    of the writes, and the one in which there was no fault that mattered.
    """
    folder.mkdir()
    program = FAULT_AT_EVERY_WRITE.format(work=work)
    paths = os.pathsep.join(str(Path(path).absolute()) for path in sys.path if path)
    environment = os.environ | write_faults | {"PYTHONPATH": paths}
    command = [sys.executable, "-c", program, fault, folder, template]
    subprocess.run(command, env=environment, check=True, timeout=300)
    *faulted, undisturbed = sorted(folder.iterdir())
    return faulted, undisturbed


def files(root: Path) -> dict[str, bytes]:
    """Content of every file below a folder, temporary ones included."""
    return {str(path.relative_to(root)): path.read_bytes() for path in root.rglob("*") if path.is_file()}
