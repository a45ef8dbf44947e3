"""Rollouts of a study's policies, to be looked at."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from plancurate.robots.shapes import FloatArray
from plancurate.tasks.lake.home import Home
from plancurate.tasks.lake.store import Lake
from plancurate.tasks.pictures.rollout_shots import rollout_run
from plancurate.tasks.pictures.shot import Shot
from plancurate.tasks.study.predictor import Choice, StudyPolicy, study_policy
from plancurate.tasks.study.studies import find_study


def rollout_shots(
    home: Home, choice: Choice, target: tuple[float, float, float] | None = None, against: str | None = None
) -> list[Shot]:
    """The chosen policy's way to a target, m; `against` names a selection whose policy is shown to its left."""
    own = study_policy(home, choice)
    where = replace(choice, scene=own.scene.name, policy=own.row.policy, selector=against)
    shown = [own] if against is None else [study_policy(home, where), own]
    position = telling_target(home, choice, shown) if target is None else np.array(target)
    return [rollout_shot(one, position) for one in shown]


def rollout_shot(chosen: StudyPolicy, position: FloatArray) -> Shot:
    """One policy's way to a position (3,), m."""
    run = rollout_run(chosen.trained, chosen.robot, chosen.scene, position, chosen.settings)
    return Shot(chosen.robot, chosen.scene, (run,), title=f"{chosen.row.policy} on {chosen.row.name}")


def telling_target(home: Home, choice: Choice, shown: list[StudyPolicy]) -> FloatArray:
    """A test (3,), m, that the last policy reached, and the first one, where it is another, did not."""
    lake, own = Lake(home.lake), shown[-1].row
    (test,) = lake.query(
        "pictures/tests",
        study=find_study(lake, choice.study, choice.key),
        scene=own.scene,
        selector=own.selector,
        policy=own.policy,
        seed=own.seed,
        against=shown[0].row.selector,
    ).to_pylist()
    return np.array([test["x"], test["y"], test["z"]])
