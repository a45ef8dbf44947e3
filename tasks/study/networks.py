"""A study's networks: which there are, what they learn from, and how some of them are trained together."""

from __future__ import annotations

import shutil
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from itertools import chain, pairwise
from pathlib import Path
from uuid import uuid4

import torch

from plancurate.errors import PlancurateError
from plancurate.tasks.lake.bucket import Bucket
from plancurate.tasks.lake.manifest import folder_damage
from plancurate.tasks.lake.parts import temporary_path
from plancurate.tasks.learning import corrections, train
from plancurate.tasks.learning.demonstrations import Demonstrations
from plancurate.tasks.learning.observations import find_term
from plancurate.tasks.learning.policies import TrainedPolicy, load_policy
from plancurate.tasks.study.clusters import learnt_clusters
from plancurate.tasks.study.context import StudyContext
from plancurate.tasks.study.demonstrations import selected_demonstrations
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
    round: int = 0
    """Rounds of corrections that it learns from, beside its selection."""
    cluster: int | None = None
    """The only cluster of its selection that it learns from; None: all that the selection keeps."""


def wanted_networks(study: StudyContext, selections: Sequence[WantedSelection]) -> list[Network]:
    """Return the networks that learn from these selections, policy by policy, each after every round of corrections."""
    return [
        Network(
            policy,
            selection,
            seed,
            network_id(study, selection, policy, seed, round, cluster),
            round,
            cluster,
        )
        for policy in study.config.policies
        for selection in selections
        for seed in study.config.seeds
        for round in range(study.config.corrections.rounds + 1)
        for cluster in learnt_clusters(study, selection)
    ]


def after_round(study: StudyContext, network: Network, round: int) -> Network:
    """Return what a network is after as many rounds of corrections."""
    name = network_id(study, network.selection, network.policy, network.seed, round)
    return replace(network, network_id=name, round=round)


def network_id(
    study: StudyContext,
    selection: WantedSelection,
    policy: str,
    seed: int,
    round: int = 0,
    cluster: int | None = None,
) -> str:
    """Name a network by everything that it is trained from, in no, one or more rounds of corrections."""
    training = study.pool(selection.pool).training(study.config)
    kind = training.policy(policy)
    settings = training.model_dump(mode="json", exclude={"device", "size", "policies"})
    terms = [find_term(name).revision for name in training.observation]
    revisions = [kind.revision, train.REVISION, terms]
    content = [selection.selection_id, seed, kind.model_dump(mode="json"), settings, revisions]
    if round:
        content += [round, corrections_identity(study)]
    if cluster is not None:
        content.append({"cluster": cluster})
    return f"{policy}-s{seed}-{digest(content)}"


def corrections_identity(study: StudyContext) -> list[object]:
    """Return what corrections depend on, beside the network that is corrected and its pool."""
    evaluation = study.config.evaluation.model_dump(mode="json", exclude={"seed", "device"})
    return [
        corrections.REVISION,
        study.config.corrections.model_dump(mode="json", exclude={"rounds"}),
        evaluation,
    ]


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
    """Say whether the home folder holds the network, or the lake's bucket, which it is then copied from."""
    folder = network_folder(study, network)
    if study.lake.bucket and not folder.is_dir():
        study.lake.bucket.pull_network(folder)
    return folder.is_dir()


def load_network(study: StudyContext, network: Network) -> TrainedPolicy:
    """Load a network that was trained before; raises PlancurateError otherwise."""
    folder = network_folder(study, network)
    if not is_trained(study, network):
        raise PlancurateError(
            f"{folder}: {network.policy} is not trained on {network.selection.selection_id}; "
            f"{'refine' if network.round else 'train'} first"
        )
    return load_policy(folder)


def groups(study: StudyContext, networks: Sequence[Network]) -> list[tuple[Network, ...]]:
    """Return networks in groups to be worked on together: one policy and pool, about equal, at most GROUP unlike ones.

    Neighbours stay together, for they mostly learn from the same selection, whose demonstrations are then built once.
    """
    kinds = dict.fromkeys((network.policy, network.selection.pool) for network in networks)
    result: list[tuple[Network, ...]] = []
    for kind in kinds:
        own = twins(study, [n for n in networks if (n.policy, n.selection.pool) == kind])
        count = -(-len(own) // GROUP)
        ends = [len(own) * i // count for i in range(count + 1)]
        result += [tuple(chain.from_iterable(own[begin:end])) for begin, end in pairwise(ends)]
    return result


def twins(study: StudyContext, networks: Sequence[Network]) -> list[list[Network]]:
    """Return networks of one policy and pool with those together that come out the same: what one did holds for all.

    They learn from the same from the same seed: selectors often keep the same trajectories.
    """
    found: dict[tuple[str, int], list[Network]] = {}
    for network in networks:
        found.setdefault((material(study, network), network.seed), []).append(network)
    return list(found.values())


def titles(together: Sequence[tuple[Network, ...]]) -> list[str]:
    """Name each group for a person: by its policy, counted where a policy has several."""
    policies = [group[0].policy for group in together]
    result = []
    for i, policy in enumerate(policies):
        number, count = policies[: i + 1].count(policy), policies.count(policy)
        result.append(policy if count == 1 else f"{policy} {number}/{count}")
    return result


def train_networks(study: StudyContext, networks: Sequence[Network]) -> None:
    """Train networks of one policy and pool together, twins once, and keep each in a folder of its own."""
    torch.set_num_threads(1)  # a group a core: threads inside one small network spin more than they compute
    alike = twins(study, networks)
    unlike = [same[0] for same in alike]
    data: dict[str, Demonstrations] = {}  # networks of different seeds learn from the same
    for network in unlike:
        if (key := material(study, network)) not in data:
            learnt = [after_round(study, network, r).network_id for r in range(1, network.round + 1)]
            data[key] = selected_demonstrations(study, network.selection, learnt, network.cluster)
    trained = train.train(
        networks[0].policy,
        [data[material(study, network)] for network in unlike],
        [network.seed for network in unlike],
        study.pool(networks[0].selection.pool).training(study.config),
    )
    for same, result in zip(alike, trained, strict=True):
        for network in same:
            keep(result, network_folder(study, network), study.lake.bucket)


def material(study: StudyContext, network: Network) -> str:
    """Name what a network learns from: what its selection keeps; corrections, and a cluster's tests, are its own."""
    own = network.round > 0 or network.cluster is not None
    return network.network_id if own else kept_content(study, network.selection)


@lru_cache(maxsize=4096)  # short names of selections that are too large to be kept all
def kept_content(study: StudyContext, selection: WantedSelection) -> str:
    """Name what a selection keeps by its content: selectors of different names may keep the same."""
    kept = make_selection(study, selection).kept.select(["trajectory_id", "steps", "weight", "q"])
    return digest(kept.to_pylist())


def keep(policy: TrainedPolicy, folder: Path, bucket: Bucket | None) -> None:
    """Store a policy whole or not at all: a killed run must not leave half a network behind."""
    unfinished = temporary_path(folder)
    try:
        policy.save(unfinished)
        if bucket:
            bucket.put_network(folder, unfinished)
        unfinished.rename(folder)
    except OSError as error:
        if not folder.is_dir():  # or another run has just stored the same network
            error.filename = error.filename or str(folder)
            raise
    finally:
        shutil.rmtree(unfinished, ignore_errors=True)
