"""Rollouts of a study's policies, to be looked at."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from plancurate.robots.shapes import FloatArray
from plancurate.tasks.curation.names import label
from plancurate.tasks.lake.home import Home
from plancurate.tasks.lake.store import Lake
from plancurate.tasks.motion.rollout import goals_of
from plancurate.tasks.pictures.rollout_shots import rollout_run
from plancurate.tasks.pictures.shot import Shot
from plancurate.tasks.study.against import BASELINE
from plancurate.tasks.study.context import PoolContext, StudyContext
from plancurate.tasks.study.evaluations import goals_at
from plancurate.tasks.study.network_cells import Cell as NetworkCell
from plancurate.tasks.study.networks import load_network
from plancurate.tasks.study.predictor import Choice, StudyPolicy, network_of, study_policy
from plancurate.tasks.study.rows import Cell
from plancurate.tasks.study.studies import find_study
from plancurate.tasks.study.trial_results import Kind


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
    policy, world, settings = chosen.trained, (chosen.robot, chosen.scene), chosen.settings
    targets, dt = settings.candidates.targets, settings.candidates.timing.dt
    goals = goals_of(policy, *world, position[None], targets, settings.seed)
    run = rollout_run(policy, *world, position, settings.rollout, dt, goals)
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


def contrast_shots(study: StudyContext, pool: PoolContext, kind: Kind, cell: Cell) -> list[Shot]:
    """A tested rollout of a study that succeeds, and one that fails, as far as there are such.

    To the same target where one test came out both ways; rather a success on the selection named and a failure on
    General.
    """
    rows = study.lake.query(
        "pictures/contrast",
        study=study.study,
        kind=kind,
        scene=pool.scene.name,
        pool_label=pool.label,
        selector=cell.selector,
        budget=cell.budget,
        against=BASELINE,
    ).to_pylist()
    return [tested_shot(study, pool, row) for row in rows]


def tested_shot(study: StudyContext, pool: PoolContext, row: Mapping[str, Any]) -> Shot:
    """The rollout of a trial, run again as it was tested."""
    heads = ("selector", "budget", "selection_seed", "policy", "seed", "round")
    cell: NetworkCell = (pool.scene.name, pool.label, *(row[name] for name in heads))
    position, settings = np.array([row["x"], row["y"], row["z"]]), study.config.evaluation
    policy = load_network(study, network_of(study, cell, position))
    scenes = pool.scenes_of_tests([row["kind"]], [row["target_id"]])
    goals = goals_at(study, pool, policy.goals, scenes, position[None], [row["test_id"]])
    dt = pool.settings.timing.dt
    run = rollout_run(policy, pool.robot, scenes[0], position, settings, dt, goals)
    title = f"{row['policy']} on {label(row['selector'], row['budget'])}"
    return Shot(pool.robot, scenes[0], (run,), title=title)
