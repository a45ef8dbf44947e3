"""Targets as rows of the lake."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
import pyarrow as pa

from plancurate.tasks.candidates.targets import Target
from plancurate.tasks.lake.schema import table
from plancurate.tasks.lake.store import Lake


def stored_targets(lake: Lake, partition: Mapping[str, str]) -> list[Target]:
    """Return the targets of a pool that the lake holds, in order of their numbers."""
    if not lake.keys("targets", partition):
        return []
    rows = lake.read("targets", partition).to_pylist()
    return [
        Target(row["target_id"], np.array([row["x"], row["y"], row["z"]]), np.array(row["goals"]))
        for row in rows
    ]


def target_rows(targets: Sequence[Target]) -> pa.Table:
    """Return targets as rows of the `targets` table."""
    rows = [
        {
            "target_id": target.target_id,
            **dict(zip("xyz", target.position.tolist(), strict=True)),
            "goals": target.goals.tolist(),
        }
        for target in targets
    ]
    return pa.Table.from_pylist(rows, table("targets").schema)


def targets_key(targets: Sequence[Target]) -> str:
    """Name the part that holds these targets."""
    return f"{targets[0].target_id:06d}-{targets[-1].target_id:06d}"
