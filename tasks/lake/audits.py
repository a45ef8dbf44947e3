"""What must hold in every lake, as queries that find nothing."""

from __future__ import annotations

from collections.abc import Mapping

from plancurate.sql import load, names
from plancurate.tasks.lake.store import Lake


def failed_audits(
    lake: Lake, levels: Mapping[str, str] | None = None, *, sound_only: bool = False
) -> dict[str, int]:
    """Run every sql/audits query over the partitions that match; returns rows found by those that found any.

    With a study's pool and name as levels (robot, scene, pool, study) these are the audits of what it wrote.
    PlancurateError for a damaged part there, unless `sound_only` leaves it out.
    """
    with lake.connect(levels, sound_only=sound_only) as connection:
        counts = {name: connection.sql(load(name)).shape[0] for name in names("audits")}
    return {name.removeprefix("audits/"): count for name, count in counts.items() if count}
