"""Run a service that ends by itself when nobody uses it any more.

`python -m plancurate.flows.server.watchdog (--users FILE | --parent PID) [--own FILE --url URL] -- MODULE ARGUMENTS...`
runs a Python module as `python -m` would. With `--users`, it lives as long as somebody holds a shared lock on FILE,
which the kernel drops however a user ends, `kill -9` included; with `--parent`, as long as the process that started
it. Then the service's process group is asked to stop, and after a while made to. With `--own`, FILE is locked for as
long as the service lives and says its process id and URL.
"""

from __future__ import annotations

import argparse
import fcntl
import gc
import os
import runpy
import signal
import sys
import threading
import time
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import IO

from plancurate.locks import try_lock, write_note

POLL_S = 0.3
GRACE_S = 15.0
# A service's start is imports, which make objects that stay; with Python's 700 a fifth of it is looking for garbage.
OBJECTS_BETWEEN_COLLECTIONS = 100_000


def main(argv: Sequence[str]) -> None:
    """Start the watch, claim the lock file and become the module asked for."""
    gc.set_threshold(OBJECTS_BETWEEN_COLLECTIONS)
    asked = _arguments(argv)
    signal.signal(
        signal.SIGINT, signal.default_int_handler
    )  # ignored where a shell started us in the background
    threading.Thread(target=_stop_when_unused, args=(_usage(asked),), daemon=True).start()
    claim = _claim(asked.own, asked.url) if asked.own else None
    sys.argv = asked.command
    runpy.run_module(asked.command[0], run_name="__main__", alter_sys=True)
    del claim


def _arguments(argv: Sequence[str]) -> argparse.Namespace:
    parser = argparse.ArgumentParser()
    lifetime = parser.add_mutually_exclusive_group(required=True)
    lifetime.add_argument("--users", type=Path)
    lifetime.add_argument("--parent", type=int)
    parser.add_argument("--own", type=Path)
    parser.add_argument("--url", default="")
    parser.add_argument("command", nargs="+")
    return parser.parse_args(argv)


def _usage(asked: argparse.Namespace) -> Callable[[], bool]:
    """Whether somebody uses the service, as a question to be asked again and again."""
    if asked.users is None:
        return lambda: os.getppid() == asked.parent
    file = asked.users.open("a")
    # Once nobody has it, the lock stays held: who comes now waits until this service is gone.
    return lambda: not try_lock(file, fcntl.LOCK_EX)


def _claim(own: Path, url: str) -> IO[str]:
    """Lock the file for the life of the returned object and say in it who serves where."""
    file = own.open("a+")
    fcntl.flock(file, fcntl.LOCK_EX)
    write_note(file, {"url": url})
    return file


def _stop_when_unused(is_used: Callable[[], bool]) -> None:
    while is_used():
        time.sleep(POLL_S)
    os.killpg(0, signal.SIGTERM)
    time.sleep(GRACE_S)
    os.killpg(0, signal.SIGKILL)


if __name__ == "__main__":
    main(sys.argv[1:])
