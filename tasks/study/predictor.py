"""Which of a study's networks predicts motions, and how it is found again."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from plancurate.errors import PlancurateError, UnknownNameError
from plancurate.robots import Robot, Scene, load_world
from plancurate.robots.scene_family import is_family
from plancurate.tasks.curation.pool import FloatArray
from plancurate.tasks.lake.home import Home
from plancurate.tasks.lake.store import Lake
from plancurate.tasks.learning.policies import TrainedPolicy
from plancurate.tasks.motion.predict import PredictSettings
from plancurate.tasks.study.clusters import answering_clusters
from plancurate.tasks.study.config import StudyConfig
from plancurate.tasks.study.context import PoolContext, StudyContext, open_study
from plancurate.tasks.study.network_cells import Cell as NetworkCell
from plancurate.tasks.study.network_cells import cell_of_network, cell_of_row
from plancurate.tasks.study.networks import Network, load_network, wanted_networks
from plancurate.tasks.study.results import headline_networks, study_results
from plancurate.tasks.study.rows import ALL_SCENES, Cell, ResultRow
from plancurate.tasks.study.selections import study_pool, wanted_selections
from plancurate.tasks.study.studies import find_study, recorded_study
from plancurate.tasks.study.verdict import verdicts


@dataclass(frozen=True)
class Choice:
    """Which network of a study is meant; what is left out is the study's best."""

    study: str
    key: str | None = None
    scene: str | None = None
    selector: str | None = None
    """With or without its budget, as results show it."""
    policy: str | None = None


@dataclass(frozen=True, eq=False)
class StudyPolicy:
    """A trained network with the world and the settings that it was trained and tested in."""

    row: ResultRow
    """How it did in the study."""
    trained: TrainedPolicy
    robot: Robot
    scene: Scene
    sources: tuple[str, str]
    """Robot and scene as the study names them: what another process loads them by."""
    settings: PredictSettings


def study_policy(home: Home, choice: Choice) -> StudyPolicy:
    """Find and load a network; PlancurateError for a study without results, or for a name that it does not have."""
    lake = Lake(home.lake)
    study = find_study(lake, choice.study, choice.key)
    row = chosen_row(lake, study, choice)
    opened = reopened(home, study)
    network = network_of(opened, cell_of_row(row))
    if network.cluster is not None:
        raise PlancurateError(
            f"study {study}: has a policy for each cluster; motions need one for all targets"
        )
    pool = opened.pool(network.selection.pool)
    pool.require_one_scene("predict")
    sources = (opened.config.robot, pool.scene_source)
    settings = predict_settings(opened, pool)
    return StudyPolicy(row, load_network(opened, network), pool.robot, pool.scene, sources, settings)


def predict_settings(study: StudyContext, pool: PoolContext) -> PredictSettings:
    """How motions of a pool's networks are made: as its candidates were planned and its networks tested."""
    return PredictSettings(candidates=pool.settings, rollout=study.config.evaluation)


def reopened(home: Home, study: str) -> StudyContext:
    """Open a study that ran before, by its identifier; PlancurateError where it would be another one now."""
    record = recorded_study(Lake(home.lake), study)
    opened = open_study(StudyConfig.model_validate(record.config), home)
    if opened.study != study:
        raise PlancurateError(
            f"study {study}: its robot, scenes or the package changed since it ran; run it again, as {opened.study}"
        )
    return opened


def network_of(study: StudyContext, cell: NetworkCell, position: FloatArray | None = None) -> Network:
    """The network of a study that results call by these words; only its own pool is loaded.

    Of networks of single clusters the one that answers a target at the position (3,), m; the first without any.
    """
    pool = next(one for one in study.pools if (one.scene.name, one.label) == cell[:2])
    networks = wanted_networks(study, wanted_selections(study, pool, study_pool(study, pool)))
    own = [one for one in networks if cell_of_network(study, one) == cell]
    if position is None or own[0].cluster is None:
        return own[0]
    (cluster,) = answering_clusters(study, own[0].selection, position[None])
    return next(one for one in own if one.cluster == cluster)


def study_world(lake: Lake, study: str, scene: str | None) -> tuple[Robot, Scene]:
    """Robot and scene of a study by its identifier; the scene must be named where there are several."""
    record = recorded_study(lake, study)
    config = StudyConfig.model_validate(record.config)
    single = [source for source in config.scenes if not is_family(source)]
    worlds = {scene.name: (robot, scene) for robot, scene in (load_world(config.robot, s) for s in single)}
    if not worlds:
        raise PlancurateError(f"study {study}: its scenes {', '.join(config.scenes)} vary, and one is needed")
    return worlds[one_scene(study, list(worlds), scene)]


def chosen_row(lake: Lake, study: str, choice: Choice) -> ResultRow:
    """The result row of the network that is meant: of several seeds, the one that succeeded most often."""
    rows = headline_networks(lake, study)
    if not rows:
        raise PlancurateError(f"study {study}: nothing is tested yet; run the study to its end")
    last = max(row.round for row in rows)
    scene = one_scene(study, list(dict.fromkeys(row.scene for row in rows)), choice.scene)
    rows = [row for row in rows if row.round == last and row.scene == scene]
    if choice.selector is None:
        best = best_cell(lake, study, scene)
        rows = [row for row in rows if row.cell == best]
    else:
        names = {row.name for row in rows} | {row.selector for row in rows}
        if choice.selector not in names:
            raise UnknownNameError(f"selector of study {study}", choice.selector, names)
        rows = [row for row in rows if choice.selector in (row.name, row.selector)]
    policies = {row.policy for row in rows}
    if choice.policy is not None and choice.policy not in policies:
        raise UnknownNameError(f"policy of study {study}", choice.policy, policies)
    policy = choice.policy or max(sorted(policies), key=lambda name: success(rows, name))
    return max((row for row in rows if row.policy == policy), key=lambda row: row.success_rate)


def one_scene(study: str, scenes: Sequence[str], named: str | None) -> str:
    """The scene that is named, or the only one; PlancurateError for another, or where one must be named."""
    if named is None and len(scenes) > 1:
        raise PlancurateError(
            f"study {study}: has the scenes {', '.join(scenes)}; say which one with --scene"
        )
    if named is not None and named not in scenes:
        raise UnknownNameError(f"scene of study {study}", named, scenes)
    return named or scenes[0]


def best_cell(lake: Lake, study: str, scene: str) -> Cell:
    """The selection that the study's verdict names first, in a scene."""
    found = [verdict.best[0].cell for verdict in verdicts(study_results(lake, study))]
    best = next(cell for cell in found if cell.scene in (scene, ALL_SCENES))
    return best._replace(scene=scene)


def success(rows: Sequence[ResultRow], policy: str) -> float:
    """Share of a policy's trials that succeeded, over all seeds."""
    own = [row for row in rows if row.policy == policy]
    return sum(row.successes for row in own) / sum(row.n for row in own)
