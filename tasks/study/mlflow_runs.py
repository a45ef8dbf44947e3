"""What MLflow shows of a study: a parent run, a run for each selection of each pool, and one for each network."""

from __future__ import annotations

from collections.abc import Sequence

from plancurate import native
from plancurate.robots import Robot
from plancurate.tasks.curation.names import label
from plancurate.tasks.curation.selectors.selection import Selection
from plancurate.tasks.learning.policies import TrainedPolicy
from plancurate.tasks.motion.served import ServedWorld
from plancurate.tasks.study import text
from plancurate.tasks.study.context import PoolContext, StudyContext
from plancurate.tasks.study.evaluations import evaluation_id
from plancurate.tasks.study.mlflow_records import ChildRun, StudyRun
from plancurate.tasks.study.mlflow_store import ensure_store
from plancurate.tasks.study.network_cells import cell_of_network, cell_of_row
from plancurate.tasks.study.networks import Network, load_network, network_folder
from plancurate.tasks.study.predictor import predict_settings
from plancurate.tasks.study.results import headline_networks
from plancurate.tasks.study.rows import ALL_SCENES, Cell, ResultRow, SummaryRow
from plancurate.tasks.study.selections import make_selection
from plancurate.tasks.study.tracking import log_child, start_study

Metrics = dict[str, float]


def open_parent_run(study: StudyContext, networks: Sequence[Network]) -> StudyRun:
    """Open the study's parent run in MLflow and those of these networks' selections, anew or where they were left."""
    config = study.config
    flat = {name: value for name, value in config.model_dump(mode="json").items() if name != "candidates"}
    scenes = dict.fromkeys(pool.scene.name for pool in study.pools)
    tags = {"robot": study.pools[0].robot.name, "scene": ", ".join(scenes), "study": config.name}
    uri = ensure_store(study.home.mlflow_db)
    selections = {
        selection_title(study, cell_of(study, network)): {
            "selector": network.selection.choice.label,
            "budget": text.budget(network.selection.budget),
            "policy": "all",
        }
        for network in networks
    }
    return start_study(uri, study.home.artifacts, config.name, study.study, flat, tags, selections)


def cell_of(study: StudyContext, network: Network) -> Cell:
    """Say which selection a network learns from, in the words of result rows."""
    wanted, pool = network.selection, study.pool(network.selection.pool)
    return Cell(pool.scene.name, pool.label, wanted.choice.label, wanted.budget)


def selection_title(study: StudyContext, cell: Cell) -> str:
    """Name a selection's run, with scene and variant of the candidates where there are several."""
    where = [cell.scene, cell.pool_label] if len(study.pools) > 1 else []
    return " ".join(filter(None, [*where, label(cell.selector, cell.budget)]))


def selection_metrics(study: StudyContext, rows: Sequence[SummaryRow]) -> dict[str, Metrics]:
    """Return what each selection achieved over all its networks, by the title of its run."""
    return {
        selection_title(study, row.cell): {
            **success_metrics(row),
            "settled_rate": row.settled_rate,
            "selection_time_s": row.selection_time_s,
            "n": row.n,
        }
        for row in rows
        if row.scene != ALL_SCENES
    }


def best_metrics(row: SummaryRow) -> Metrics:
    """Return what the best selection achieved, for the parent run."""
    return {f"best_{name}": value for name, value in success_metrics(row).items()}


def success_metrics(row: SummaryRow) -> Metrics:
    """Return a selection's success over all its networks, with its interval."""
    return {
        "success_rate": row.success_rate,
        "success_low": row.interval.low,
        "success_high": row.interval.high,
    }


def log_networks(study: StudyContext, run: StudyRun, networks: Sequence[Network]) -> None:
    """Record one child run for each of these networks, unless an earlier run of the study did.

    Networks of single clusters have none: results are those of all clusters of a selection together.
    """
    rows = {cell_of_row(row): row for row in headline_networks(study.lake, study.study)}
    for network in (one for one in networks if one.cluster is None):
        log_child(run, child_run(study, network, rows[cell_of_network(study, network)]))


def child_run(study: StudyContext, network: Network, row: ResultRow) -> ChildRun:
    """Gather what MLflow shows of one network."""
    pool = study.pool(network.selection.pool)
    selection, policy = make_selection(study, network.selection), load_network(study, network)
    return ChildRun(
        evaluation_id=evaluation_id(study, network),
        study_name=study.config.name,
        selection_title=selection_title(study, row.cell),
        selector=selection.selector,
        budget=selection.budget,
        policy=network.policy,
        seed=network.seed,
        params=shown_params(study, selection, policy),
        metrics=shown_metrics(row, selection, policy),
        loss_curve=policy.loss_curve,
        pool_hash=selection.pool_hash,
        selection_id=selection.selection_id,
        n_kept=row.n_kept,
        model_folder=network_folder(study, network),
        world=served_world(study, pool),
        example=home_tool(pool.robot),
        tags={"robot": pool.robot.name, "scene": pool.scene.name, "pool": pool.pool},
    )


def served_world(study: StudyContext, pool: PoolContext) -> ServedWorld:
    """Return where a pool's networks make motions, as another process loads it."""
    digests = (pool.robot.digest, pool.scene.digest)
    return ServedWorld(study.config.robot, pool.scene_source, digests, predict_settings(study, pool))


def home_tool(robot: Robot) -> tuple[float, float, float]:
    """Return where the tool is at home, m."""
    x, y, z = native.fk(robot.native, robot.home[None])[0, :3, 3].tolist()
    return x, y, z


def shown_params(study: StudyContext, selection: Selection, policy: TrainedPolicy) -> dict[str, object]:
    """Return how a network came to be."""
    return {
        "steps": study.config.training.steps,
        "learning_rate": study.config.training.learning_rate,
        "selection_seed": selection.seed,
        **{f"policy.{name}": value for name, value in policy.policy.model_dump().items()},
        **{f"selector.{name}": value for name, value in selection.params.items()},
    }


def shown_metrics(row: ResultRow, selection: Selection, policy: TrainedPolicy) -> dict[str, float]:
    """Return what a network achieved, and what it cost."""
    return {
        "success_rate": row.success_rate,
        "success_low": row.ci_low,
        "success_high": row.ci_high,
        "settled_rate": row.settled_rate,
        "settled_low": row.settled_ci_low,
        "settled_high": row.settled_ci_high,
        "final_distance": row.final_distance,
        "path_length": row.path_length,
        "joint_movement": row.joint_movement,
        "selection_time_s": row.selection_time_s,
        **{f"selection_{name}_s": seconds for name, seconds in selection.seconds.items()},
        "train_time_s": policy.train_s,
        **{f"policy_{name}": value for name, value in policy.diagnostics.items()},
        "n": row.n,
        "n_kept": row.n_kept,
    }
