"""What a report is made of: sections of tables and figures."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from typing import TYPE_CHECKING, Any, Generic, TypeVar

from plancurate.tasks.report.commands import Query
from plancurate.tasks.report.svg import Drawing
from plancurate.tasks.study.reference_results import ReferenceRow

if TYPE_CHECKING:
    from _typeshed import DataclassInstance

RowT = TypeVar("RowT", bound="DataclassInstance", covariant=True)


@dataclass(frozen=True)
class Table(Generic[RowT]):
    """A table: typed rows for programs, the same as text for people, and the queries that its numbers are from."""

    key: str
    title: str
    note: str
    rows: Sequence[RowT]
    headers: Sequence[str]
    cells: Sequence[Sequence[str]]
    """One sequence a line, as long as headers."""
    queries: Sequence[Query]
    references: Sequence[ReferenceRow] = ()
    """What the last lines are about, where these are no `rows`."""

    def record(self) -> dict[str, Any]:
        """The table for report.json."""
        return {
            "key": self.key,
            "title": self.title,
            "note": self.note,
            "rows": [asdict(row) for row in self.rows],
            "references": [asdict(row) for row in self.references],
            "commands": [query.command for query in self.queries],
        }


@dataclass(frozen=True)
class Figure:
    """A figure: one picture, or several side by side, each with a caption of its own."""

    key: str
    title: str
    note: str
    pictures: Sequence[tuple[str, Drawing]]
    legend: Sequence[tuple[str, str]] = ()
    """What is drawn how: class of the style sheet, words."""
    small: bool = False
    """Whether the pictures are small ones, many to a line."""


@dataclass(frozen=True)
class Section:
    """A question and what answers it, in the order to be read."""

    key: str
    title: str
    text: str
    figures: Sequence[Figure] = ()
    tables: Sequence[Table[DataclassInstance]] = ()


@dataclass(frozen=True)
class Report:
    """A study's report."""

    name: str
    verdict: Sequence[str]
    """Sentences, the most important first."""
    overview: str
    """What the study covers."""
    sections: Sequence[Section]
    setup: Mapping[str, Any]
    """All that is needed to repeat the study: what to JSON values."""

    @property
    def tables(self) -> list[Table[DataclassInstance]]:
        """Every table, in the order to be read."""
        return [table for section in self.sections for table in section.tables]

    @property
    def figures(self) -> list[Figure]:
        """Every figure, in the order to be read."""
        return [figure for section in self.sections for figure in section.figures]
