"""Run a service that ends by itself when nobody uses it any more.

`python -m plancurate.flows.server.watchdog USERS [--own FILE --url URL] -- MODULE ARGUMENTS...` runs a Python module as
`python -m` would. Users hold a shared lock on the file USERS, which the kernel drops however a user ends,
`kill -9` included. When the last one is gone, the service's process group is asked to stop, then made to.
With `--own`, FILE is locked for as long as the service lives and says its process id and URL.
"""

from __future__ import annotations

import argparse
import fcntl
import json
import os
import runpy
import signal
import sys
import threading
import time
from collections.abc import Sequence
from pathlib import Path

POLL_S = 0.3
GRACE_S = 15.0


def main(argv: Sequence[str]) -> None:
    """Start the watch, claim the lock file and become the module asked for."""
    parser = argparse.ArgumentParser()
    parser.add_argument("users", type=Path)
    parser.add_argument("--own", type=Path)
    parser.add_argument("--url", default="")
    parser.add_argument("command", nargs="+")
    asked = parser.parse_args(argv)
    signal.signal(
        signal.SIGINT, signal.default_int_handler
    )  # ignored where a shell started us in the background
    threading.Thread(target=_stop_without_users, args=(asked.users,), daemon=True).start()
    claim = _claim(asked.own, asked.url) if asked.own else None
    sys.argv = asked.command
    runpy.run_module(asked.command[0], run_name="__main__", alter_sys=True)
    del claim


def _claim(own: Path, url: str) -> object:
    """Lock the file for the life of the returned object and say in it who serves where."""
    file = own.open("a+")
    fcntl.flock(file, fcntl.LOCK_EX)
    file.truncate(0)
    file.write(json.dumps({"pid": os.getpid(), "url": url}))
    file.flush()
    return file


def _stop_without_users(users: Path) -> None:
    with users.open("a") as file:
        while True:
            try:
                fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
                break
            except BlockingIOError:
                time.sleep(POLL_S)
        os.killpg(0, signal.SIGTERM)  # the lock stays held: who comes now waits until this service is gone
        time.sleep(GRACE_S)
        os.killpg(0, signal.SIGKILL)


if __name__ == "__main__":
    main(sys.argv[1:])
