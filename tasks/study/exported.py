"""Episodes of selections that studies recorded, with the robot, scene and candidates that these worked with."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from plancurate.errors import PlancurateError, UnknownNameError
from plancurate.tasks.curation.curate import stored_selection
from plancurate.tasks.curation.pool import load_waypoints
from plancurate.tasks.exports.episodes import Episodes, make_episodes
from plancurate.tasks.lake.home import Home
from plancurate.tasks.lake.store import Lake
from plancurate.tasks.learning.observations import require_terms
from plancurate.tasks.study.config import StudyConfig
from plancurate.tasks.study.context import PoolContext, StudyContext, open_study
from plancurate.tasks.study.selections import study_pool
from plancurate.tasks.study.studies import recorded_study

_LEVELS = ("robot", "scene", "pool", "study")


def exported_episodes(home: Home, names: Sequence[str], terms: Sequence[str] | None = None) -> Episodes:
    """The whole pool of the selections named, each by its id or a beginning that no other has, and what they keep.

    Observed beside the joint angles are `terms`, else where the target is and, where there are any, the obstacles.
    PlancurateError where a selection is unknown, or they were made of different candidates.
    """
    require_terms(terms or ())
    lake = Lake(home.lake)
    found = find_selections(lake, names)
    selections = [
        stored_selection(lake, {level: row[level] for level in _LEVELS}, row["selection_id"]) for row in found
    ]
    study, pool = _opened(home, found[0])
    pool.require_one_scene("export")
    told = ("target_offset", "scene_parameters") if pool.scene.shapes else ("target_offset",)
    return make_episodes(
        pool.robot,
        pool.scene,
        study_pool(study, pool),
        selections,
        lambda ids: load_waypoints(lake, pool.partition, ids),
        told if terms is None else terms,
    )


def find_selections(lake: Lake, names: Sequence[str]) -> list[Mapping[str, str]]:
    """Where the lake keeps selections: selection_id, robot, scene, pool and the study that used each last."""
    known: dict[str, Mapping[str, str]] = {}
    for row in lake.query_sound("study/selections").to_pylist():
        known.setdefault(row["selection_id"], row)
    return [known[key] for key in dict.fromkeys(_completed(name, known) for name in names)]


def _completed(name: str, known: Mapping[str, object]) -> str:
    begun = [key for key in known if key.startswith(name)]
    if name in known or len(begun) == 1:
        return name if name in known else begun[0]
    if begun:
        raise PlancurateError(f"selection {name}: {len(begun)} begin so, name one of {', '.join(begun)}")
    raise UnknownNameError("selection", name, known)


def _opened(home: Home, selection: Mapping[str, str]) -> tuple[StudyContext, PoolContext]:
    recorded = recorded_study(Lake(home.lake), selection["study"])
    study = open_study(StudyConfig.model_validate(dict(recorded.config)), home)
    for pool in study.pools:
        if pool.pool == selection["pool"]:
            return study, pool
    raise PlancurateError(
        f"selection {selection['selection_id']}: robot {recorded.robot}, scene {selection['scene']} or OMPL changed "
        f"since study {recorded.study} planned its candidates; run the study again"
    )
