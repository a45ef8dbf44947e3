"""Whether the selections that the experiment compares are as alike and as unlike as it says."""

from __future__ import annotations

from pathlib import Path
from types import ModuleType

import numpy as np
import pytest

from plancurate.tasks.curation.selectors import base

from ..curation.selectors.defects import ROBOT, bed_of, chosen, curve, tool_positions

EXPERIMENTS = Path(__file__).parents[2] / "experiments"
TARGETS, PATHS = 6, 8


@pytest.fixture
def alike(monkeypatch: pytest.MonkeyPatch) -> ModuleType:
    """The experiment, whose selector no other test sees."""
    monkeypatch.syspath_prepend(EXPERIMENTS)
    assert base.selector_names()  # all others are registered for good
    monkeypatch.setattr(base, "_registry", dict(base._registry))
    import alike as experiment  # type: ignore[import-not-found]

    return experiment


def test_like_paths_are_nearer_to_each_other_than_any_and_unlike_ones_farther(alike: ModuleType) -> None:
    rng = np.random.default_rng(0)
    goals = ROBOT.home + rng.normal(0, 0.1, (TARGETS, 6)) + 0.8
    vias = (
        rng.normal(0, 0.5, (TARGETS, PATHS, 6)) * (np.arange(PATHS) % 2)[:, None]
    )  # every other one is direct
    via = [(ROBOT.home + goals[t]) / 2 + vias[t, i] for t in range(TARGETS) for i in range(PATHS)]
    target = np.repeat(np.arange(TARGETS), PATHS)
    paths = [curve(np.stack([ROBOT.home, v, goals[t]])) for v, t in zip(via, target, strict=True)]
    bed = bed_of(paths, target, tool_positions(goals))
    names = bed.pool.candidates["trajectory_id"].to_pylist()
    apart = alike.path_distances(paths)
    mean = {}
    for prefer in ("any", "alike", "unlike"):
        kept = chosen(bed, "Paths", 3, prefer=prefer).kept
        assert np.bincount(kept["target_id"].to_numpy()).tolist() == [3] * TARGETS
        rows = [names.index(name) for name in kept["trajectory_id"].to_pylist()]
        mean[prefer] = apart[np.ix_(rows, rows)].mean()
    assert mean["alike"] < 0.8 * mean["any"]
    assert mean["unlike"] > 1.2 * mean["any"]
