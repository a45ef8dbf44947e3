"""Ctrl-C and `kill` are answered at once, and the command ends within seconds, whatever its threads are at."""

from __future__ import annotations

import multiprocessing
import os
import signal
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from typing import NoReturn

from plancurate.flows.cli.console import complain

INTERRUPTED = 130
TERMINATED = 143
STOPPED = "stopped; the same command goes on from here"
GRACE_S = 3.0


@contextmanager
def ends_on_ctrl_c() -> Iterator[None]:
    """Let Ctrl-C raise KeyboardInterrupt inside, and end the process if it is still there a little later.

    A flow waits for its task runs, and those that train or roll out in threads can't be interrupted for minutes. To the
    lake such an end is what a kill is: the same command goes on from there.
    """
    before = signal.getsignal(signal.SIGINT)
    ours = before is signal.default_int_handler  # else whoever started this process had it ignore Ctrl-C
    if not ours or threading.current_thread() is not threading.main_thread():
        yield
        return
    signal.signal(signal.SIGINT, _interrupted)
    try:
        yield
    finally:
        # Where it is another one, the process is on its way out, and the next Ctrl-C ends it.
        if signal.getsignal(signal.SIGINT) is _interrupted:
            signal.signal(signal.SIGINT, before)


@contextmanager
def ends_on_sigterm() -> Iterator[None]:
    """End the process a little after SIGTERM, if it is still there.

    While a flow runs, SIGTERM is Prefect's, which ends the flow and then waits for its threads, as at Ctrl-C. Python
    also writes the number of each signal to a file descriptor, which a thread reads here.
    """
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    heard, told = os.pipe()
    os.set_blocking(told, False)
    threading.Thread(target=_leave_on_sigterm, args=[heard], daemon=True).start()
    before = signal.set_wakeup_fd(told, warn_on_full_buffer=False)
    try:
        yield
    finally:
        signal.set_wakeup_fd(before)
        os.close(told)


def _leave_on_sigterm(heard: int) -> None:
    with os.fdopen(heard, "rb", buffering=0) as signals:
        while number := signals.read(1):
            if number[0] == signal.SIGTERM:
                complain(STOPPED)
                time.sleep(GRACE_S)
                leave(TERMINATED)


def leave(code: int) -> NoReturn:
    """End this process and those that it started, now."""
    for child in multiprocessing.active_children():
        child.kill()
    os._exit(code)


def _interrupted(*_: object) -> NoReturn:
    signal.signal(signal.SIGINT, lambda *_: leave(INTERRUPTED))  # who asks twice means it
    complain(STOPPED)
    timer = threading.Timer(GRACE_S, leave, [INTERRUPTED])
    timer.daemon = True
    timer.start()
    raise KeyboardInterrupt
