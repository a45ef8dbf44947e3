"""Roll out every trained policy of a study and record each trial."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Sequence
from datetime import UTC, datetime

import pyarrow as pa
import torch
from prefect import flow, task
from prefect.cache_policies import NO_CACHE

from plancurate import __version__, native
from plancurate.errors import PlancurateError
from plancurate.flows.curate import study_pool
from plancurate.flows.progress import Bar, stage
from plancurate.flows.task_runs import run_all
from plancurate.flows.train import Network, networks
from plancurate.tasks.candidates.target_table import stored_targets
from plancurate.tasks.candidates.targets import sample_targets
from plancurate.tasks.lake.home import Home
from plancurate.tasks.lake.schema import table
from plancurate.tasks.learning.policies import TrainedPolicy, load_policy
from plancurate.tasks.learning.rollouts import roll_out
from plancurate.tasks.learning.test_targets import TargetsUnderTest, displaced_tests, join_tests, unseen_tests
from plancurate.tasks.study.config import StudyConfig
from plancurate.tasks.study.context import Workplace

UNSEEN_SEED_OFFSET = 1_000_003  # unseen targets come from another seed than the training targets


@flow(name="evaluate", flow_run_name="evaluate {config.name}")
def evaluate(config: StudyConfig, home: str | None = None) -> None:
    """Test what is not tested yet: one task run for each policy, all its networks and tests at once."""
    place = Workplace(config, Home.resolve(home))
    missing = [network for network in networks(place, study_pool(place)) if not is_evaluated(place, network)]
    tests = study_tests(place)
    record_study(place)
    kinds = [policy for policy in config.policies if any(network.policy == policy for network in missing)]
    with stage("evaluate", len(missing) * len(tests), "rollouts") as bar:
        calls = ((place, policy, [n for n in missing if n.policy == policy], tests, bar) for policy in kinds)
        torch.set_num_threads(1)
        run_all(evaluate_policy, calls, config.workers)


@task(
    name="evaluate",
    task_run_name="evaluate {policy}",
    tags=["evaluate"],
    timeout_seconds=6 * 3600,
    cache_policy=NO_CACHE,
    persist_result=False,
)
def evaluate_policy(
    place: Workplace, policy: str, missing: Sequence[Network], tests: TargetsUnderTest, bar: Bar
) -> None:
    """Roll a policy's networks out together and write one part of trials for each."""
    trained = [trained_policy(network) for network in missing]
    tables = roll_out(trained, place.robot, place.scene, tests, place.config.evaluation)
    for network, result, trials in zip(missing, trained, tables, strict=True):
        rows = trial_rows(network, result, evaluation_id(place, network), trials)
        place.lake.write(
            "evaluations", study_partition(place), evaluation_id(place, network), rows, place.metadata
        )
        bar.advance(len(tests))


def record_study(place: Workplace) -> None:
    """Note in the lake what the study is, so that its results can be found by name."""
    config = place.config
    row = {
        "study_key": config.key,
        "config": config.model_dump_json(),
        "robot": place.robot.name,
        "scene": place.scene.name,
        "pool": place.pool,
        "created_at": datetime.now(UTC),
        "package_version": __version__,
        "ompl_version": native.ompl_version(),
    }
    rows = pa.Table.from_pylist([row], table("studies").schema)
    place.lake.write("studies", {"study": config.name}, config.key, rows, place.metadata)


def trained_policy(network: Network) -> TrainedPolicy:
    """Load a network that was trained before; raises PlancurateError otherwise."""
    if not network.folder.is_dir():
        raise PlancurateError(
            f"{network.folder}: {network.policy} is not trained on {network.selection.selection_id}; train first"
        )
    return load_policy(network.folder)


def study_tests(place: Workplace) -> TargetsUnderTest:
    """Return the study's tests: training targets displaced, and fresh targets where it asks for some."""
    config = place.config
    targets = stored_targets(place.lake, place.partition)[: config.n_targets]
    displaced = displaced_tests(targets, config.evaluation.seed)
    if not config.unseen:
        return displaced
    settings = config.candidates.targets.model_copy(
        update={"seed": config.evaluation.seed + UNSEEN_SEED_OFFSET}
    )
    fresh = sample_targets(place.robot, place.scene, settings, 0, config.unseen)
    return join_tests(displaced, unseen_tests(fresh))


def trial_rows(network: Network, trained: TrainedPolicy, key: str, trials: pa.Table) -> pa.Table:
    """Join trials with what was tested, as rows of `evaluations`."""
    selection = network.selection
    same = {
        "evaluation_id": key,
        "selection_id": selection.selection_id,
        "selector": selection.selector,
        "budget": selection.budget,
        "policy": network.policy,
        "seed": network.seed,
        "n_kept": len(selection.kept),
        "selection_time_s": selection.selection_time_s,
        "train_s": trained.train_s,
    }
    return pa.Table.from_pylist([same | trial for trial in trials.to_pylist()])


def evaluation_id(place: Workplace, network: Network) -> str:
    """Name an evaluation by the network and everything that its tests and rollouts depend on."""
    config = place.config
    text = json.dumps(
        [
            network.folder.name,
            config.n_targets,
            config.unseen,
            config.evaluation.model_dump(mode="json", exclude={"device"}),
        ]
    )
    return f"{network.folder.name}-{hashlib.sha256(text.encode()).hexdigest()[:8]}"


def study_partition(place: Workplace) -> dict[str, str]:
    """Return the partition of the study's trials."""
    return {**place.partition, "study": study_folder(place.config)}


def study_folder(config: StudyConfig) -> str:
    """Name the study with its configuration: changed settings under an old name are another study."""
    return f"{config.name}-{config.key}"


def is_evaluated(place: Workplace, network: Network) -> bool:
    """Say whether the lake holds the network's trials."""
    return evaluation_id(place, network) in place.lake.keys("evaluations", study_partition(place))
