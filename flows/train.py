"""Train every policy on every selection of a study."""

from __future__ import annotations

import hashlib
import json
import shutil
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from uuid import uuid4

import numpy as np
import torch
from prefect import flow, task
from prefect.cache_policies import NO_CACHE

from plancurate.flows.curate import study_pool, study_selections
from plancurate.flows.progress import Bar, stage
from plancurate.flows.task_runs import run_all
from plancurate.tasks.curation.pool import FloatArray, Pool, load_waypoints, waypoint_arrays
from plancurate.tasks.curation.selectors.selection import Selection
from plancurate.tasks.lake.home import Home
from plancurate.tasks.learning import train as steps
from plancurate.tasks.learning.demonstrations import Demonstrations, demonstrations
from plancurate.tasks.learning.policies import TrainedPolicy
from plancurate.tasks.study.config import StudyConfig
from plancurate.tasks.study.context import Workplace


@dataclass(frozen=True, eq=False)
class Network:
    """One network of a study: a policy, the selection it learns from, and its training seed."""

    policy: str
    selection: Selection
    seed: int
    folder: Path


@flow(name="train", flow_run_name="train {config.name}")
def train(config: StudyConfig, home: str | None = None) -> None:
    """Train what the home folder does not hold yet: one task run for each policy, all its networks at once."""
    place = Workplace(config, Home.resolve(home))
    pool = study_pool(place)
    missing = [network for network in networks(place, pool) if not network.folder.is_dir()]
    kinds = [policy for policy in config.policies if any(network.policy == policy for network in missing)]
    with stage("train", len(missing), "networks") as bar:
        calls = ((place, pool, policy, [n for n in missing if n.policy == policy], bar) for policy in kinds)
        torch.set_num_threads(
            1
        )  # a policy a core: threads inside one small network spin more than they compute
        run_all(train_policy, calls, config.workers)


@task(
    name="train",
    task_run_name="train {policy}",
    tags=["train"],
    timeout_seconds=6 * 3600,
    cache_policy=NO_CACHE,
    persist_result=False,
)
def train_policy(place: Workplace, pool: Pool, policy: str, missing: Sequence[Network], bar: Bar) -> None:
    """Train a policy's missing networks together and keep each in a folder of its own."""
    settings, done = place.config.training, 0

    def progress(steps_done: int) -> None:
        nonlocal done
        bar.advance(len(missing) * (steps_done - done) / settings.steps)
        done = steps_done

    learned = {n.selection.selection_id: n.selection for n in missing}
    data = {key: selected_demonstrations(place, pool, selection) for key, selection in learned.items()}
    trained = steps.train(
        policy,
        [data[network.selection.selection_id] for network in missing],
        [network.seed for network in missing],
        settings,
        progress,
    )
    for network, result in zip(missing, trained, strict=True):
        keep(result, network.folder)


def networks(place: Workplace, pool: Pool) -> list[Network]:
    """Return the study's networks, policy by policy."""
    selections = study_selections(place, pool)
    return [
        Network(policy, selection, seed, place.home.models / network_id(place, selection, policy, seed))
        for policy in place.config.policies
        for selection in selections
        for seed in place.config.seeds
    ]


def network_id(place: Workplace, selection: Selection, policy: str, seed: int) -> str:
    """Name a network by everything that it is trained from."""
    training = place.config.training
    kind = training.policy(policy).model_dump(mode="json")
    settings = training.model_dump(mode="json", exclude={"device", "size", "policies"})
    text = json.dumps([selection.selection_id, seed, kind, settings], sort_keys=True)
    return f"{policy}-s{seed}-{hashlib.sha256(text.encode()).hexdigest()[:12]}"


def selected_demonstrations(place: Workplace, pool: Pool, selection: Selection) -> Demonstrations:
    """Read a selection's trajectories from the lake as demonstrations."""
    position = dict(zip(pool.targets["target_id"].to_pylist(), pool.target_positions(), strict=True))
    targets = np.array([position[target] for target in selection.kept["target_id"].to_pylist()])
    steps, weight = selection.kept["steps"].to_pylist(), selection.kept["weight"]
    return demonstrations(
        place.robot,
        place.scene,
        selected_waypoints(place, pool, selection),
        targets,
        place.config.training,
        steps=[kept if kept is None else np.array(kept, dtype=np.int64) for kept in steps],
        weights=None if weight.null_count == len(weight) else weight.to_numpy(),
    )


def selected_waypoints(place: Workplace, pool: Pool, selection: Selection) -> list[FloatArray]:
    """Waypoints of a selection's trajectories: the selection's own where it has some, else the lake's."""
    if selection.kept["q"].null_count:
        return load_waypoints(place.lake, pool.partition, selection.ids)
    return waypoint_arrays(selection.kept["q"])


def keep(policy: TrainedPolicy, folder: Path) -> None:
    """Store a policy whole or not at all: a killed run must not leave half a network behind."""
    unfinished = folder.with_name(f".{folder.name}.{uuid4().hex}")
    policy.save(unfinished)
    try:
        unfinished.rename(folder)
    except OSError:  # another run has just stored the same network
        shutil.rmtree(unfinished)
