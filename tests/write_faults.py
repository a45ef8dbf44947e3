"""Real faults at the writes of a process: a library in C that it loads counts them and kills it or fills the disk."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

LIBRARY = Path(__file__).with_suffix(".c")
# One process imports and forks for each write, so that a kill costs milliseconds.
KILL_AT_EVERY_WRITE = """
import os, shutil, signal, sys
import pandas, pyarrow.pandas_compat  # which pyarrow would import for each
from itertools import count
from pathlib import Path

{work}
folder, template = map(Path, sys.argv[1:])
for number in count():
    root = shutil.copytree(template, folder / f"{{number:04d}}")
    if (child := os.fork()) == 0:
        os.environ |= {{"FAULT": "kill", "FAULT_AT": str(number + 1), "FAULT_UNDER": str(root)}}
        signal.alarm(20)
        work(root)
        os._exit(0)
    code = os.waitstatus_to_exitcode(os.waitpid(child, 0)[1])
    if code != -9:
        sys.exit(code)
"""


@pytest.fixture(scope="session")
def write_faults(tmp_path_factory: pytest.TempPathFactory) -> dict[str, str]:
    """Environment of a process that counts its writes; it fails at those that FAULT, FAULT_AT and FAULT_UNDER name."""
    library = tmp_path_factory.mktemp("write_faults") / "write_faults.so"
    subprocess.run(["cc", "-shared", "-fPIC", "-Wall", "-Werror", "-o", library, LIBRARY, "-ldl"], check=True)
    return {"LD_PRELOAD": str(library)}


def killed_at_every_write(
    work: str, folder: Path, template: Path, write_faults: dict[str, str]
) -> tuple[list[Path], Path]:
    """Run `work(root)`, a function in Python source, in copies of a folder, each time killed before another write.

    Returns the copies in the order of the writes, and the one in which it was left alone.
    """
    folder.mkdir()
    program = KILL_AT_EVERY_WRITE.format(work=work)
    paths = os.pathsep.join(str(Path(path).absolute()) for path in sys.path if path)
    environment = os.environ | write_faults | {"PYTHONPATH": paths}
    subprocess.run(
        [sys.executable, "-c", program, folder, template], env=environment, check=True, timeout=120
    )
    *killed, undisturbed = sorted(folder.iterdir())
    return killed, undisturbed


def files(root: Path) -> dict[str, bytes]:
    """Content of every file below a folder, temporary ones included."""
    return {str(path.relative_to(root)): path.read_bytes() for path in root.rglob("*") if path.is_file()}
