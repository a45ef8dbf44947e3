"""The lake read with SQL: tables, stored queries and what a user asks."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Iterable, Mapping
from functools import partial
from pathlib import Path

import duckdb
import pyarrow as pa

from plancurate.errors import PlancurateError
from plancurate.sql import load
from plancurate.tasks.lake.folder import LakeFolder
from plancurate.tasks.lake.inspection import Damage, refuse
from plancurate.tasks.lake.schema import TABLES, table
from plancurate.tasks.lake.session import open_session, require_select, tables_named_in
from plancurate.tasks.lake.short_session import short_session

_READ_ATTEMPTS = 5


class Lake(LakeFolder):
    """The folder with everything that reads its tables."""

    def read(self, name: str, levels: Mapping[str, str]) -> pa.Table:
        """All rows of the partitions that match any subset of levels; the partition's columns come first."""
        kind = table(name)
        if unknown := set(levels) - set(kind.partition):
            raise ValueError(f"{name} is partitioned by {list(kind.partition)}, not by {sorted(unknown)}")
        order = ", ".join((*kind.partition, *kind.identity))
        rows = self._run(f"SELECT * FROM {name} ORDER BY {order}", levels)
        return rows.select(kind.full_schema.names).cast(kind.full_schema)

    def query(self, name: str, **parameters: object) -> pa.Table:
        """Run sql/<name>.sql over the views with bound parameters; the same parts give the same bits.

        A parameter that is called like a level ($pool, $study, ...) is that level's value.
        """
        return self._run(load(name), _levels(parameters), parameters)

    def query_sound(self, name: str, **parameters: object) -> pa.Table:
        """As `query`, over all that is sound, whatever else there is: for what there is, and what may be taken over."""
        return self._run(load(name), _levels(parameters), parameters, judge=_accept)

    def sql(self, statement: str, say: Callable[[str], object] = warnings.warn) -> pa.Table:
        """Run one SELECT of the user's: nothing is written, no file outside the lake is opened.

        Damaged parts are left out, with a line for each to `say`. PlancurateError for anything but a single
        SELECT (DESCRIBE, SUMMARIZE and SHOW count as such).
        """
        left_out: dict[Path, Damage] = {}

        def leave_out(damage: Iterable[Damage]) -> None:
            left_out.clear()  # what an earlier attempt to read saw
            left_out.update({problem.path: problem for problem in damage})

        try:
            rows = self._run(statement, {}, locked=True, judge=leave_out)
        except duckdb.Error as error:
            raise PlancurateError(f"SQL: {str(error).splitlines()[0]}") from None
        for problem in left_out.values():
            say(f"left out: {problem.line}")
        return rows

    def connect(
        self, levels: Mapping[str, str] | None = None, *, sound_only: bool = False
    ) -> duckdb.DuckDBPyConnection:
        """An in-memory DuckDB connection with all views over the parts of now; the caller closes it.

        `sound_only` leaves damaged parts out instead of refusing them.
        """
        parts, damage = self.inventory(TABLES, levels or {})
        if not sound_only:
            refuse(damage)
        return open_session(self.root, parts)

    def _run(
        self,
        statement: str,
        levels: Mapping[str, str],
        parameters: Mapping[str, object] | None = None,
        *,
        locked: bool = False,
        judge: Callable[[Iterable[Damage]], None] = refuse,
    ) -> pa.Table:
        session = partial(open_session, locked=True) if locked else short_session
        for attempts_left in reversed(range(_READ_ATTEMPTS)):
            try:
                parts, damage = self.inventory(tables_named_in(statement), levels)
                judge(damage)
                with session(self.root, parts) as connection:
                    if locked:
                        require_select(connection, statement)
                    return connection.sql(statement, params=dict(parameters or {}) or None).to_arrow_table()
            except (duckdb.IOException, FileNotFoundError):  # a listed part was merged before it was opened
                if not attempts_left:
                    raise
        raise AssertionError("unreachable")


def _levels(parameters: Mapping[str, object]) -> dict[str, str]:
    return {level: value for level, value in parameters.items() if isinstance(value, str)}


def _accept(damage: Iterable[Damage]) -> None:
    """Leave damaged parts out without a word."""
