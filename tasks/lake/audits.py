"""What must hold in every lake, as queries that find nothing."""

from __future__ import annotations

from plancurate.sql import names
from plancurate.tasks.lake.store import Lake


def failed_checks(lake: Lake) -> dict[str, int]:
    """Run every sql/checks query; returns the number of offending rows of those that found any."""
    counts = {name: lake.query(name).num_rows for name in names("audits")}
    return {name.removeprefix("audits/"): count for name, count in counts.items() if count}
