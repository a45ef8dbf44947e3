"""Finish paths in other processes: toppra and PyBullet hold the interpreter lock, planning does not."""

from __future__ import annotations

import multiprocessing
import os
import threading
from concurrent.futures import TimeoutError
from functools import partial
from multiprocessing.connection import wait
from pathlib import Path
from types import TracebackType

import numpy as np
from pebble import ProcessExpired, ProcessPool

from plancurate.robots import load_world
from plancurate.robots.shapes import FloatArray
from plancurate.tasks.candidates.postprocess import Postprocessed, postprocess
from plancurate.tasks.candidates.settings import TimingSettings, VerifySettings
from plancurate.tasks.candidates.time_parameterisation import Timed

TIMEOUT_S = 300.0  # for one trajectory, which takes a fraction of a second


class PostprocessPool:
    """A `postprocess_path` for `generate_candidates` that many threads may call at once; use it in a `with` block.

    A process that crashes or hangs costs the one trajectory it was at, whose row says so; a new one takes its
    place. The processes end with the block, or with this process however that ends.
    """

    def __init__(
        self,
        robot: str | Path,
        scene: str | Path,
        timing: TimingSettings,
        playback: VerifySettings,
        workers: int,
    ) -> None:
        """Start `workers` processes when the first path comes; each loads the robot and the scene by name."""
        self._pool = ProcessPool(
            max_workers=workers,
            initializer=_start,
            initargs=(robot, scene, timing, playback),
            context=multiprocessing.get_context(
                "spawn"
            ),  # a fork would copy the threads' locks, held for ever
        )

    def __enter__(self) -> PostprocessPool:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._pool.stop()  # type: ignore[no-untyped-call]
        self._pool.join()

    def __call__(self, path: FloatArray, target_position: FloatArray) -> Postprocessed:
        """Do `postprocess` in a process; blocks until it is done."""
        job = self._pool.schedule(_postprocess, args=(path, target_position), timeout=TIMEOUT_S)
        try:
            return job.result()
        except ProcessExpired as crash:
            return _failed(f"timing or playback crashed (exit code {crash.exitcode})")
        except TimeoutError:
            return _failed(f"timing and playback took longer than {TIMEOUT_S:g} s")


def _failed(reason: str) -> Postprocessed:
    return Postprocessed(Timed(np.empty((0, 0)), 0.0, "", reason), None, None, 0.0, 0.0)


_postprocess_here: partial[Postprocessed]  # of a worker process


def _start(robot: str | Path, scene: str | Path, timing: TimingSettings, playback: VerifySettings) -> None:
    """Prepare a worker process."""
    global _postprocess_here
    threading.Thread(target=_end_with_parent, daemon=True).start()
    _postprocess_here = partial(postprocess, *load_world(robot, scene), timing=timing, playback=playback)


def _end_with_parent() -> None:
    parent = multiprocessing.parent_process()
    assert parent is not None
    wait([parent.sentinel])
    os._exit(1)


def _postprocess(path: FloatArray, target_position: FloatArray) -> Postprocessed:
    return _postprocess_here(path, target_position)
