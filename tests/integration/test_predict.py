"""From a study to verified motions, as a user would."""

from __future__ import annotations

import json
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np

from plancurate import native
from plancurate.robots import load_robot
from plancurate.tasks.motion.trajectory_files import read_motion

from ..homes import environment
from .conftest import Command, Studied

FLOW = """
import json, sys
from plancurate.flows.predict import predict
print(json.dumps(predict("smoke", json.loads(sys.argv[1]), home=sys.argv[2])))
"""
TARGETS = [(0.9, 0.1, 0.6), (0.8, -0.1, 0.7), (5.0, 0.0, 0.0)]


def test_many_targets_become_files_that_the_verifier_passes(
    smoke: Studied, plancurate: Command, tmp_path: Path
) -> None:
    file, out = tmp_path / "targets.csv", tmp_path / "motion.yaml"
    file.write_text("x,y,z\n" + "".join(f"{x},{y},{z}\n" for x, y, z in TARGETS))
    words = ("predict", "--study", "smoke", "--home", str(smoke.untouched))
    done = plancurate(*words, "--targets", str(file), "--out", str(out), "--json")
    assert done.returncode == 1, done.stderr  # the last target is out of reach
    found = json.loads(done.stdout)["predictions"]
    assert [one["made_by"] != "nobody" for one in found] == [True, True, False]
    written = sorted(tmp_path.glob("motion-*.yaml"))
    assert [path.name for path in written] == ["motion-0000.yaml", "motion-0001.yaml"]
    robot = load_robot("h2017")
    for path, target in zip(written, TARGETS, strict=False):
        assert plancurate("verify", str(path)).returncode == 0
        tool = native.fk(robot.native, read_motion(path).positions[-1:])[0, :3, 3]
        assert np.linalg.norm(tool - target) < 0.05


def test_a_rollout_is_verified_in_its_studys_world(smoke: Studied, plancurate: Command) -> None:
    home = ("--home", str(smoke.untouched))
    asked = "SELECT x, y, z, policy FROM evaluations WHERE success AND selector = 'KMeans_Hybrid' ORDER BY ALL LIMIT 1"
    (test,) = json.loads(plancurate("sql", asked, "--format", "json", *home).stdout)
    words = ("verify", "--study", "smoke", "--selector", "KMeans_Hybrid", "--policy", test["policy"], *home)
    done = plancurate(*words, "--target", *(str(test[name]) for name in "xyz"), "--json")
    assert done.returncode == 0, done.stderr
    assert json.loads(done.stdout)["passed"]
    missed = plancurate(*words, "--target", "5", "0", "0")
    assert missed.returncode == 2
    assert "rollout: came no nearer than" in missed.stderr


def test_what_can_t_be_asked_for_ends_with_2_and_one_line(
    smoke: Studied, plancurate: Command, tmp_path: Path
) -> None:
    (tmp_path / "targets.csv").write_text("x,y\n1,2\n")
    for words, said in (
        (("--study", "smok", "--target", "1", "0", "0.5"), "unknown study 'smok'"),
        (("--study", "smoke"), "--target X Y Z or --targets FILE"),
        (("--study", "smoke", "--target", "1", "0", "0.5", "--out", "motion.txt"), "unknown ending '.txt'"),
        (("--study", "smoke", "--targets", str(tmp_path / "targets.csv")), "target 0: z = None"),
    ):
        done = plancurate("predict", *words, "--home", str(smoke.untouched))
        assert done.returncode == 2
        assert said in done.stderr
        assert done.stderr.count("\n") == 1


def test_the_flow_writes_motions_into_the_home_and_verifies_what_it_wrote(
    smoke: Studied, shared_server: str, tmp_path: Path
) -> None:
    home = tmp_path / "home"
    shutil.copytree(smoke.untouched, home)
    done = subprocess.run(
        [sys.executable, "-c", FLOW, json.dumps(TARGETS), str(home)],
        capture_output=True,
        text=True,
        env=environment(PREFECT_API_URL=shared_server),
        check=False,
    )
    assert done.returncode == 0, done.stderr
    found = json.loads(done.stdout.splitlines()[-1])
    files = sorted(str(path) for path in (home / "motions").iterdir())
    assert [one["file"] for one in found] == [*files, None]
    assert len(files) == 2
    assert all(one["verdict"]["passed"] for one in found[:2])
