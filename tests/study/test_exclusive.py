"""Two processes and one study of a home."""

from __future__ import annotations

import signal
import subprocess
import sys
from pathlib import Path

import pytest

from plancurate.errors import PlancurateError
from plancurate.tasks.lake.home import Home
from plancurate.tasks.study.exclusive import exclusive

WORK = """
import sys
from plancurate.tasks.lake.home import Home
from plancurate.tasks.study.exclusive import exclusive

with exclusive(Home.resolve(sys.argv[1]), "quick-k1"):
    print("at work", flush=True)
    sys.stdin.read()
"""


def test_a_second_process_is_told_who_is_at_work_until_that_one_is_gone(tmp_path: Path) -> None:
    home, pipe = Home(tmp_path), subprocess.PIPE
    with subprocess.Popen([sys.executable, "-c", WORK, str(tmp_path)], stdin=pipe, stdout=pipe) as other:
        assert other.stdout.readline() == b"at work\n"
        complaint = pytest.raises(
            PlancurateError, match=rf"study quick-k1 in .*: process {other.pid} is at work"
        )
        with complaint, exclusive(home, "quick-k1"):
            pass
        with exclusive(home, "quick-k2"):
            other.send_signal(signal.SIGKILL)
    with exclusive(home, "quick-k1"):
        pass
