"""The lake as one study sees it, held for many questions after each other."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

import duckdb
import pyarrow as pa

from plancurate.sql import load, names
from plancurate.tasks.lake.inspection import refuse
from plancurate.tasks.lake.session import tables_named_in
from plancurate.tasks.lake.short_session import own_session
from plancurate.tasks.lake.store import Lake


class HeldLake(Lake):
    """A lake that answers sql/results/ for one study from a session that has the study's trials in memory.

    Nearly all of these queries read all trials, and each would open every part anew.
    """

    def __init__(self, lake: Lake, study: str, connection: duckdb.DuckDBPyConnection) -> None:
        super().__init__(lake.root)
        self.inspection = lake.inspection
        self._study, self._connection = study, connection

    def query(self, name: str, **parameters: object) -> pa.Table:
        """Run sql/<name>.sql as any lake does; what is held are the parts that were there when it was."""
        if name in names("results") and parameters.get("study") == self._study:
            try:
                return self._connection.sql(load(name), params=parameters).to_arrow_table()
            except duckdb.IOException:  # a part was merged since then
                pass
        return super().query(name, **parameters)


@contextmanager
def held(lake: Lake, study: str) -> Iterator[Lake]:
    """Hold what the results of a study are made of; PlancurateError for a damaged part of it."""
    tables = tables_named_in(" ".join(map(load, names("results"))))
    parts, damage = lake.inventory(tables, {"study": study})
    refuse(damage)
    with own_session(lake.root, parts) as connection:
        connection.execute("CREATE TABLE trials_in_memory AS FROM evaluations")
        connection.execute("CREATE OR REPLACE VIEW evaluations AS FROM trials_in_memory")
        yield HeldLake(lake, study, connection)
