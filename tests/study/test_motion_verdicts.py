"""What becomes of a policy's path as a motion."""

from __future__ import annotations

import numpy as np
import pytest

from plancurate.tasks.lake.home import Home
from plancurate.tasks.motion.rollout import PolicyPath
from plancurate.tasks.study.config import load_config
from plancurate.tasks.study.context import PoolContext, open_study
from plancurate.tasks.study.motion_verdicts import verdict_on

AROUND, INTO_THE_POST = [0.9, 0.1, 0.1, 0, 0, 0.5], [-0.9, 0.6, 0.3, 0, 0, 0.5]


@pytest.fixture(scope="module")
def pool(tmp_path_factory: pytest.TempPathFactory) -> PoolContext:
    """A pool in the scene with the post; nothing of it is made."""
    config = load_config("smoke", None, {"scenes": ["table"]})
    return open_study(config, Home(tmp_path_factory.mktemp("verdicts"))).pools[0]


def path(pool: PoolContext, turn: list[float], reason: str = "") -> PolicyPath:
    steps = np.linspace(0, 1, 21)[:, None]
    return PolicyPath(pool.robot.home + steps * np.array(turn), 0.01, reason)


def test_a_free_path_becomes_a_motion_that_passes(pool: PoolContext) -> None:
    found = verdict_on(pool, pool.scene, path(pool, AROUND))
    assert (found["passed"], found["failed_check"], found["reason"]) == (True, "", "")
    # 0.9 rad from rest to rest: longer than at the greatest acceleration throughout, and not for ever.
    least = 2 * np.sqrt(0.9 / pool.robot.acceleration[0])
    assert least < found["duration"] < 3 * least


def test_a_path_that_can_t_run_says_at_what_it_fails(pool: PoolContext) -> None:
    blocked = verdict_on(pool, pool.scene, path(pool, INTO_THE_POST))
    assert (blocked["passed"], blocked["failed_check"], blocked["duration"]) == (False, "timing", None)
    assert blocked["reason"].startswith("not timed: ")
    assert "collides" in blocked["reason"]
    missed = verdict_on(pool, pool.scene, path(pool, AROUND, "came no nearer than 0.080 m"))
    assert (missed["failed_check"], missed["reason"]) == ("rollout", "came no nearer than 0.080 m")
