"""How the policies' default settings were chosen: success on development targets, which no study tests.

`experiments/defaults.py` measures it and writes the rates beside this module.
"""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from scipy.stats import kendalltau

from plancurate.tasks.report.contents import Section, Table
from plancurate.tasks.study import text

RATES = Path(__file__).with_name("development.json")
DEFAULTS = "defaults"


@dataclass(frozen=True)
class SettingRow:
    """One policy with one setting changed; rates are shares of 1, means over the development scenes."""

    policy: str
    variant: str
    mean: float
    """Over scenes and selectors."""
    by_selector: Mapping[str, float]
    agreement: float
    """Kendall's rank correlation of the selectors' order with that of the default settings."""


def development_section() -> Section:
    """The experiment's table and what it means."""
    rows = setting_rows(json.loads(RATES.read_text(encoding="utf-8")))
    words = (
        "Settings of policies are chosen on development targets of another seed, never on tested ones: each row "
        "changes one setting and is trained on every selection. A setting is as good as its mean over selectors and "
        "scenes, so that it favours no selector. The last column says whether it would order the selectors otherwise."
    )
    return Section("settings", "How settings were chosen", words, tables=[development_table(rows)])


def development_table(rows: Sequence[SettingRow]) -> Table[SettingRow]:
    """Success by policy and setting, in percent."""
    selectors = list(rows[0].by_selector)
    return Table(
        key="development",
        title="Success at development targets by setting",
        note="In percent at unseen targets. Order: rank correlation (Kendall's tau) of the selectors' order with "
        "their order under the default settings.",
        rows=rows,
        headers=("policy", "setting", "mean", *selectors, "order"),
        cells=[
            [row.policy, row.variant, text.percent(row.mean),
             *(text.percent(row.by_selector[name]) for name in selectors), f"{row.agreement:.2f}"]
            for row in rows
        ],
        queries=[],
    )  # fmt: skip


def setting_rows(rates: Sequence[Mapping[str, str | int]]) -> list[SettingRow]:
    """Rows by policy, best setting first, from rates by scene, selector, policy and variant."""
    found: dict[tuple[str, str], dict[str, list[float]]] = {}
    for rate in rates:
        cell = found.setdefault((str(rate["policy"]), str(rate["variant"])), {})
        cell.setdefault(str(rate["selector"]), []).append(int(rate["successes"]) / int(rate["n"]))
    means = {
        key: {name: float(np.mean(values)) for name, values in cell.items()} for key, cell in found.items()
    }
    rows = [
        SettingRow(policy, variant, float(np.mean(list(by.values()))), by, order(by, means[policy, DEFAULTS]))
        for (policy, variant), by in means.items()
    ]
    return sorted(rows, key=lambda row: (row.policy, -row.mean))


def order(by_selector: Mapping[str, float], default: Mapping[str, float]) -> float:
    """Kendall's tau of two orders of the same selectors."""
    return float(kendalltau([by_selector[name] for name in default], list(default.values())).statistic)
