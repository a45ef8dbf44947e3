import os
import subprocess
import sys
import time
from collections import defaultdict
from concurrent.futures import ThreadPoolExecutor
from functools import partial
from itertools import count

import numpy as np
import pytest

from plancurate.robots import load_robot, load_scene
from plancurate.tasks.candidates.generate import generate_candidates
from plancurate.tasks.candidates.postprocess_pool import TIMEOUT_S, Setting, shared_pool, shared_postprocess
from plancurate.tasks.candidates.settings import GenerateSettings, PlanSettings
from plancurate.tasks.candidates.targets import sample_targets

ROBOT = load_robot("h2017")
SCENE = load_scene("table")
SETTINGS = GenerateSettings(plan=PlanSettings(runs=1))
TARGETS = sample_targets(ROBOT, SCENE, SETTINGS.targets, 0, 2)
MEASURED = ["plan_s", "timing_s", "verify_s"]
PLANNERS = ["RRTConnect", "KPIECE1", "EST"]


@pytest.fixture(scope="module")
def postprocess_path():
    with shared_pool(workers=2):
        yield shared_postprocess(Setting("h2017", "table", SETTINGS.timing, SETTINGS.verify))


@pytest.mark.slow
def test_processes_write_the_same_rows(postprocess_path):
    def elsewhere(planner: str):
        return generate_candidates(ROBOT, SCENE, TARGETS, planner, SETTINGS, postprocess_path)[0]

    with ThreadPoolExecutor(2) as threads:
        parts = list(threads.map(elsewhere, PLANNERS))
    for planner, part in zip(PLANNERS, parts, strict=True):
        here = generate_candidates(ROBOT, SCENE, TARGETS, planner, SETTINGS)[0]
        assert here.drop_columns(MEASURED).equals(part.drop_columns(MEASURED))
        assert part["solved"].to_pylist() == [True, True]


def test_a_path_that_was_done_lately_takes_no_time_and_another_target_is_measured_anew(postprocess_path):
    path = np.stack([ROBOT.home, TARGETS[0].goals[0]])
    first, again = (postprocess_path(path.copy(), TARGETS[0].position) for _ in range(2))
    assert first.verify_s > 0
    assert (again.timing_s, again.verify_s) == (0.0, 0.0)
    assert (again.metrics, again.verification) == (first.metrics, first.verification)
    np.testing.assert_array_equal(again.timed.q, first.timed.q)
    elsewhere = postprocess_path(path, TARGETS[1].position)
    assert elsewhere.verify_s > 0
    assert elsewhere.metrics["final_distance"] > first.metrics["final_distance"]


class Bomb(np.ndarray):
    """A path that ends the other process that looks for its first waypoint."""

    def __reduce__(self):
        return defaultdict, (partial(os._exit, 7),)


@pytest.mark.slow
def test_a_crash_costs_one_trajectory_and_is_its_reason(postprocess_path):
    bomb = np.stack([ROBOT.home, ROBOT.home]).view(Bomb)
    for _ in range(2):  # a crash is not remembered
        assert "exit code 7" in postprocess_path(bomb, TARGETS[0].position).timed.reason
    path = TARGETS[0].goals[[0, 0]]
    assert postprocess_path(path, TARGETS[0].position).timed.reason == ""


def test_a_clock_that_is_set_forward_costs_no_trajectory(postprocess_path, monkeypatch):
    ticks = count(1)
    monkeypatch.setattr(time, "time", lambda: next(ticks) * (TIMEOUT_S + 1))
    long = np.stack([ROBOT.home, TARGETS[0].goals[1]] * 30)  # Pebble looks every tenth of a second
    assert "took longer" not in postprocess_path(long, TARGETS[0].position).timed.reason


def test_errors_of_the_program_are_raised_not_written_down(postprocess_path):
    with pytest.raises(IndexError):
        postprocess_path(np.array("no path"), TARGETS[0].position)


ORPHANS = """
import sys, time
from plancurate.robots import load_robot
from plancurate.tasks.candidates.postprocess_pool import PostprocessPool, Setting
from plancurate.tasks.candidates.settings import GenerateSettings
if __name__ == "__main__":
    settings, home = GenerateSettings(), load_robot("h2017").home
    pool = PostprocessPool(workers=2)
    pool(Setting("h2017", "free", settings.timing, settings.verify), home[None], home[:3])
    print("ready", flush=True)
    time.sleep(60)
"""


@pytest.mark.slow
def test_processes_end_with_a_parent_that_is_killed(tmp_path):
    script = tmp_path / "orphans.py"
    script.write_text(ORPHANS)
    parent = subprocess.Popen([sys.executable, script], stdout=subprocess.PIPE)
    assert parent.stdout is not None
    with parent:
        assert parent.stdout.readline() == b"ready\n"
        parent.kill()
        parent.communicate(timeout=10)  # ends when the last process that holds the pipe has ended
