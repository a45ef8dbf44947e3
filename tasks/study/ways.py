"""In which way each of a study's candidates leads to its target: labelled once all of a target are planned."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass

import pyarrow as pa

from plancurate.tasks.candidates.path_classes import label_paths
from plancurate.tasks.curation.pool import waypoint_arrays
from plancurate.tasks.lake.schema import table
from plancurate.tasks.study.context import PoolContext, StudyContext
from plancurate.tasks.study.scenes import rows_by_scene

BLOCK = 16
"""Targets that one task run labels and one file of the lake holds, unless that makes more blocks than BLOCKS."""
BLOCKS = 64
"""Each block opens every part of its pool: a number that grew with the pool would cost the square of its size."""


@dataclass(frozen=True)
class Block:
    """Targets of a pool whose candidates are all planned and have no labels yet."""

    pool: str
    targets: tuple[int, ...]

    @property
    def label(self) -> str:
        """Name of the part that holds the labels."""
        return f"{self.targets[0]:06d}-{self.targets[-1]:06d}"


def unlabelled(study: StudyContext) -> list[Block]:
    """Return what can be labelled and is not, pool by pool."""
    return [block for pool in study.pools for block in _unlabelled(study, pool)]


def _unlabelled(study: StudyContext, pool: PoolContext) -> list[Block]:
    planned = study.lake.query("pool/planned", **pool.partition).to_pylist()
    sources = Counter(row["target_id"] for row in planned if row["planner"] in study.sources)
    planned_by_all = {target for target, count in sources.items() if count == len(study.sources)}
    labelled = study.lake.query("study/labelled", **pool.partition, labelling=study.labelling)
    wanted = planned_by_all.intersection(range(study.config.n_targets))
    targets = sorted(wanted.difference(labelled["target_id"].to_pylist()))
    return blocks(pool.pool, targets)


def blocks(pool: str, targets: Sequence[int]) -> list[Block]:
    """Divide targets of a pool among task runs."""
    size = max(BLOCK, math.ceil(len(targets) / BLOCKS))
    return [Block(pool, tuple(targets[i : i + size])) for i in range(0, len(targets), size)]


def label_ways(study: StudyContext, block: Block) -> int:
    """Label the candidates of a block and write their ways to the lake; returns how many candidates there are."""
    pool = study.pool(block.pool)
    runs = study.lake.query(
        "study/runs", **pool.partition, planners=list(study.sources), targets=list(block.targets)
    )
    found = runs.filter(runs["q"].is_valid())
    targets = found["target_id"].to_pylist()
    names, paths = found["trajectory_id"].to_pylist(), waypoint_arrays(found["q"])
    way: dict[str, str] = {}
    for scene, rows in rows_by_scene(pool.scenes_of_targets(targets)):
        labels = label_paths(pool.robot, scene, [paths[i] for i in rows], [targets[i] for i in rows])
        way |= zip([names[i] for i in rows], labels, strict=True)
    ways = pa.array([way.get(name) for name in runs["trajectory_id"].to_pylist()], pa.string())
    labelled = (
        runs.select(["trajectory_id", "target_id"]).append_column("way", ways).cast(table("ways").schema)
    )
    partition = {**pool.partition, "labelling": study.labelling}
    study.lake.write("ways", partition, block.label, labelled, pool.metadata)
    return len(way)
