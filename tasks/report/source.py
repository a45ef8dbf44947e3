"""Where a report's numbers come from: one study's queries, each asked once, its lines in one order."""

from __future__ import annotations

import json
from collections.abc import Mapping
from functools import cached_property
from typing import Any, Literal

from plancurate.tasks.lake import Lake
from plancurate.tasks.report.commands import Query
from plancurate.tasks.study.results import BASELINE, find_study

Kind = Literal["displaced", "unseen"]
Selection = tuple[str, int | None]
"""Selector and budget (None: it has none)."""


class Source:
    """The results of one study on one kind of test."""

    def __init__(self, lake: Lake, study: str, kind: Kind = "displaced") -> None:
        """Find the study by its name; UnknownNameError when it has no trials."""
        self.lake, self.study, self.kind = lake, find_study(lake, study), kind
        self._asked: dict[str, list[dict[str, Any]]] = {}

    def query(self, name: str, **more: object) -> Query:
        """The query sql/results/<name>.sql about this study."""
        return Query(f"results/{name}", {"study": self.study, "kind": self.kind, **more})

    def rows(self, name: str) -> list[dict[str, Any]]:
        """Rows of that query, best selection first and otherwise as the query orders them."""
        if name not in self._asked:
            rows = self.query(name).rows(self.lake)
            self._asked[name] = sorted(rows, key=lambda row: self.order.index(selection(row)))
        return self._asked[name]

    @cached_property
    def order(self) -> list[Selection]:
        """Selections by success rate, best first."""
        return [selection(row) for row in self.query("by_selector").rows(self.lake)]

    @cached_property
    def largest(self) -> list[Selection]:
        """The selections of the largest budget and those without a budget, best first."""
        budgets = [budget for _, budget in self.order if budget is not None]
        return [(name, budget) for name, budget in self.order if budget is None or budget == max(budgets)]

    @cached_property
    def config(self) -> dict[str, Any]:
        """The study's configuration; empty where the lake does not record one."""
        return dict(json.loads(self.recorded.get("config", "{}")))

    @cached_property
    def recorded(self) -> dict[str, Any]:
        """The study's row in `studies`; empty where there is none."""
        rows = Query("results/study", {"study": self.study}).rows(self.lake)
        return rows[0] if rows else {}


def selection(row: Mapping[str, Any]) -> Selection:
    """Selector and budget of a row."""
    return row["selector"], row["budget"]


def is_base(row: Mapping[str, Any]) -> bool:
    """Whether the row is the baseline's, which keeps everything."""
    return bool(row["selector"] == BASELINE)
