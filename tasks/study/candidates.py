"""A study's candidates: which parts of a pool the lake lacks, and how one of them is made."""

from __future__ import annotations

from collections import Counter, defaultdict
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import lru_cache

import pyarrow as pa

from plancurate.errors import PlancurateError
from plancurate.robots import Scene
from plancurate.tasks.candidates.consistent_goals import draw_targets
from plancurate.tasks.candidates.generate import generate_candidates, trajectory_id
from plancurate.tasks.candidates.postprocess_pool import Setting, shared_postprocess
from plancurate.tasks.candidates.sources import find_source
from plancurate.tasks.candidates.sources.recorded import missing
from plancurate.tasks.candidates.target_table import stored_targets, target_rows, targets_key
from plancurate.tasks.candidates.targets import Target
from plancurate.tasks.lake.schema import table
from plancurate.tasks.study.context import PoolContext, StudyContext
from plancurate.tasks.study.scenes import rows_by_scene

REFERENCE_TARGETS = 256


@dataclass(frozen=True)
class Part:
    """One planner's runs for some targets: what one task run plans and one file of the lake holds."""

    pool: str
    planner: str
    targets: tuple[Target, ...]
    earlier: int = 0
    """The first runs, which another pool holds that is made alike with so many."""

    @property
    def label(self) -> str:
        """Name of the part: the target's number, or the first and the last of several."""
        first, last = self.targets[0].target_id, self.targets[-1].target_id
        return f"{first:04d}" if first == last else f"{first:04d}-{last:04d}"


def study_targets(study: StudyContext, pool: PoolContext) -> list[Target]:
    """Return a pool's targets from the lake, drawing and storing those that are not there yet."""
    known = {target.target_id: target for target in stored_targets(study.lake, pool.partition)}
    for first, count in gaps(sorted(known), study.config.n_targets):
        if name := pool.settings.targets.recorded:
            raise PlancurateError(f"target {first} of {study.config.n_targets}: {missing(name)}")
        new = drawn(pool, first, count, list(known.values()))
        study.lake.write("targets", pool.partition, targets_key(new), target_rows(new), pool.metadata)
        known |= {target.target_id: target for target in new}
    return [known[number] for number in range(study.config.n_targets)]


def drawn(pool: PoolContext, first: int, count: int, earlier: Sequence[Target]) -> list[Target]:
    """Draw targets `first` to `first + count - 1` of a pool, those before it given.

    Where scenes vary, each is drawn in its own, and goals that are to be consistent continue a reference's: goals that
    continue each other's where no obstacle is, so that they depend on the scene only where they are not free in it.
    """
    if pool.family is None:
        return draw_targets(pool.robot, pool.scene, pool.settings, first, count, earlier)
    numbers, known = range(first, first + count), reference_targets(pool)
    return [
        draw_targets(pool.robot, scene, pool.settings, number, 1, known)[0]
        for number, scene in zip(numbers, pool.scenes_of_targets(numbers), strict=True)
    ]


@lru_cache(maxsize=2)
def reference_targets(pool: PoolContext) -> list[Target]:
    """Targets where no obstacle is, whose goals continue each other's, numbered before all others; none if unwanted."""
    if pool.settings.plan.goals != "consistent":
        return []
    found = draw_targets(pool.robot, pool.scene, pool.settings, 0, REFERENCE_TARGETS)
    return [replace(target, target_id=-1) for target in found]


def gaps(known: Sequence[int], count: int) -> list[tuple[int, int]]:
    """Return the first and the length of each run of numbers below `count` that are not among the ascending known."""
    ends = [number for number in known if number < count] + [count]
    begins = [0, *(number + 1 for number in ends[:-1])]
    return [(begin, end - begin) for begin, end in zip(begins, ends, strict=True) if begin < end]


def missing_parts(study: StudyContext, pool: PoolContext, targets: Sequence[Target]) -> list[Part]:
    """Return what the lake lacks of a pool, in groups of `targets_per_task`, target by target."""
    planned = study.lake.query("pool/planned", **pool.partition).to_pylist()
    done = {(row["planner"], row["target_id"]) for row in planned}
    labels = {planner: find_source(planner).label for planner in study.config.planners}
    left = [
        (planner, target)
        for planner, label in labels.items()
        for target in targets
        if (label, target.target_id) not in done
    ]
    earlier = earlier_runs(study, pool) if left else Counter()
    alike: defaultdict[tuple[str, int], list[Target]] = defaultdict(list)
    for planner, target in left:
        alike[planner, earlier[labels[planner], target.target_id]].append(target)
    size = study.config.targets_per_task
    parts = [
        Part(pool.pool, planner, tuple(group[first : first + size]), runs)
        for (planner, runs), group in alike.items()
        for first in range(0, len(group), size)
    ]
    return sorted(parts, key=lambda part: part.label)


def earlier_runs(study: StudyContext, pool: PoolContext) -> Counter[tuple[str, int]]:
    """Return how many runs of a source to a target the lake has, all of them sound, in a pool of fewer runs."""
    known: Counter[tuple[str, int]] = Counter()
    for runs in range(1, pool.settings.plan.runs):
        planned = study.lake.query_sound("pool/planned", **pool.with_runs(runs).partition).to_pylist()
        known |= Counter({(row["planner"], row["target_id"]): runs for row in planned if row["runs"] == runs})
    return known


@dataclass(frozen=True)
class Planned:
    """How many runs a part holds, and how many of them gave no trajectory."""

    runs: int
    failed: int


def make_part(study: StudyContext, part: Part) -> Planned:
    """Plan, time and verify a part and write it to the lake; runs without a solution are rows with a reason."""
    pool = study.pool(part.pool)
    scenes = pool.scenes_of_targets([target.target_id for target in part.targets])
    tables = [
        planned_in(study, pool, scene, [part.targets[i] for i in rows], part.planner, part.earlier)
        for scene, rows in rows_by_scene(scenes)
    ]
    if part.earlier:
        tables.append(taken_over(study, pool, part))
    rows = pa.concat_tables(tables).sort_by([("target_id", "ascending"), ("run", "ascending")])
    partition = {**pool.partition, "planner": find_source(part.planner).label}
    study.lake.write("trajectories", partition, part.label, rows, pool.metadata)
    return Planned(rows.num_rows, rows["solved"].to_pylist().count(False))


def planned_in(
    study: StudyContext, pool: PoolContext, scene: Scene, targets: list[Target], planner: str, first_run: int
) -> pa.Table:
    """Plan, time and verify one planner's runs to targets of one scene, from `first_run` on."""
    source = pool.source_of_target(targets[0].target_id)
    setting = Setting(study.config.robot, source, pool.settings.timing, pool.settings.verify)
    postprocess = shared_postprocess(setting)
    rows, _ = generate_candidates(
        pool.robot, scene, targets, planner, pool.settings, postprocess, pool.pool, first_run
    )
    return rows


def taken_over(study: StudyContext, pool: PoolContext, part: Part) -> pa.Table:
    """The earlier runs of a part, under their names in this pool."""
    label, numbers = find_source(part.planner).label, [target.target_id for target in part.targets]
    held = pool.with_runs(part.earlier).partition
    rows = study.lake.query_sound("pool/runs", planner=label, targets=numbers, **held)
    runs = zip(rows["target_id"].to_pylist(), rows["run"].to_pylist(), strict=True)
    names = [trajectory_id(target, label, run, pool.pool) for target, run in runs]
    schema = table("trajectories").schema
    renamed = rows.set_column(rows.column_names.index("trajectory_id"), "trajectory_id", [names])
    return renamed.select(schema.names).cast(schema)
