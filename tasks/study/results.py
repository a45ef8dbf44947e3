"""Result rows of a study: counts and means from SQL, intervals and tests from statistics."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass
from typing import Any

from plancurate.errors import UnknownNameError
from plancurate.tasks.lake import Lake
from plancurate.tasks.study.statistics import two_proportion_test, wilson_interval

BASELINE = "General"
REPORT_FIELDS = (
    "selector", "budget", "policy", "seed", "n", "successes", "success_rate", "ci_low", "ci_high",
    "settled_rate", "final_distance", "path_length", "joint_movement", "selection_time_s", "n_kept",
)  # fmt: skip


@dataclass(frozen=True)
class ResultRow:
    """A policy trained on one selection with one seed; distances in m, joint movement in rad, time in s."""

    scene: str
    pool_label: str
    selection_seed: int
    selector: str
    budget: int | None
    policy: str
    seed: int
    n: int
    successes: int
    success_rate: float
    ci_low: float
    ci_high: float
    settled_rate: float
    settled_ci_low: float
    settled_ci_high: float
    final_distance: float
    path_length: float
    joint_movement: float
    selection_time_s: float
    n_kept: int

    def report(self) -> dict[str, Any]:
        """The fields of the printed table, in its order."""
        values = asdict(self)
        return {name: values[name] for name in REPORT_FIELDS}


@dataclass(frozen=True)
class SummaryRow:
    """A selection over all policies and seeds; z, p and stars compare its success rate with General's."""

    selector: str
    budget: int | None
    n: int
    successes: int
    success_rate: float
    ci_low: float
    ci_high: float
    settled_rate: float
    settled_ci_low: float
    settled_ci_high: float
    final_distance: float
    path_length: float
    joint_movement: float
    selection_time_s: float
    n_kept: float
    z: float | None
    p: float | None
    stars: str | None


def find_study(lake: Lake, name: str) -> str:
    """The study (as `evaluations` calls it) of that full or plain name, the latest of several.

    UnknownNameError when no trial belongs to such a study.
    """
    studies = lake.query("results/studies").to_pylist()
    for study in studies:  # latest first
        if name in (study["study"], study["name"]):
            return str(study["study"])
    raise UnknownNameError("study", name, {s["name"] or s["study"] for s in studies})


def result_rows(lake: Lake, study: str, kind: str = "displaced") -> list[ResultRow]:
    """One row per selector, budget, policy and seed, in that order; kind of test: displaced or unseen."""
    rows = lake.query("results/by_policy", study=find_study(lake, study), kind=kind).to_pylist()
    return [ResultRow(**_with_rates(row)) for row in rows]


def summary_rows(lake: Lake, study: str, kind: str = "displaced") -> list[SummaryRow]:
    """One row per selector and budget over all policies and seeds, best success rate first."""
    rows = lake.query("results/by_selector", study=find_study(lake, study), kind=kind).to_pylist()
    base = next((row for row in rows if row["selector"] == BASELINE), None)
    return [SummaryRow(**_with_rates(row), **_against(row, base)) for row in rows]


def _with_rates(row: Mapping[str, Any]) -> dict[str, Any]:
    n, settled = row["n"], row["settled"]
    success, settling = wilson_interval(row["successes"], n), wilson_interval(settled, n)
    return {
        **{name: value for name, value in row.items() if name != "settled"},
        "success_rate": row["successes"] / n,
        "ci_low": success.low,
        "ci_high": success.high,
        "settled_rate": settled / n,
        "settled_ci_low": settling.low,
        "settled_ci_high": settling.high,
    }


def _against(row: Mapping[str, Any], base: Mapping[str, Any] | None) -> dict[str, Any]:
    if base is None or row is base:
        return {"z": None, "p": None, "stars": None}
    test = two_proportion_test(row["successes"], row["n"], base["successes"], base["n"])
    return {"z": test.statistic, "p": test.p, "stars": test.stars}
