"""What every table and figure of a report starts from: a study's results on one kind of test."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import TypeVar

from plancurate.tasks.report.commands import Query
from plancurate.tasks.study import text
from plancurate.tasks.study.reference_results import ReferenceRow
from plancurate.tasks.study.results import StudyResults
from plancurate.tasks.study.rows import Cell, Row, SceneRow
from plancurate.tasks.study.trial_results import Kind, KindResults

RowT = TypeVar("RowT", bound=Row)
FRESH_TITLES: Mapping[Kind, str] = {
    "unseen": "Success at fresh targets",
    "unseen_scene": "Success in fresh scenes",
}


@dataclass(frozen=True)
class Source:
    """A study's results on one kind of test."""

    results: StudyResults
    kind: Kind

    @property
    def tests(self) -> KindResults:
        """Rows of the trials."""
        return self.results.on(self.kind)

    def query(self, name: str, *, kind: bool = False) -> Query:
        """The query sql/results/<name>.sql about this study, and about this kind of test where it asks for one."""
        study = {"study": self.results.study.study}
        return Query(f"results/{name}", study | {"kind": self.kind} if kind else study)

    @cached_property
    def order(self) -> list[Cell]:
        """Selections by scene, all scenes first, in each the best first."""
        return [row.cell for row in self.tests.summaries]

    @cached_property
    def groups(self) -> list[tuple[str, str]]:
        """Scenes with their pool labels in the order of the tables."""
        return list(dict.fromkeys((cell.scene, cell.pool_label) for cell in self.order))

    @property
    def headers(self) -> tuple[str, ...]:
        """Heads of the columns that say which selection a line is about; scene and pool only where they differ."""
        return (*(("scene",) if self._scenes else ()), *(("pool",) if self._labels else ()), "selector", "k")

    def heads(self, row: Row) -> list[str]:
        """Cells of those columns."""
        return [*self.group_cells(row), row.selector, text.budget(row.budget)]

    @property
    def references(self) -> list[ReferenceRow]:
        """What is no selection, in the order of the scenes."""
        return sorted(self.tests.references, key=lambda row: self.groups.index(row.group))

    def group_cells(self, row: SceneRow) -> list[str]:
        """Scene and pool label of a row, where a study has several."""
        return [*([row.scene] if self._scenes else []), *([row.pool_label] if self._labels else [])]

    def figure_rows(self, rows: Sequence[RowT]) -> list[RowT]:
        """Rows that figures show: the first scene's that has any, of the leader's budget or without one."""
        groups = [group for group in self.groups if any(row.group == group for row in rows)]
        return [row for row in rows if row.group == groups[0] and row.budget in (None, self._leading_budget)]

    def figure_note(self, rows: Sequence[Row]) -> str:
        """What `figure_rows` leaves out, in words."""
        shown = self.figure_rows(rows)
        scene = f"{text.group(shown[0]).capitalize()}." if shown and len(self.groups) > 1 else ""
        budgets = {row.budget for row in rows if row.budget is not None}
        budget = f"Selections of the leader's budget, k = {self._leading_budget}." if len(budgets) > 1 else ""
        return f"{scene} {budget}".strip()

    @cached_property
    def _leading_budget(self) -> int | None:
        """Budget of the first selection that has one, or figures would leave out what the verdict is about."""
        return next((cell.budget for cell in self.order if cell.budget is not None), None)

    @cached_property
    def _scenes(self) -> bool:
        return len({scene for scene, _ in self.groups}) > 1

    @cached_property
    def _labels(self) -> bool:
        return len({label for _, label in self.groups}) > 1
