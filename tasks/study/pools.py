"""What the candidates of a study are worth: how many of them differ, and in how many ways they lead to a target."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Mapping, Sequence
from typing import Any

from plancurate.tasks.lake.store import Lake
from plancurate.tasks.study.selection_rows import PoolRow

DEGENERATE = 1 / 3


def study_pools(lake: Lake, study: str) -> list[PoolRow]:
    """Count the candidates of each pool of a study; known as soon as they are planned and the study is recorded."""
    by_pool: dict[tuple[str, str], list[Mapping[str, Any]]] = defaultdict(list)
    for row in lake.query("results/equal_candidates", study=study).to_pylist():
        by_pool[row["scene"], row["pool_label"]].append(row)
    return [_pool_row(*key, own) for key, own in by_pool.items()]


def _pool_row(scene: str, pool_label: str, rows: Sequence[Mapping[str, Any]]) -> PoolRow:
    candidates, distinct, goal_classes, ways = (
        sum(row[name] for row in rows)
        for name in ("candidates", "distinct_candidates", "goal_classes", "ways")
    )
    return PoolRow(
        scene,
        pool_label,
        targets=len(rows),
        candidates=candidates,
        distinct=distinct,
        degenerate=distinct < DEGENERATE * candidates,
        goal_classes=goal_classes / len(rows) or None,
        ways=ways / len(rows) or None,
    )
