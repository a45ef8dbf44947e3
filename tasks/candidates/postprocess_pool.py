"""Postprocess paths in other processes: toppra and PyBullet hold the interpreter lock, planning does not."""

from __future__ import annotations

import multiprocessing
import os
import threading
import time
from collections import OrderedDict
from collections.abc import Iterator
from concurrent.futures import TimeoutError
from contextlib import contextmanager
from dataclasses import dataclass, replace
from functools import lru_cache, partial
from multiprocessing.connection import wait
from types import SimpleNamespace

import numpy as np
import pebble.pool.process
from pebble import ProcessExpired, ProcessPool

from plancurate.robots import Robot, Scene, load_world
from plancurate.robots.shapes import FloatArray
from plancurate.tasks.candidates.postprocess import Postprocess, Postprocessed, postprocess
from plancurate.tasks.candidates.settings import TimingSettings, VerifySettings
from plancurate.tasks.candidates.time_parameterisation import Timed

TIMEOUT_S = 300.0  # for one trajectory, which takes a fraction of a second
KEPT = 512  # trajectories of 20 kB or so: copies are found by planners of one target, whose parts are planned together

# Pebble limits tasks by the time of day: a clock set forward would cost whatever is in hand.
pebble.pool.process.time = SimpleNamespace(  # type: ignore[attr-defined, assignment]
    time=time.monotonic, sleep=time.sleep
)


@dataclass(frozen=True)
class Setting:
    """What paths are postprocessed with; robot and scene by what they are loaded from."""

    robot: str
    scene: str
    timing: TimingSettings
    playback: VerifySettings


class PostprocessPool:
    """Processes that many threads may give paths to at once; use it in a `with` block.

    A process that crashes or hangs costs the one trajectory it was at, whose row says so; a new one takes its
    place. The processes end with the block, or with this process however that ends.
    """

    def __init__(self, workers: int) -> None:
        """Start `workers` processes when the first path comes."""
        # A fork would copy the threads' locks, held for ever.
        spawn = multiprocessing.get_context("spawn")
        self._pool = ProcessPool(max_workers=workers, initializer=_start, context=spawn)
        self._known: OrderedDict[object, Postprocessed] = OrderedDict()

    def __enter__(self) -> PostprocessPool:
        return self

    def __exit__(self, *_: object) -> None:
        self._pool.stop()  # type: ignore[no-untyped-call]
        self._pool.join()

    def __call__(self, setting: Setting, path: FloatArray, target_position: FloatArray) -> Postprocessed:
        """Do `postprocess` in a process; blocks until it is done.

        Where runs share their goals, many planners find the same straight line: what was done lately takes no time.
        """
        same = (setting, path.tobytes(), target_position.tobytes())
        if (known := self._known.get(same)) is not None:
            return replace(known, timing_s=0.0, verify_s=0.0)
        job = self._pool.schedule(_postprocess, args=(setting, path, target_position), timeout=TIMEOUT_S)
        try:
            done: Postprocessed = job.result()
        except ProcessExpired as crash:
            return _failed(f"timing or playback crashed (exit code {crash.exitcode})")
        except TimeoutError:
            return _failed(f"timing and playback took longer than {TIMEOUT_S:g} s")
        self._known[same] = done
        if len(self._known) > KEPT:
            self._known.popitem(last=False)
        return done


_shared: PostprocessPool | None = None  # of this process: its planning threads have one in common


@contextmanager
def shared_pool(workers: int) -> Iterator[None]:
    """While this lasts, `shared_postprocess` of this process works in that many other processes."""
    global _shared
    with PostprocessPool(workers) as _shared:
        try:
            yield
        finally:
            _shared = None


def shared_postprocess(setting: Setting) -> Postprocess | None:
    """Return what postprocesses paths in the shared processes; None outside `shared_pool`."""
    return partial(_shared, setting) if _shared else None


def _failed(reason: str) -> Postprocessed:
    return Postprocessed(Timed(np.empty((0, 0)), 0.0, "", reason), None, None, 0.0, 0.0)


def _start() -> None:
    """Prepare a worker process."""
    threading.Thread(target=_end_with_parent, daemon=True).start()


def _end_with_parent() -> None:
    parent = multiprocessing.parent_process()
    assert parent is not None
    wait([parent.sentinel])
    os._exit(1)


@lru_cache(maxsize=8)
def _loaded(setting: Setting) -> tuple[Robot, Scene]:
    return load_world(setting.robot, setting.scene)


def _postprocess(setting: Setting, path: FloatArray, target_position: FloatArray) -> Postprocessed:
    robot, scene = _loaded(setting)
    return postprocess(robot, scene, path, target_position, setting.timing, setting.playback)
