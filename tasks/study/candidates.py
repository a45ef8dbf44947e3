"""A study's candidates: which parts of a pool the lake lacks, and how one of them is made."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from plancurate.errors import PlancurateError
from plancurate.tasks.candidates.consistent_goals import draw_targets
from plancurate.tasks.candidates.generate import generate_candidates
from plancurate.tasks.candidates.postprocess_pool import Setting, shared_postprocess
from plancurate.tasks.candidates.sources import find_source
from plancurate.tasks.candidates.sources.recorded import missing
from plancurate.tasks.candidates.target_table import stored_targets, target_rows, targets_key
from plancurate.tasks.candidates.targets import Target
from plancurate.tasks.study.context import PoolContext, StudyContext


@dataclass(frozen=True)
class Part:
    """One planner's runs for some targets: what one task run plans and one file of the lake holds."""

    pool: str
    planner: str
    targets: tuple[Target, ...]

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
        new = draw_targets(pool.robot, pool.scene, pool.settings, first, count, list(known.values()))
        study.lake.write("targets", pool.partition, targets_key(new), target_rows(new), pool.metadata)
        known |= {target.target_id: target for target in new}
    return [known[number] for number in range(study.config.n_targets)]


def gaps(known: Sequence[int], count: int) -> list[tuple[int, int]]:
    """Return the first and the length of each run of numbers below `count` that are not among the ascending known."""
    ends = [number for number in known if number < count] + [count]
    begins = [0, *(number + 1 for number in ends[:-1])]
    return [(begin, end - begin) for begin, end in zip(begins, ends, strict=True) if begin < end]


def missing_parts(study: StudyContext, pool: PoolContext, targets: Sequence[Target]) -> list[Part]:
    """Return what the lake lacks of a pool, in groups of `targets_per_task`, target by target."""
    planned = study.lake.query("pool/planned", **pool.partition).to_pylist()
    done = {(row["planner"], row["target_id"]) for row in planned}
    parts, size = [], study.config.targets_per_task
    for planner in study.config.planners:
        label = find_source(planner).label
        left = [target for target in targets if (label, target.target_id) not in done]
        groups = (tuple(left[i : i + size]) for i in range(0, len(left), size))
        parts += [Part(pool.pool, planner, group) for group in groups]
    return sorted(parts, key=lambda part: part.label)


@dataclass(frozen=True)
class Planned:
    """How many runs a part holds, and how many of them gave no trajectory."""

    runs: int
    failed: int


def make_part(study: StudyContext, part: Part) -> Planned:
    """Plan, time and verify a part and write it to the lake; runs without a solution are rows with a reason."""
    pool = study.pool(part.pool)
    setting = Setting(study.config.robot, pool.scene_source, pool.settings.timing, pool.settings.verify)
    rows, _ = generate_candidates(
        pool.robot, pool.scene, list(part.targets), part.planner, pool.settings, shared_postprocess(setting)
    )
    partition = {**pool.partition, "planner": find_source(part.planner).label}
    study.lake.write("trajectories", partition, part.label, rows, pool.metadata)
    return Planned(rows.num_rows, rows["solved"].to_pylist().count(False))
