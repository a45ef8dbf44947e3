"""A study's evaluations: its tests, and how networks are rolled out on them and recorded."""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache

import numpy as np
import pyarrow as pa
import torch

from plancurate.robots import Scene
from plancurate.tasks.candidates.target_table import stored_targets
from plancurate.tasks.candidates.targets import sample_target
from plancurate.tasks.learning import nearest_clusters, rollouts, training_goals
from plancurate.tasks.learning.observations import goal_terms
from plancurate.tasks.learning.policies import TrainedPolicy
from plancurate.tasks.learning.test_targets import (
    UNSEEN_SCENE,
    TargetsUnderTest,
    UnseenKind,
    displaced_tests,
    join_tests,
    reachable_tests,
    unseen_tests,
)
from plancurate.tasks.learning.training_goals import FloatArray, TrainingGoals, chosen_goals
from plancurate.tasks.study.clusters import answering_clusters
from plancurate.tasks.study.context import PoolContext, StudyContext
from plancurate.tasks.study.identity import digest
from plancurate.tasks.study.networks import Network, load_network, twins, wanted_networks
from plancurate.tasks.study.scenes import in_their_order, rows_by_scene
from plancurate.tasks.study.selections import make_selection, study_pool, wanted_selections

UNSEEN_SEED_OFFSET = 1_000_003  # unseen targets come from another seed than the training targets


@lru_cache(maxsize=8)  # many groups of networks are tested alike, and each test is planned to
def study_tests(study: StudyContext, pool: PoolContext) -> TargetsUnderTest:
    """Return a pool's tests: training targets displaced, where a planner reaches them, and fresh targets if asked."""
    tests = drawn_tests(study, pool)
    seed = study.config.evaluation.seed
    return reachable_tests(tests, pool.robot, tested_scenes(pool, tests), pool.settings, seed)


def tested_scenes(pool: PoolContext, tests: TargetsUnderTest) -> list[Scene]:
    """Return the scene that each test of a pool lies in."""
    return pool.scenes_of_tests(tests.kind, tests.target_id.tolist())


def goals_at(
    study: StudyContext,
    pool: PoolContext,
    training: TrainingGoals | None,
    scenes: Sequence[Scene],
    positions: FloatArray,
    test_ids: Sequence[int],
) -> FloatArray | None:
    """Return the goals (t, n) that a network with these is shown at positions (t, 3), m; None where it has none."""
    if training is None:
        return None
    seed, targets = study.config.evaluation.seed, pool.settings.targets
    goals = np.empty((len(positions), pool.robot.dof))
    for scene, rows in rows_by_scene(scenes):
        seeds = [(seed, test_ids[i]) for i in rows]
        goals[rows] = chosen_goals(training, pool.robot, scene, positions[rows], targets, seeds)
    return goals


@lru_cache(maxsize=128)  # networks of one selection are shown the same, whatever their policy and seed
def goals_of_tests(
    study: StudyContext, pool: PoolContext, training: TrainingGoals | None, tests: TargetsUnderTest
) -> FloatArray | None:
    """Return the goals (t, n) that a network with these is shown at a pool's tests; None where it has none."""
    return goals_at(study, pool, training, tested_scenes(pool, tests), tests.position, tests.test_id.tolist())


def network_goals(
    study: StudyContext, pool: PoolContext, trained: Sequence[TrainedPolicy], tests: TargetsUnderTest
) -> FloatArray | None:
    """Return goal configurations (networks, tests, n) by what each network was shown; None where no term needs any."""
    goals = [goals_of_tests(study, pool, policy.goals, tests) for policy in trained]
    shown = [one for one in goals if one is not None]
    return np.stack(shown) if shown else None


def drawn_tests(study: StudyContext, pool: PoolContext) -> TargetsUnderTest:
    """Return all tests that a study draws for a pool, whether or not they can be reached."""
    config = study.config
    targets = stored_targets(study.lake, pool.partition)[: config.n_targets]
    displaced = displaced_tests(targets[: config.displaced_targets], config.evaluation.seed)
    if not config.unseen:
        return displaced
    seed = config.evaluation.seed + UNSEEN_SEED_OFFSET
    settings = pool.settings.targets.model_copy(update={"seed": seed})
    kind: UnseenKind = "unseen" if pool.family is None else UNSEEN_SCENE
    scenes = pool.scenes_of_tests([kind] * config.unseen, range(config.unseen))
    fresh = [sample_target(pool.robot, scene, settings, number) for number, scene in enumerate(scenes)]
    return join_tests(displaced, unseen_tests(fresh, kind))


