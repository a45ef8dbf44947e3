"""How the policies' default settings were chosen: success on development targets, which no study tests.

`experiments/defaults.py` measures it and writes the rates beside this module.
"""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from plancurate.tasks.report.contents import Section, Table
from plancurate.tasks.study import text

RATES = Path(__file__).with_name("development.json")
BASE_ROW = "first edition"
"""Variant that every other one changes a setting of."""


@dataclass(frozen=True)
class SettingRow:
    """One policy with one setting changed; rates are shares of 1, means over the development scenes."""

    policy: str
    variant: str
    mean: float
    """Success over scenes and selectors."""
    settled: float
    """Likewise, of rollouts that are at the target at the step limit."""
    by_selector: Mapping[str, float]
    agreement: float
    """Kendall's rank correlation of the selectors' order with that under BASE_ROW."""


def development_section() -> Section:
    """The experiment's table and what it means."""
    rows = setting_rows(json.loads(RATES.read_text(encoding="utf-8")))
    words = (
        "These settings of policies were chosen on development targets of another seed, not on tested ones: each row "
        f"changes one setting of the {BASE_ROW}'s and is trained on every selection. A setting is as good as its mean "
        "over selectors and scenes, so that it favours no selector. The last column says whether it would order the "
        "selectors otherwise. What no row changes (learning rate, window, held steps) is the first edition's."
    )
    return Section("settings", "How settings were chosen", words, tables=[development_table(rows)])


def development_table(rows: Sequence[SettingRow]) -> Table[SettingRow]:
    """Success by policy and setting, in percent."""
    selectors = list(rows[0].by_selector)
    return Table(
        key="development",
        title="Success at development targets by setting",
        note="In percent at unseen targets. Order: rank correlation (Kendall's tau) of the selectors' order with "
        f"their order under the {BASE_ROW}'s settings. `python experiments/defaults.py` measured it.",
        rows=rows,
        headers=("policy", "setting", "mean", "settled", *selectors, "order"),
        cells=[
            [row.policy, row.variant, text.percent(row.mean), text.percent(row.settled),
             *(text.percent(row.by_selector[name]) for name in selectors), f"{row.agreement:.2f}"]
            for row in rows
        ],
        queries=[],
    )  # fmt: skip


def setting_rows(rates: Sequence[Mapping[str, str | int]]) -> list[SettingRow]:
    """Rows by policy, best setting first, from rates by scene, selector, policy and variant."""
    cells: dict[tuple[str, str], list[Mapping[str, str | int]]] = {}
    for rate in rates:
        cells.setdefault((str(rate["policy"]), str(rate["variant"])), []).append(rate)
    success = {key: mean_by_selector(own, "successes") for key, own in cells.items()}
    rows = [
        SettingRow(
            policy,
            variant,
            mean=float(np.mean(list(by.values()))),
            settled=float(np.mean(list(mean_by_selector(cells[policy, variant], "settled").values()))),
            by_selector=by,
            agreement=order(by, success[policy, BASE_ROW]),
        )
        for (policy, variant), by in success.items()
    ]
    return sorted(rows, key=lambda row: (row.policy, -row.mean))


def mean_by_selector(rates: Sequence[Mapping[str, str | int]], counted: str) -> dict[str, float]:
    """Mean share over scenes of what is counted, by selector."""
    shares: dict[str, list[float]] = {}
    for rate in rates:
        shares.setdefault(str(rate["selector"]), []).append(int(rate[counted]) / int(rate["n"]))
    return {name: float(np.mean(values)) for name, values in shares.items()}


def order(by_selector: Mapping[str, float], base: Mapping[str, float]) -> float:
    """Kendall's tau of two orders of the same selectors."""
    from scipy.stats import kendalltau  # most of a second that most reports do without

    return float(kendalltau([by_selector[name] for name in base], list(base.values())).statistic)
