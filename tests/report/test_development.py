from __future__ import annotations

import json

import pytest

from plancurate.tasks.report.development import BASE_ROW, RATES, development_section, setting_rows
from plancurate.tasks.study.config import POLICIES


def rate(selector: str, variant: str, successes: int, scene: str = "table") -> dict[str, str | int]:
    return {
        "scene": scene, "selector": selector, "policy": "BC_MLP", "variant": variant, "n": 10, "successes": successes,
        "settled": successes // 2,
    }  # fmt: skip


def test_a_setting_is_as_good_as_its_mean_over_scenes_and_selectors() -> None:
    rates = [
        *(rate("A", BASE_ROW, n, scene) for n, scene in ((2, "table"), (4, "shelf"))),
        *(rate("B", BASE_ROW, n, scene) for n, scene in ((6, "table"), (8, "shelf"))),
        *(rate("A", "wide", n, scene) for n, scene in ((9, "table"), (9, "shelf"))),
        *(rate("B", "wide", n, scene) for n, scene in ((7, "table"), (9, "shelf"))),
    ]
    best, default = setting_rows(rates)
    assert (best.variant, best.mean, best.agreement) == ("wide", pytest.approx(0.85), -1.0)
    assert (best.settled, default.settled) == (pytest.approx(0.375), pytest.approx(0.25))
    assert (default.variant, default.mean, default.agreement) == (BASE_ROW, pytest.approx(0.5), 1.0)
    assert best.by_selector == {"A": pytest.approx(0.9), "B": pytest.approx(0.8)}


def test_reports_show_the_experiment_that_was_run() -> None:
    rates = json.loads(RATES.read_text())
    (table,) = development_section().tables
    assert {row[0] for row in table.cells} == set(POLICIES) == {one["policy"] for one in rates}
    assert len(table.cells) == len({(one["policy"], one["variant"]) for one in rates})
    assert all(len(row) == len(table.headers) for row in table.cells)