def evaluation_id(study: StudyContext, network: Network) -> str:
    """Name an evaluation by the network and everything that its tests and rollouts depend on."""
    config = study.config
    settings = config.evaluation.model_dump(mode="json", exclude={"device"})
    content: list[object] = [
        network.selection.pool,
        config.n_targets,
        config.unseen,
        settings,
        rollouts.REVISION,
    ]
    if goal_terms(study.pool(network.selection.pool).training(config).observation):
        content.append(training_goals.REVISION)
    if network.cluster is not None:
        content.append({"clusters": nearest_clusters.REVISION})
    if config.displaced_targets is not None:
        content.append({"displaced_targets": config.displaced_targets})
    return f"{network.network_id}-{digest(content, 8)}"


def count_rollouts(study: StudyContext, networks: Sequence[Network]) -> int:
    """Count the trials of networks."""
    return sum(len(own_tests(study, network)) for network in networks)


def own_tests(study: StudyContext, network: Network) -> TargetsUnderTest:
    """Return the tests that a network is to answer: its pool's, or those of them nearest to its cluster."""
    tests = study_tests(study, study.pool(network.selection.pool))
    if network.cluster is None:
        return tests
    answering = answering_clusters(study, network.selection, tests.position)
    return tests.take(np.flatnonzero(answering == network.cluster))


def missing_evaluations(study: StudyContext) -> list[Network]:
    """Return the networks whose trials the lake lacks, taking over those that other studies made."""
    missing = []
    for pool in study.pools:
        known = study.lake.keys("evaluations", study.study_partition(pool))
        wanted = wanted_networks(study, wanted_selections(study, pool, study_pool(study, pool)))
        left = [network for network in wanted if evaluation_id(study, network) not in known]
        left = [network for network in left if network.cluster is None or len(own_tests(study, network))]
        missing += [network for network in left if not _take_over(study, pool, network)]
    return missing


def _take_over(study: StudyContext, pool: PoolContext, network: Network) -> bool:
    """Record trials that another study has made of the same network on the same tests, if one has."""
    key = evaluation_id(study, network)
    partition = study.lake.locate("evaluations", pool.partition, key)
    if partition is None:
        return False
    rows = study.lake.query("study/trials", evaluation_id=key, **partition)
    study.lake.write("evaluations", study.study_partition(pool), key, rows, study.metadata)
    return True


def evaluate_networks(study: StudyContext, networks: Sequence[Network]) -> int:
    """Roll networks of one policy and pool out together, twins once, and write one part of trials for each.

    Gives how many rollouts.
    """
    torch.set_num_threads(1)  # a group a core, as in training
    pool = study.pool(networks[0].selection.pool)
    alike = twins(study, networks)
    trained = [load_network(study, same[0]) for same in alike]
    if all(network.cluster is None for network in networks):
        tables = rolled_out(study, pool, trained, study_tests(study, pool))
    else:  # those of single clusters have tests of their own
        pairs = zip(alike, trained, strict=True)
        tables = [rolled_out(study, pool, [one], own_tests(study, same[0]))[0] for same, one in pairs]
    for same, policy, trials in zip(alike, trained, tables, strict=True):
        for network in same:
            rows = trial_rows(study, network, policy, trials)
            key = evaluation_id(study, network)
            study.lake.write("evaluations", study.study_partition(pool), key, rows, study.metadata)
    return sum(len(same) * len(trials) for same, trials in zip(alike, tables, strict=True))


def rolled_out(
    study: StudyContext, pool: PoolContext, trained: Sequence[TrainedPolicy], tests: TargetsUnderTest
) -> list[pa.Table]:
    """Roll policies of one kind out on tests of a pool, a scene at a time; gives a table of trials for each policy."""
    goals = network_goals(study, pool, trained, tests)
    groups = list(rows_by_scene(tested_scenes(pool, tests)))
    done = [
        rollouts.roll_out(
            trained,
            pool.robot,
            scene,
            tests.take(rows),
            study.config.evaluation,
            pool.settings.timing.dt,
            None if goals is None else goals[:, rows],
        )
        for scene, rows in groups
    ]
    order = in_their_order([rows for _, rows in groups])
    return [pa.concat_tables(of_policy).take(order) for of_policy in zip(*done, strict=True)]


def trial_rows(study: StudyContext, network: Network, trained: TrainedPolicy, trials: pa.Table) -> pa.Table:
    """Join trials with what was tested, as rows of `evaluations`."""
    selection = make_selection(study, network.selection)
    same = {
        "evaluation_id": evaluation_id(study, network),
        "selection_id": selection.selection_id,
        "selector": selection.selector,
        "budget": selection.budget,
        "selection_seed": selection.seed,
        "policy": network.policy,
        "seed": network.seed,
        "round": network.round,
        "n_kept": len(selection.kept),
        "selection_time_s": selection.selection_time_s,
        "train_s": trained.train_s,
    }
    return pa.Table.from_pylist([same | trial for trial in trials.to_pylist()])
