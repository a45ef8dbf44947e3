"""A study's corrections: which are missing, and how a network's are made from what the one before it does."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pyarrow as pa
import torch

from plancurate.tasks.lake.schema import table
from plancurate.tasks.learning.corrections import Correction, corrections
from plancurate.tasks.learning.training_goals import TrainingGoals, training_goals
from plancurate.tasks.study.context import PoolContext, StudyContext
from plancurate.tasks.study.demonstrations import positions, selected_waypoints
from plancurate.tasks.study.networks import Network, after_round, load_network
from plancurate.tasks.study.scenes import rows_by_scene
from plancurate.tasks.study.selections import make_selection


def missing_corrections(study: StudyContext, networks: Sequence[Network]) -> list[Network]:
    """Return those of these networks whose last round of corrections the lake lacks."""
    known = {pool.pool: study.lake.keys("corrections", pool.partition) for pool in study.pools}
    return [network for network in networks if network.network_id not in known[network.selection.pool]]


def make_corrections(study: StudyContext, network: Network) -> int:
    """Roll out what a network was a round before on its training targets, record its corrections; gives how many."""
    torch.set_num_threads(1)  # a network a core, as in training
    pool, parent = study.pool(network.selection.pool), after_round(study, network, network.round - 1)
    targets, goals = training(study, pool, network)
    policy, found = load_network(study, parent), []
    for scene, of_scene in rows_by_scene(pool.scenes_of_targets(targets)):
        made = corrections(
            policy,
            pool.robot,
            scene,
            TrainingGoals(goals.positions[of_scene], goals.configurations[of_scene]),
            pool.settings.plan,
            study.config.evaluation,
            study.config.corrections,
            pool.settings.timing.dt,
        )
        found += [replace(one, target=int(of_scene[one.target])) for one in made]
    rows = correction_rows(network, parent, targets, found)
    study.lake.write("corrections", pool.partition, network.network_id, rows, study.metadata)
    return len(found)


def training(study: StudyContext, pool: PoolContext, network: Network) -> tuple[list[int], TrainingGoals]:
    """Return the targets that a network's selection leads to, by id and with their goals, in the same order."""
    selection = make_selection(study, network.selection)
    targets = selection.kept["target_id"].to_pylist()
    ends = np.stack([q[-1] for q in selected_waypoints(study, selection, pool.partition)])
    places = positions(study, pool, targets)
    goals = training_goals(places, ends)
    number = dict(zip(map(tuple, places.tolist()), targets, strict=True))
    return [number[tuple(place)] for place in goals.positions.tolist()], goals


def correction_rows(
    network: Network, parent: Network, targets: Sequence[int], found: Sequence[Correction]
) -> pa.Table:
    """Return rows of `corrections`."""
    same = {
        "network_id": network.network_id,
        "parent": parent.network_id,
        "round": network.round,
        "selection_id": network.selection.selection_id,
        "policy": network.policy,
        "seed": network.seed,
    }
    rows = [
        same
        | {
            "correction_id": f"{network.network_id}-t{targets[one.target]:04d}-m{one.step}",
            "target_id": targets[one.target],
            "step": one.step,
            "failure": one.failure,
            "q": one.path.tolist(),
        }
        for one in found
    ]
    return pa.Table.from_pylist(rows, table("corrections").schema)
