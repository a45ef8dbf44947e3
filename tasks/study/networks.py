"""A study's networks: which there are, what they learn from, and how some of them are trained together."""

from __future__ import annotations

import shutil
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from uuid import uuid4

import numpy as np
import torch

from plancurate.errors import PlancurateError
from plancurate.tasks.curation.pool import FloatArray, load_waypoints, waypoint_arrays
from plancurate.tasks.curation.selectors.selection import Selection
from plancurate.tasks.lake.manifest import folder_damage
from plancurate.tasks.learning import train
from plancurate.tasks.learning.demonstrations import Demonstrations, demonstrations
from plancurate.tasks.learning.observations import find_term
from plancurate.tasks.learning.policies import TrainedPolicy, load_policy
from plancurate.tasks.study.context import StudyContext
from plancurate.tasks.study.identity import digest
from plancurate.tasks.study.selections import WantedSelection, make_selection

GROUP = 24
"""Networks trained in one task run at most: enough to share each operation, few enough to see them come."""


@dataclass(frozen=True)
class Network:
    """One network of a study: a policy, the selection it learns from, and its training seed."""

    policy: str
    selection: WantedSelection
    seed: int
    network_id: str


def wanted_networks(study: StudyContext, selections: Sequence[WantedSelection]) -> list[Network]:
    """Return the networks that learn from these selections, policy by policy."""
    return [
        Network(policy, selection, seed, network_id(study, selection.selection_id, policy, seed))
        for policy in study.config.policies
        for selection in selections
        for seed in study.config.seeds
    ]


def network_id(study: StudyContext, selection_id: str, policy: str, seed: int) -> str:
    """Name a network by everything that it is trained from."""
    training = study.config.training
    kind = training.policy(policy)
    settings = training.model_dump(mode="json", exclude={"device", "size", "policies"})
    terms = [find_term(name).revision for name in training.observation]
    revisions = [kind.revision, train.REVISION, terms]
    content = [selection_id, seed, kind.model_dump(mode="json"), settings, revisions]
    return f"{policy}-s{seed}-{digest(content)}"


def network_folder(study: StudyContext, network: Network) -> Path:
    """Return where a trained network is kept."""
    return study.home.models / network.network_id


def set_damaged_aside(study: StudyContext, networks: Sequence[Network]) -> list[str]:
    """Move the folders of damaged networks aside, so that they count as missing; returns a line for each file."""
    lines = []
    for network in networks:
        folder = network_folder(study, network)
        if folder.is_dir() and (damage := folder_damage(folder)):
            folder.rename(folder.with_name(f".{folder.name}.{uuid4().hex[:8]}.damaged"))
            lines += damage
    return lines


def is_trained(study: StudyContext, network: Network) -> bool:
    """Say whether the home folder holds the network."""
    return network_folder(study, network).is_dir()


def load_network(study: StudyContext, network: Network) -> TrainedPolicy:
    """Load a network that was trained before; raises PlancurateError otherwise."""
    folder = network_folder(study, network)
    if not folder.is_dir():
        raise PlancurateError(
            f"{folder}: {network.policy} is not trained on {network.selection.selection_id}; train first"
        )
    return load_policy(folder)


def groups(networks: Sequence[Network]) -> list[tuple[Network, ...]]:
    """Return networks in groups to be worked on together: one policy and pool, at most GROUP, about equal."""
    kinds = dict.fromkeys((network.policy, network.selection.pool) for network in networks)
    result: list[tuple[Network, ...]] = []
    for kind in kinds:
        own = [n for n in networks if (n.policy, n.selection.pool) == kind]
        count = -(-len(own) // GROUP)
        result += [tuple(own[i::count]) for i in range(count)]
    return result


def titles(together: Sequence[tuple[Network, ...]]) -> list[str]:
    """Name each group for a person: by its policy, counted where a policy has several."""
    policies = [group[0].policy for group in together]
    result = []
    for i, policy in enumerate(policies):
        number, count = policies[: i + 1].count(policy), policies.count(policy)
        result.append(policy if count == 1 else f"{policy} {number}/{count}")
    return result


def train_networks(study: StudyContext, networks: Sequence[Network]) -> None:
    """Train networks of one policy together and keep each in a folder of its own."""
    torch.set_num_threads(1)  # a group a core: threads inside one small network spin more than they compute
    selections = {network.selection.selection_id: network.selection for network in networks}
    data = {key: selected_demonstrations(study, wanted) for key, wanted in selections.items()}
    trained = train.train(
        networks[0].policy,
        [data[network.selection.selection_id] for network in networks],
        [network.seed for network in networks],
        study.config.training,
    )
    for network, result in zip(networks, trained, strict=True):
        keep(result, network_folder(study, network))


def selected_demonstrations(study: StudyContext, wanted: WantedSelection) -> Demonstrations:
    """Read a selection's trajectories from the lake as demonstrations."""
    pool, selection = study.pool(wanted.pool), make_selection(study, wanted)
    targets = study.lake.query("pool/targets", targets=None, **pool.partition).to_pylist()
    position = {row["target_id"]: [row["x"], row["y"], row["z"]] for row in targets}
    steps, weight = selection.kept["steps"].to_pylist(), selection.kept["weight"]
    return demonstrations(
        pool.robot,
        pool.scene,
        selected_waypoints(study, selection, pool.partition),
        np.array([position[target] for target in selection.kept["target_id"].to_pylist()]),
        study.config.training,
        steps=[kept if kept is None else np.array(kept, dtype=np.int64) for kept in steps],
        weights=None if weight.null_count == len(weight) else weight.to_numpy(),
    )


def selected_waypoints(
    study: StudyContext, selection: Selection, partition: dict[str, str]
) -> list[FloatArray]:
    """Waypoints of a selection's trajectories: the selection's own where it has some, else the lake's."""
    if selection.kept["q"].null_count:
        return load_waypoints(study.lake, partition, selection.ids)
    return waypoint_arrays(selection.kept["q"])


def keep(policy: TrainedPolicy, folder: Path) -> None:
    """Store a policy whole or not at all: a killed run must not leave half a network behind."""
    unfinished = folder.with_name(f".{folder.name}.{uuid4().hex}")
    policy.save(unfinished)
    try:
        unfinished.rename(folder)
    except OSError:  # another run has just stored the same network
        shutil.rmtree(unfinished)
